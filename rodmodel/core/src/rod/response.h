/* Response of an equilibrium to its inputs: the linearised equations with the moment's change mu as their unknown,
 *
 *     phi' = du - u x phi,   mu' = m x du - u x mu - e3 x (f x phi + R^T dn),   du = K^-1 (mu - dm/dp),
 *     shift' = R (phi x (e3 + c (f1, f2, 0)) + c (f x phi + R^T dn)_12)
 *
 * with phi the turn of a section. Unlike those by u they want no third derivatives of the potential. They are linear,
 * so the classical Runge-Kutta method wants their coefficients at the nodes and half-way between them alone. */
#ifndef RM_RESPONSE_H
#define RM_RESPONSE_H

#include "solve.h"

/* Columns at a section: turns of the frame and changes of the moment [N m], body frame, and of r/L, base frame. */
typedef struct {
    columns_of_rows phi, moment, shift;
} response;

/* Coefficients at a section, by s/L. */
typedef struct {
    vec turn, moment, force, across;
    sym flexibility;          /* L K^-1 */
    vec by_pressure[3];       /* change of u L by the pressures at a fixed moment */
    vec moment_by_pressure[3];
    rm_real torque[2][3];     /* torque of a force, times the length, body frame; it has no part along the rod */
    rm_real frame[3][3];
    rm_real ahead, shear;
} response_coefficients;

/* Set the coefficients at a section of an equilibrium. */
static balanced_section respond_at(const equilibrium *e, rm_real fraction, quat q, vec turn, vec pull,
                                   response_coefficients *by)
{
    const rm_real length = e->length;
    const vec u = scale(R(1.0) / length, turn);
    const section_state section = linearise_by_pressure(e->section, u, by->moment_by_pressure);
    const balanced_section here = balance_section(e, fraction, q, u, pull, &section);
    by->turn = turn;
    by->moment = section.moment;
    by->force = here.force;
    by->across = here.across;
    by->flexibility = sym_scale(length, here.flexibility);
    by->ahead = here.ahead;
    by->shear = e->shear;
    matrix_rows(by->frame, mat_of_quat(q));
    for (int k = 0; k < 3; k++) {
        by->by_pressure[k] = scale(R(-1.0), sym_apply(by->flexibility, by->moment_by_pressure[k]));
    }
    /* E = -(1 - c f3) e3^ + c (e3 x f) e3^T */
    const rm_real rows[2][3] = {{R(0.0), length * here.arm, length * e->shear * here.lean.x},
                                {-length * here.arm, R(0.0), length * e->shear * here.lean.y}};
    memcpy(by->torque, rows, sizeof rows);
    return here;
}

/* Rates of the columns by s/L; those by the pressures begin at `pressures`. */
RM_INLINE void rates_of_response(const response_coefficients *by, int columns, const column_forces *forces,
                                 int pressures, const response *at, response *rate)
{
    const vec t = by->turn, m = by->moment, f = by->force, across = by->across;
    const sym h = by->flexibility;
    const rm_real (*r)[3] = by->frame, (*e)[3] = by->torque;
    for (int c = 0; c < columns; c += RM_BLOCK) {
        const block p0 = GET(at->phi[0] + c), p1 = GET(at->phi[1] + c), p2 = GET(at->phi[2] + c);
        const block m0 = GET(at->moment[0] + c), m1 = GET(at->moment[1] + c), m2 = GET(at->moment[2] + c);
        const block n0 = GET(forces->end[0] + c) + by->ahead * GET(forces->body[0] + c);
        const block n1 = GET(forces->end[1] + c) + by->ahead * GET(forces->body[1] + c);
        const block n2 = GET(forces->end[2] + c) + by->ahead * GET(forces->body[2] + c);
        const block k0 = h.xx * m0 + h.xy * m1 + h.xz * m2, k1 = h.xy * m0 + h.yy * m1 + h.yz * m2;
        const block k2 = h.xz * m0 + h.yz * m1 + h.zz * m2;
        /* Change of the force, body frame. */
        const block f0 = f.y * p2 - f.z * p1 + (r[0][0] * n0 + r[1][0] * n1 + r[2][0] * n2);
        const block f1 = f.z * p0 - f.x * p2 + (r[0][1] * n0 + r[1][1] * n1 + r[2][1] * n2);
        const block f2 = f.x * p1 - f.y * p0 + (r[0][2] * n0 + r[1][2] * n1 + r[2][2] * n2);
        PUT(rate->phi[0] + c, k0 - (t.y * p2 - t.z * p1));
        PUT(rate->phi[1] + c, k1 - (t.z * p0 - t.x * p2));
        PUT(rate->phi[2] + c, k2 - (t.x * p1 - t.y * p0));
        PUT(rate->moment[0] + c, (m.y * k2 - m.z * k1) - (t.y * m2 - t.z * m1) + (e[0][1] * f1 + e[0][2] * f2));
        PUT(rate->moment[1] + c, (m.z * k0 - m.x * k2) - (t.z * m0 - t.x * m2) + (e[1][0] * f0 + e[1][2] * f2));
        PUT(rate->moment[2] + c, (m.x * k1 - m.y * k0) - (t.x * m1 - t.y * m0));
        const block v0 = p1 - p2 * across.y + by->shear * f0, v1 = p2 * across.x - p0 + by->shear * f1;
        const block v2 = p0 * across.y - p1 * across.x;
        for (int i = 0; i < 3; i++) {
            PUT(rate->shift[i] + c, r[i][0] * v0 + r[i][1] * v1 + r[i][2] * v2);
        }
    }
    for (int k = 0; k < 3; k++) {
        const vec du = by->by_pressure[k];
        put_column(rate->phi, pressures + k, add(column_of(rate->phi, pressures + k), du));
        put_column(rate->moment, pressures + k, add(column_of(rate->moment, pressures + k), cross(m, du)));
    }
}

