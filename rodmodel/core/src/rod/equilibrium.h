/* Equations of the rod: its loads, its ends, and the differential equations along it, with their linearisation.
 *
 * With m = dPi/du and K = d2Pi/du2 in the body frame, f = R^T n the force on a section and c the shear compliance,
 *
 *     R' = R u^,   r' = R (e3 + c (f1, f2, 0)),   K u' = -u x m - (1 - c f3) e3 x f
 *
 * with n(s) = F + (1 - s/L) W the sum of the forces beyond the section. At the end of the body
 *
 *     m = R^T M + M_f + e3 x R^T lever + o x R^T C
 *
 * with M the dead and M_f the follower moment, C the force on a cap with the offset o. A follower force R(L) F_f is a
 * dead force that is not known beforehand: it joins the unknowns. Antman (2005), Nonlinear Problems of Elasticity,
 * ch. 8; Reissner (1972), Z. angew. Math. Phys. 23, 795, for the shear.
 *
 * The ends depend on the pressures. The first section tilts by an angle proportional to the pressures' moment, less a
 * length times the free curvature that the held section does not bend; a softer section tilts more. The cap is offset
 * from the arc by a e3 x u / (k0^2 + |u|^2)^(1/2), with u the bending part of the free curvature. */
#ifndef RM_EQUILIBRIUM_H
#define RM_EQUILIBRIUM_H

#include "section.h"

/* Largest number of neighbouring solutions: derivatives by the unknowns, then by pressures, tip force and gravity. */
#define RM_MOST_COLUMNS 16

typedef struct {
    vec end_force;       /* tip force, weight of cap and stiff tip [N] */
    vec body_force;      /* weight of the body and distributed force over its length [N] */
    vec cap_force;       /* dead forces on the cap [N] */
    vec lever;           /* dead forces on the cap times their distances from the end of the body [N m] */
    vec end_moment;      /* [N m] */
    vec follower_moment; /* [N m], frame of the cap */
    vec follower_force;  /* [N], frame of the cap */
} resultants;

typedef struct {
    const contracted *section;
    resultants loads;    /* frame of the base */
    rm_real length;      /* length of the body up to its stiff tip [m] */
    rm_real tip_length;  /* length from there to the cap's outer face [m] */
    rm_real shear;       /* shear compliance [1/N] */
    vec offset;          /* offset of the cap, frame of the body's end [m] */
    quat mount;          /* frame of the first section */
    int unknowns;        /* 3, or 6 with a follower force */
    /* Derivatives by the pressures, for a Jacobian. */
    vec mount_slopes[3]; /* turns of the mount, in its frame [rad/Pa] */
    vec offset_slopes[3]; /* [m/Pa] */
} equilibrium;

/* Derivatives of the resultants by gravity. */
typedef struct {
    rm_real end_force, body_force, cap_force, lever;
} weights;

RM_INLINE weights weights_of(const rm_actuator *a)
{
    const rm_real length = a->body_length - a->stiff_tip;
    const weights w = {a->cap_mass + a->stiff_tip * a->mass_per_length, length * a->mass_per_length, a->cap_mass,
                       (a->stiff_tip + R(0.5) * a->cap_length) * a->cap_mass
                           + R(0.5) * a->stiff_tip * a->stiff_tip * a->mass_per_length};
    return w;
}

/* Sum up the loads of an input, in the frame of the base. */
static resultants resultants_of(const rm_actuator *a, const rm_input *input)
{
    resultants loads;
    memset(&loads, 0, sizeof loads);
    if (input->given & RM_LOADS) {
        vec force = vec_of(input->tip_force), moment = vec_of(input->tip_moment);
        vec gravity = vec_of(input->gravity), along_body = vec_of(input->distributed_force);
        if (input->given & RM_BASE) {
            const mat base = mat_of_rows(input->base_rotation);
            force = mat_back(base, force);
            moment = mat_back(base, moment);
            gravity = mat_back(base, gravity);
            along_body = mat_back(base, along_body);
        }
        const weights w = weights_of(a);
        const rm_real stiff = a->stiff_tip, tip = a->cap_length + stiff;
        loads.end_force = along(along(force, w.end_force, gravity), stiff, along_body);
        loads.body_force = along(scale(w.body_force, gravity), a->body_length - stiff, along_body);
        loads.cap_force = along(force, w.cap_force, gravity);
        loads.lever = along(along(scale(tip, force), w.lever, gravity), R(0.5) * stiff * stiff, along_body);
        loads.end_moment = moment;
        loads.follower_moment = vec_of(input->follower_moment);
    }
    if (input->given & RM_FOLLOWER_FORCE) {
        loads.follower_force = vec_of(input->follower_force);
    }
    return loads;
}

