/* Integration along the rod: a Munthe-Kaas method of order 4, exact for constant curvature.
 *
 * With k1 ... k4 the values of u L at the stages of the classical Runge-Kutta method and h the step's part of the
 * length, the frames at the stages are R, R exp(h k1/2), R exp(h k2/2 + h^2 [k1, k2]/8) and R exp(h k3), and that at
 * the end R exp(h (k1 + 2 k2 + 2 k3 + k4)/6 + h^2 [k1, k4]/12) in se(3), with brackets of the pair (e3, u L). The shear
 * part of the position is summed with the same weights. Neighbouring solutions by the unknowns are integrated by the
 * same Runge-Kutta method in the body frame. Munthe-Kaas and Owren (1999), Phil. Trans. R. Soc. A 357, 957, sec. 4;
 * brackets have the opposite sign here, as the frame is multiplied from the right. */
#ifndef RM_MARCH_H
#define RM_MARCH_H

#include "variations.h"

/* End of an integration. */
typedef struct {
    quat frame;
    vec turn;
    vec position;          /* r [m], base frame */
    section_state section; /* section at the end */
    vec base_moment;       /* moment on the first section [N m] */
    rm_real moment_share;  /* largest moment over that of the domain, squared */
    rm_real roughness;     /* largest difference of u L between orders 4 and 2 within a step [rad] */
    rm_real sharpest;      /* largest u L at the end of a step [rad] */
    rm_real longest_way;   /* largest |r| over the arc length, squared */
    int apart;             /* whether no neighbouring solutions meet along the rod (Jacobi's condition) */
    int convex;            /* whether the stiffness of every section is positive (Legendre's condition) */
} march_end;

/* Return whether all eigenvalues are positive, given that they are real: then the coefficients of the characteristic
 * polynomial have the signs that they have for the identity. */
RM_INLINE int is_positive(mat m)
{
    const rm_real trace = m.a.x + m.b.y + m.c.z;
    const rm_real minors = (m.a.x * m.b.y - m.a.y * m.b.x) + (m.a.x * m.c.z - m.a.z * m.c.x)
                           + (m.b.y * m.c.z - m.b.z * m.c.y);
    return (trace > R(0.0)) & (minors > R(0.0)) & (determinant(m) > R(0.0));
}

RM_INLINE mat divided(mat by, mat m)
{
    const mat found = {mat_solve(by, m.a), mat_solve(by, m.b), mat_solve(by, m.c)};
    return found;
}

/* Turns of the first three neighbouring solutions, base frame. */
RM_INLINE mat turns_of(variations *at, quat frame)
{
    const mat m = {out_of_body(frame, column_of(at->phi, 0)), out_of_body(frame, column_of(at->phi, 1)),
                   out_of_body(frame, column_of(at->phi, 2))};
    return m;
}

/* Section at a curvature. With columns it comes from the law, whose expansion is written to `stored`, or from the
 * expansion `before` of another stage, if there is one and it is near; without columns from that in `stored`. */
RM_INLINE section_state section_of_shot(const equilibrium *e, vec curvature, int columns, const expansion *before,
                                        expansion *stored)
{
    if (columns == 0) {
        return is_near(stored, curvature, e->nearby) ? expand(stored, curvature) : linearise(e->section, curvature, 0);
    }
    if (before != NULL && is_near(before, curvature, e->nearby)) {
        *stored = *before;
        return expand(before, curvature);
    }
    stored->curvature = curvature;
    stored->section = linearise(e->section, curvature, 1);
    third_derivatives(e->section, stored->third);
    return stored->section;
}

RM_INLINE rm_real share_of(vec moment, const rm_domain *domain)
{
    const rm_real b = domain->moment_max, t = domain->torque_max;
    return (moment.x * moment.x + moment.y * moment.y) / (b * b) + moment.z * moment.z / (t * t);
}

/* Integrate from base to end, with `columns` neighbouring solutions by the unknowns: `at` holds them at the base, and
 * at the end on return. With columns the law's expansions at every stage and at the end, 4 steps + 1, are written to
 * `stored`; without any they are read from there. */