/* Set `to` = `from` + `by` `rate`, with the shifts or without: no rate depends on them. */
RM_INLINE void move_response(response *to, response *from, rm_real by, response *rate, int columns, int with_shift)
{
    move_rows(to->phi, from->phi, by, rate->phi, columns);
    move_rows(to->moment, from->moment, by, rate->moment, columns);
    if (with_shift) {
        move_rows(to->shift, from->shift, by, rate->shift, columns);
    }
}

/* Integrate the columns from base to end; on entry `at` has their turns at the base: those by the unknowns, then by the
 * pressures, then others. Between the nodes the equilibrium is Hermite's cubic, of order 4 as
 * the method. `kept`, if not NULL, receives columns and rates at the nodes. Sets the last node's rate, and the section
 * at the end. */
RM_INLINE void integrate_response(const equilibrium *e, vec pull, int steps, int columns, const column_forces *forces,
                                  response *at, response *kept, rm_node *nodes, march_end *end)
{
    const rm_real h = R(1.0) / (rm_real)steps, length = e->length;
    const int pressures = e->unknowns;
    response rate, near, sum;
    response_coefficients at_nodes[2], middle; /* those of node n in n % 2 */
    const balanced_section base = respond_at(e, R(0.0), e->mount, vec_of(nodes[0].turn), pull, at_nodes);
    const sym k = sym_scale(R(1.0) / length, base.section.stiffness);
    const vec stiffness[3] = {{k.xx, k.xy, k.xz}, {k.xy, k.yy, k.yz}, {k.xz, k.yz, k.zz}};
    for (int i = 0; i < 3; i++) {
        put_column(at->moment, i, stiffness[i]); /* by u L at the base */
        put_column(at->moment, pressures + i, at_nodes[0].moment_by_pressure[i]);
    }
    for (int n = 0; n < steps; n++) {
        rm_node *const next = nodes + n + 1;
        response_coefficients *const last = at_nodes + (n + 1) % 2;
        const quat after = {next->quaternion[0], vec_of(next->quaternion + 1)};
        const balanced_section there = respond_at(e, h * (rm_real)(n + 1), after, vec_of(next->turn), pull, last);
        if (n + 1 == steps) {
            put_vec(next->rate, scale(length * length, there.slope));
            put_vec(next->drift, out_of_body(after, there.across));
            end->section = there.section;
        }
        const rm_real fraction = h * ((rm_real)n + R(0.5));
        vec position, turn;
        const quat between = pose_between(nodes, steps, length, fraction * length, &position, &turn);
        respond_at(e, fraction, between, turn, pull, &middle);

        rates_of_response(at_nodes + n % 2, columns, forces, pressures, at, &rate);
        if (kept != NULL) {
            kept[2 * n] = *at;
            kept[2 * n + 1] = rate;
        }
        move_response(&sum, at, R(1.0 / 6.0) * h, &rate, columns, 1);
        for (int stage = 1; stage < 4; stage++) {
            const rm_real part = stage < 3 ? R(1.0 / 3.0) : R(1.0 / 6.0);
            move_response(&near, at, stage < 3 ? R(0.5) * h : h, &rate, columns, 0);
            rates_of_response(stage < 3 ? &middle : last, columns, forces, pressures, &near, &rate);
            move_response(stage < 3 ? &sum : at, &sum, part * h, &rate, columns, 1);
        }
    }
    if (kept != NULL) {
        rates_of_response(at_nodes + steps % 2, columns, forces, pressures, at, &rate);
        kept[2 * steps] = *at;
        kept[2 * steps + 1] = rate;
    }
}

#endif