RM_INLINE resultants scaled(const resultants *l, rm_real by)
{
    const resultants s = {scale(by, l->end_force), scale(by, l->body_force), scale(by, l->cap_force),
                          scale(by, l->lever),     scale(by, l->end_moment), scale(by, l->follower_moment),
                          scale(by, l->follower_force)};
    return s;
}

/* Axis about which a chamber bends the rod. */
RM_INLINE vec bending_axis(int chamber)
{
    static const double sines[3] = {0.0, 0.86602540378443864676, -0.86602540378443864676};
    static const double cosines[3] = {1.0, -0.5, -0.5};
    const vec axis = {R(sines[chamber]), -R(cosines[chamber]), R(0.0)};
    return axis;
}

/* Set the ends at the pressures, and their derivatives if the law was contracted with slopes; `free` is the section at
 * the free curvature, with c phi'' and c phi''' of its ridges kept. */
static void set_ends(equilibrium *e, const rm_actuator *a, const rm_real *pressure, vec curvature,
                     const section_state *free)
{
    const int with_slopes = e->section->offset_slopes != NULL;
    vec turn = no_vec(), slopes[3] = {no_vec(), no_vec(), no_vec()}, bends[3] = {no_vec(), no_vec(), no_vec()};
    const sym flexibility = sym_inverse(free->stiffness);
    const vec bend = {curvature.x, curvature.y, R(0.0)};
    for (int k = 0; k < 3; k++) {
        turn = along(turn, a->base_turn * pressure[k], bending_axis(k));
    }
    turn = along(turn, -a->base_lag, bend);
    const vec held = scale(a->base_stiffness, turn), soft = sym_apply(flexibility, held);
    if (with_slopes) {
        vec moments[3], stiffened[3];
        const sym along_soft = slopes_by_pressure(e->section, soft, moments, stiffened);
        for (int k = 0; k < 3; k++) {
            const vec change = scale(R(-1.0), sym_apply(flexibility, moments[k]));
            bends[k].x = change.x;
            bends[k].y = change.y;
            slopes[k] = along(scale(a->base_turn, bending_axis(k)), -a->base_lag, bends[k]);
            if (a->base_stiffness != R(0.0)) {
                const vec stiffer = add(sym_apply(along_soft, change), stiffened[k]);
                slopes[k] = sym_apply(flexibility, sub(scale(a->base_stiffness, slopes[k]), stiffer));
                slopes[k].z = R(0.0);
            }
        }
    }
    if (a->base_stiffness != R(0.0)) {
        turn = soft;
        turn.z = R(0.0);
    }
    e->mount = turn_by(no_turn(), turn);
    const rm_real room = a->tip_offset_curvature * a->tip_offset_curvature + bend.x * bend.x + bend.y * bend.y;
    const rm_real size = a->tip_offset / rm_sqrt(room);
    e->offset = scale(size, axis_cross(bend));
    if (with_slopes) {
        const half_angle h = half_angle_of(dot(turn, turn));
        for (int k = 0; k < 3; k++) {
            const vec once = cross(turn, slopes[k]);
            e->mount_slopes[k] =
                along(along(slopes[k], R(-2.0) * h.sine * h.sine, once), h.third, cross(turn, once));
            e->offset_slopes[k] =
                scale(size, axis_cross(along(bends[k], -dot(bend, bends[k]) / room, bend)));
        }
    }
}

/* Neighbouring solutions at a section: turns of the frame and changes of u L, body frame, and of r/L, base frame. */
typedef struct {
    rm_real phi[3][RM_MOST_COLUMNS];
    rm_real kappa[3][RM_MOST_COLUMNS];
    rm_real shift[3][RM_MOST_COLUMNS];
} variations;