RM_INLINE void march(const equilibrium *e, const rm_domain *domain, vec turn, vec pull, int steps, int columns,
                     const column_forces *forces, variations *at, expansion *stored, rm_node *nodes, march_end *end)
{
    const rm_real h = R(1.0) / (rm_real)steps, length = e->length;
    quat q = e->mount;
    vec r = no_vec();
    end->moment_share = R(0.0);
    end->roughness = R(0.0);
    end->sharpest = R(0.0);
    end->longest_way = R(0.0);
    end->apart = 1;
    end->convex = 1;
    mat before = {no_vec(), no_vec(), no_vec()};
    for (int n = 0; n < steps; n++) {
        const rm_real fraction = h * (rm_real)n;
        variations rate, near, sum;
        vec drift_sum = no_vec(), turn_sum = no_vec(), rate_sum = no_vec(), k[4], rates[4];

        take(&rate, at, columns); /* overwritten before its first use: avoids a compiler's warning */
        for (int stage = 0; stage < 4; stage++) {
            const rm_real c = stage == 0 ? R(0.0) : (stage < 3 ? R(0.5) * h : h);
            const rm_real w = stage == 1 || stage == 2 ? R(2.0) : R(1.0);
            quat frame = q;
            k[stage] = turn;
            if (stage > 0) {
                vec by = scale(c, k[stage - 1]);
                if (stage == 2) {
                    by = along(by, R(0.125) * h * h, cross(k[0], k[1]));
                }
                frame = turn_by(q, by);
                k[stage] = along(turn, c, rates[stage - 1]);
                move(&near, at, c, &rate, columns);
            }
            const vec u = scale(R(1.0) / length, k[stage]);
            /* The second and the third stage lie close together, and so do the last one and the next step's first. */
            expansion *const own = stored + 4 * n + stage;
            const int has_near = stage == 2 || (stage == 0 && n > 0);
            const section_state s = section_of_shot(e, u, columns, has_near ? own - 1 : NULL, own);
            const balanced_section here = balance_section(e, fraction + c, frame, u, pull, &s);
            const vec drift = out_of_body(frame, here.across);
            rates[stage] = scale(length * length, here.slope);
            if (columns > 0) {
                linearised by;
                linearise_rates(e, &here, frame, stiffening(own->third, here.slope), forces != NULL, &by);
                rates_of_columns(&by, columns, forces, stage > 0 ? &near : at, &rate);
            }
            if (stage == 0) {
                if (n == 0) {
                    end->base_moment = s.moment;
                }
                end->moment_share = larger(end->moment_share, share_of(s.moment, domain));
                end->convex &= sym_is_positive(s.stiffness);
                put_vec(nodes[n].position, r);
                nodes[n].quaternion[0] = q.w;
                put_vec(nodes[n].quaternion + 1, q.v);
                put_vec(nodes[n].turn, turn);
                put_vec(nodes[n].rate, rates[0]);
                put_vec(nodes[n].drift, drift);
            }
            turn_sum = along(turn_sum, w, k[stage]);
            rate_sum = along(rate_sum, w, rates[stage]);
            drift_sum = along(drift_sum, w, drift);
            move(&sum, stage > 0 ? &sum : at, h * w * R(1.0 / 6.0), &rate, columns);
        }

        const vec bracket = sub(k[0], k[3]);
        const rm_real b = h * h * R(1.0 / 12.0);
        const vec way = {b * bracket.y, -b * bracket.x, h};
        const vec whole = along(scale(h * R(1.0 / 6.0), turn_sum), b, cross(k[0], k[3]));
        vec shift;
        q = screw_by(q, whole, way, &shift);
        shift = along(shift, h * R(1.0 / 6.0), drift_sum);
        r = along(r, length, shift);
        const vec next = along(turn, h * R(1.0 / 6.0), rate_sum);
        end->roughness = larger(end->roughness, largest(sub(next, k[3])));
        end->sharpest = larger(end->sharpest, largest(next));
        turn = next;
        const rm_real gone = length * h * (rm_real)(n + 1);
        end->longest_way = larger(end->longest_way, dot(r, r) / (gone * gone));
        if (columns > 0) {
            take(at, &sum, columns);
            const mat after = turns_of(at, q);
            if (n > 0) {
                end->apart &= is_positive(divided(before, after));
            }
            before = after;
        }
    }
    expansion *const at_end = stored + 4 * steps;
    const section_state last = section_of_shot(e, scale(R(1.0) / length, turn), columns, at_end - 1, at_end);
    end->moment_share = larger(end->moment_share, share_of(last.moment, domain));
    end->convex &= sym_is_positive(last.stiffness);
    end->section = last;
    end->frame = q;
    end->turn = turn;
    end->position = r;
    put_vec(nodes[steps].position, r);
    nodes[steps].quaternion[0] = q.w;
    put_vec(nodes[steps].quaternion + 1, q.v);
    put_vec(nodes[steps].turn, turn);
}

