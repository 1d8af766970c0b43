/* Equations of the rod: its loads, its ends, and the differential equations along it.
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
 * from the arc by a e3 x u / (k0^2 + |u|^2)^(1/2) - b |u|^2 e3, with u the bending part of the free curvature. */
#ifndef RM_EQUILIBRIUM_H
#define RM_EQUILIBRIUM_H

#include "section.h"

typedef struct {
    vec end_force;       /* tip force, weight of cap and stiff tip [N] */
    vec body_force;      /* weight of the body and distributed force over its length [N] */
    vec cap_force;       /* dead forces on the cap [N] */
    vec lever;           /* dead forces on the cap times their distances from the end of the body [N m] */
    vec end_moment;      /* [N m] */
    vec follower_moment; /* [N m], frame of the cap */
    vec follower_force;  /* [N], frame of the cap */
} resultants;

/* Largest distance from an expansion of the law at which it replaces the law, over the curvature scale and the cubic
 * root of the tolerance: what that adds to the error is of third order, a twentieth of the tolerance at most. */
#define RM_NEARBY R(0.07)

typedef struct {
    const contracted *section;
    resultants loads;    /* frame of the base */
    rm_real length;      /* length of the body up to its stiff tip [m] */
    rm_real tip_length;  /* length from there to the cap's outer face [m] */
    rm_real shear;       /* shear compliance [1/N] */
    vec offset;          /* offset of the cap, frame of the body's end [m] */
    quat mount;          /* frame of the first section */
    int unknowns;        /* 3, or 6 with a follower force */
    rm_real nearby;      /* distance from an expansion of the law up to which it replaces the law [1/m] */
    /* Derivatives by the pressures, for a Jacobian. */
    vec mount_slopes[3]; /* turns of the mount, in its frame [rad/Pa] */
    vec offset_slopes[3]; /* [m/Pa] */
} equilibrium;

/* Centre of the cap's outer face, from the body's end and in its frame [m]. */
RM_INLINE vec cap_of(const equilibrium *e)
{
    const vec ahead = {R(0.0), R(0.0), R(1.0)};
    return along(e->offset, e->tip_length, ahead);
}

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

/* Offset of the cap at a free curvature, frame of the body's end [m]. */
RM_INLINE vec cap_offset(const rm_actuator *a, vec curvature)
{
    const vec bend = {curvature.x, curvature.y, R(0.0)}, draw = {R(0.0), R(0.0), -a->tip_draw * dot(bend, bend)};
    return along(draw, a->tip_offset / rm_sqrt(a->tip_offset_curvature * a->tip_offset_curvature + dot(bend, bend)),
                 axis_cross(bend));
}

/* Slope by a pressure of the turn of the first section once softened, from its slope before: `along_turn` and
 * `stiffened` are those of the softened turn from `slopes_by_pressure`, `bend` is the slope of the curvature. */
static vec softened_slope(sym flexibility, rm_real at_rest, vec slope, sym along_turn, vec stiffened, vec bend)
{
    const vec stiffer = add(sym_apply(along_turn, bend), stiffened);
    vec found = sym_apply(flexibility, sub(scale(at_rest, slope), stiffer));
    found.z = R(0.0);
    return found;
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
    /* The section at rest turns by `turn`, a softer one by K0 K^-1 of that; with growth, once more by a share. */
    const rm_real at_rest = a->base_stiffness, growth = a->base_growth;
    const int softens = at_rest != R(0.0), grows = softens && growth != R(0.0);
    const vec soft = sym_apply(flexibility, scale(at_rest, turn)), once = {soft.x, soft.y, R(0.0)};
    const vec softer = grows ? sym_apply(flexibility, scale(at_rest, once)) : no_vec();
    if (with_slopes) {
        vec moments[3], stiffened[3], more[3];
        const sym along_soft = slopes_by_pressure(e->section, soft, moments, stiffened);
        const sym along_softer = grows ? slopes_by_pressure(e->section, softer, moments, more) : along_soft;
        for (int k = 0; k < 3; k++) {
            const vec change = scale(R(-1.0), sym_apply(flexibility, moments[k]));
            bends[k].x = change.x;
            bends[k].y = change.y;
            slopes[k] = along(scale(a->base_turn, bending_axis(k)), -a->base_lag, bends[k]);
            if (softens) {
                slopes[k] = softened_slope(flexibility, at_rest, slopes[k], along_soft, stiffened[k], change);
            }
            if (grows) {
                const vec twice = softened_slope(flexibility, at_rest, slopes[k], along_softer, more[k], change);
                slopes[k] = along(slopes[k], growth, sub(twice, slopes[k]));
            }
        }
    }
    if (softens) {
        turn = once;
    }
    if (grows) {
        const vec twice = {softer.x, softer.y, R(0.0)};
        turn = along(once, growth, sub(twice, once));
    }
    e->mount = turn_by(no_turn(), turn);
    e->offset = cap_offset(a, curvature);
    if (with_slopes) {
        const rm_real room = a->tip_offset_curvature * a->tip_offset_curvature + dot(bend, bend);
        const rm_real size = a->tip_offset / rm_sqrt(room);
        const half_angle h = half_angle_of(dot(turn, turn));
        for (int k = 0; k < 3; k++) {
            const vec once = cross(turn, slopes[k]);
            e->mount_slopes[k] =
                along(along(slopes[k], R(-2.0) * h.sine * h.sine, once), h.third, cross(turn, once));
            e->offset_slopes[k] = scale(size, axis_cross(along(bends[k], -dot(bend, bends[k]) / room, bend)));
            e->offset_slopes[k].z = R(-2.0) * a->tip_draw * dot(bend, bends[k]);
        }
    }
}

/* A section of the rod under the forces on it. */
typedef struct {
    section_state section;
    sym flexibility;
    vec curvature; /* u [1/m] */
    vec slope;     /* u' [1/m^2] */
    vec force;     /* f [N] */
    vec lean;      /* e3 x f [N] */
    vec across;    /* c (f1, f2, 0): by how much the section leans */
    rm_real arm;   /* 1 - c f3 */
    rm_real ahead; /* 1 - s/L */
} balanced_section;

/* Balance a section at `fraction` of the length, with the frame `q` and the curvature u. */
RM_INLINE balanced_section balance_section(const equilibrium *e, rm_real fraction, quat q, vec curvature, vec pull,
                                           const section_state *section)
{
    balanced_section at;
    at.section = *section;
    at.curvature = curvature;
    at.ahead = R(1.0) - fraction;
    at.force = into_body(q, add(along(e->loads.end_force, at.ahead, e->loads.body_force), pull));
    at.lean = axis_cross(at.force);
    at.arm = R(1.0) - e->shear * at.force.z;
    at.across.x = e->shear * at.force.x;
    at.across.y = e->shear * at.force.y;
    at.across.z = R(0.0);
    at.flexibility = sym_inverse(section->stiffness);
    at.slope = sym_apply(at.flexibility,
                         along(scale(-at.arm, at.lean), R(-1.0), cross(curvature, section->moment)));
    return at;
}

#endif