/* Derivatives of the force on a section, `end` + (1 - s/L) `body`, and of the loads on the cap, by the columns' inputs;
 * base frame. */
typedef struct {
    rm_real end[3][RM_MOST_COLUMNS];
    rm_real body[3][RM_MOST_COLUMNS];
    rm_real cap[3][RM_MOST_COLUMNS];
    rm_real lever[3][RM_MOST_COLUMNS];
    int pressures;       /* first of the three columns by pressures */
} column_forces;

RM_INLINE void matrix_rows(rm_real rows[3][3], mat m)
{
    rows[0][0] = m.a.x, rows[0][1] = m.b.x, rows[0][2] = m.c.x;
    rows[1][0] = m.a.y, rows[1][1] = m.b.y, rows[1][2] = m.c.y;
    rows[2][0] = m.a.z, rows[2][1] = m.b.z, rows[2][2] = m.c.z;
}

/* Rates by s/L at a section, of u L and of `columns` neighbouring solutions,
 *
 *     phi' = du - u x phi,   K du' = -du x m - u x K du - e3 x (f x phi + R^T dn) - dK u' - u x dm - (dK/dp) u'
 *
 * if `driven` with their forces, changes of the law and changes of r/L. With neighbouring solutions that are not
 * driven, the law's expansion is written to `stored`; without any, the section is read from it, if it is not NULL. */