/* Residual of the end condition: the moment at the body's end [N m], body frame, then that of a follower force [N]. */
RM_INLINE void imbalance_at(const equilibrium *e, const march_end *end, vec pull, rm_real *missing)
{
    const resultants *l = &e->loads;
    const vec pulled = into_body(end->frame, pull);
    const vec lever = along(into_body(end->frame, l->lever), e->tip_length, pulled);
    const vec push = add(into_body(end->frame, l->cap_force), pulled);
    vec balance = sub(end->section.moment, into_body(end->frame, l->end_moment));
    balance = sub(sub(balance, l->follower_moment), axis_cross(lever));
    put_vec(missing, sub(balance, cross(e->offset, push)));
    if (e->unknowns == 6) {
        put_vec(missing + 3, sub(pulled, l->follower_force));
    }
}

/* Changes of the moment at the end, from the columns' changes of u L there. */
RM_INLINE void moments_of_columns(const equilibrium *e, const march_end *end, int columns, variations *at,
                                  columns_of_rows moments)
{
    for (int c = 0; c < columns; c++) {
        put_column(moments, c,
                   scale(R(1.0) / e->length, sym_apply(end->section.stiffness, column_of(at->kappa, c))));
    }
}

/* Derivatives of the residual by columns, from the turns and the changes of the moment at the end: (unknowns,
 * RM_MOST_COLUMNS) by rows. */
RM_INLINE void imbalance_changes(const equilibrium *e, const march_end *end, vec pull, int columns,
                                 const column_forces *forces, columns_of_rows turns, columns_of_rows moments,
                                 rm_real (*changes)[RM_MOST_COLUMNS])
{
    const resultants *l = &e->loads;
    const quat q = end->frame;
    const vec pulled = into_body(q, pull), moment = into_body(q, l->end_moment);
    const vec lever = along(into_body(q, l->lever), e->tip_length, pulled);
    const vec push = add(into_body(q, l->cap_force), pulled);
    for (int c = 0; c < columns; c++) {
        const vec phi = column_of(turns, c);
        vec dlever = cross(lever, phi), dpush = cross(push, phi), dpulled = cross(pulled, phi);
        if (forces != NULL) {
            const vec end_force = {forces->end[0][c], forces->end[1][c], forces->end[2][c]};
            const vec cap = {forces->cap[0][c], forces->cap[1][c], forces->cap[2][c]};
            const vec arm = {forces->lever[0][c], forces->lever[1][c], forces->lever[2][c]};
            dlever = add(dlever, into_body(q, arm));
            dpush = add(dpush, into_body(q, cap));
            if (c >= 3 && c < e->unknowns) {
                dpulled = add(dpulled, into_body(q, end_force));
            }
        }
        vec change = sub(sub(column_of(moments, c), cross(moment, phi)), axis_cross(dlever));
        change = sub(change, cross(e->offset, dpush));
        changes[0][c] = change.x;
        changes[1][c] = change.y;
        changes[2][c] = change.z;
        if (e->unknowns == 6) {
            changes[3][c] = dpulled.x;
            changes[4][c] = dpulled.y;
            changes[5][c] = dpulled.z;
        }
    }
}

#endif