RM_INLINE vec rates_at(const equilibrium *e, rm_real fraction, quat q, vec turn, vec pull, int columns, int driven,
                       const column_forces *forces, const variations *at, variations *rate, expansion *stored,
                       section_state *section, vec *drift)
{
    const rm_real length = e->length, ahead = R(1.0) - fraction;
    const vec u = scale(R(1.0) / length, turn);
    const section_state s = columns > 0 || stored == NULL ? linearise(e->section, u, columns > 0)
                                                          : linearise_near(e->section, u, stored);
    const vec n = add(along(e->loads.end_force, ahead, e->loads.body_force), pull);
    const vec f = into_body(q, n), lean = axis_cross(f);
    const rm_real arm = R(1.0) - e->shear * f.z;
    const vec torque = along(scale(-arm, lean), R(-1.0), cross(u, s.moment));
    const sym flexibility = sym_inverse(s.stiffness);
    const vec slope = sym_apply(flexibility, torque);
    const vec across = {e->shear * f.x, e->shear * f.y, R(0.0)};
    *section = s;
    *drift = out_of_body(q, across);
    if (columns == 0) {
        return scale(length * length, slope);
    }

    vec moments[3], stiffened[3];
    sym g;
    if (driven) {
        g = slopes_by_pressure(e->section, slope, moments, stiffened);
    } else {
        rm_real third[10];
        third_derivatives(e->section, third);
        g = stiffening(third, slope);
        stored->curvature = u;
        stored->section = s;
        memcpy(stored->third, third, sizeof third);
    }
    /* K du' = (m^ - u^ K - dK u') du + E (f x phi + R^T dn), E = -(1 - c f3) e3^ + c (e3 x f) e3^T; written out, as
     * compilers do not drop products with zeros. */
    const sym h = sym_scale(length * length, flexibility), k = s.stiffness;
    const vec m = s.moment;
    const rm_real t[3][3] = {{u.z * k.xy - u.y * k.xz - g.xx, u.z * k.yy - u.y * k.yz - g.xy - m.z,
                              u.z * k.yz - u.y * k.zz - g.xz + m.y},
                             {u.x * k.xz - u.z * k.xx - g.xy + m.z, u.x * k.yz - u.z * k.xy - g.yy,
                              u.x * k.zz - u.z * k.xz - g.yz - m.x},
                             {u.y * k.xx - u.x * k.xy - g.xz - m.y, u.y * k.xy - u.x * k.yy - g.yz + m.x,
                              u.y * k.xz - u.x * k.yz - g.zz}};
    const rm_real rows[3][3] = {{h.xx, h.xy, h.xz}, {h.xy, h.yy, h.yz}, {h.xz, h.yz, h.zz}};
    const rm_real per_length = R(1.0) / length;
    rm_real a[3][3], b[3][3], by_force[3][3];
    for (int i = 0; i < 3; i++) {
        const rm_real x = per_length * rows[i][0], y = per_length * rows[i][1], z = per_length * rows[i][2];
        for (int j = 0; j < 3; j++) {
            a[i][j] = x * t[0][j] + y * t[1][j] + z * t[2][j];
        }
        by_force[i][0] = -arm * rows[i][1];
        by_force[i][1] = arm * rows[i][0];
        by_force[i][2] = e->shear * (rows[i][0] * lean.x + rows[i][1] * lean.y);
        b[i][0] = by_force[i][1] * f.z - by_force[i][2] * f.y;
        b[i][1] = by_force[i][2] * f.x - by_force[i][0] * f.z;
        b[i][2] = by_force[i][0] * f.y - by_force[i][1] * f.x;
    }
    for (int c = 0; c < columns; c += RM_BLOCK) {
        const block p0 = GET(at->phi[0] + c), p1 = GET(at->phi[1] + c), p2 = GET(at->phi[2] + c);
        const block k0 = GET(at->kappa[0] + c), k1 = GET(at->kappa[1] + c), k2 = GET(at->kappa[2] + c);
        PUT(rate->phi[0] + c, k0 - (turn.y * p2 - turn.z * p1));
        PUT(rate->phi[1] + c, k1 - (turn.z * p0 - turn.x * p2));
        PUT(rate->phi[2] + c, k2 - (turn.x * p1 - turn.y * p0));
        for (int i = 0; i < 3; i++) {
            PUT(rate->kappa[i] + c,
                (a[i][0] * k0 + a[i][1] * k1 + a[i][2] * k2) + (b[i][0] * p0 + b[i][1] * p1 + b[i][2] * p2));
        }
    }
    if (forces == NULL) {
        return scale(length * length, slope);
    }

    rm_real d[3][3], r[3][3];
    matrix_rows(r, mat_of_quat(q));
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            d[i][j] = by_force[i][0] * r[j][0] + by_force[i][1] * r[j][1] + by_force[i][2] * r[j][2];
        }
    }
    for (int c = 0; c < columns; c += RM_BLOCK) {
        const block n0 = GET(forces->end[0] + c) + ahead * GET(forces->body[0] + c);
        const block n1 = GET(forces->end[1] + c) + ahead * GET(forces->body[1] + c);
        const block n2 = GET(forces->end[2] + c) + ahead * GET(forces->body[2] + c);
        for (int i = 0; i < 3; i++) {
            PUT(rate->kappa[i] + c, GET(rate->kappa[i] + c) + d[i][0] * n0 + d[i][1] * n1 + d[i][2] * n2);
        }
        if (driven) {
            /* Linearised r' = R (e3 + c (f1, f2, 0)). */
            const block p0 = GET(at->phi[0] + c), p1 = GET(at->phi[1] + c), p2 = GET(at->phi[2] + c);
            const block f0 = f.y * p2 - f.z * p1 + r[0][0] * n0 + r[1][0] * n1 + r[2][0] * n2;
            const block f1 = f.z * p0 - f.x * p2 + r[0][1] * n0 + r[1][1] * n1 + r[2][1] * n2;
            const block v0 = p1 - p2 * across.y + e->shear * f0, v1 = p2 * across.x - p0 + e->shear * f1;
            const block v2 = p0 * across.y - p1 * across.x;
            for (int i = 0; i < 3; i++) {
                PUT(rate->shift[i] + c, r[i][0] * v0 + r[i][1] * v1 + r[i][2] * v2);
            }
        }
    }
    if (driven) {
        for (int p = 0; p < 3; p++) {
            const vec push = sym_apply(h, along(scale(R(-1.0), stiffened[p]), R(-1.0), cross(u, moments[p])));
            rate->kappa[0][forces->pressures + p] += push.x;
            rate->kappa[1][forces->pressures + p] += push.y;
            rate->kappa[2][forces->pressures + p] += push.z;
        }
    }
    return scale(length * length, slope);
}

#endif
