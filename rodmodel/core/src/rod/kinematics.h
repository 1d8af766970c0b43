/* Bending angle and plane, poses along the rod, and integrals over it. */
#ifndef RM_KINEMATICS_H
#define RM_KINEMATICS_H

#include "shooting.h"

/* sin^2 of the tip's polar angle below which the bend is computed from its series. */
#define RM_FLAT R(1e-8)
/* Bending angle below which its derivatives are undefined [rad]. */
#define RM_STRAIGHT R(1e-6)
/* Parts of an arc between tangents in the count of half turns. */
#define RM_ARC_SAMPLES 16
/* Rounding of the azimuth in machine epsilons, for a rod that bends in its plane of symmetry: its free curvature comes
 * from an iteration. */
#define RM_ROUNDINGS R(4096.0)
/* Largest number of finite differences in Gregory's rule. */
#define RM_GREGORY 8

/* Half turns of the tangent in the vertical plane of the chord: a running count of crossings of -z. */
typedef struct {
    rm_real forward, up, crossings;
} half_turn_count;

RM_INLINE void count_tangent(half_turn_count *at, vec chord, vec tangent)
{
    const rm_real forward = chord.x * tangent.x + chord.y * tangent.y, up = tangent.z;
    if ((at->forward >= R(0.0)) != (forward >= R(0.0))) {
        const rm_real side = at->up * forward - at->forward * up;
        if (forward < R(0.0) && side > R(0.0)) {
            at->crossings += R(1.0);
        } else if (forward >= R(0.0) && side < R(0.0)) {
            at->crossings -= R(1.0);
        }
    }
    at->forward = forward;
    at->up = up;
}

/* Whole half turns from the first tangent to the last; the chord has unit length or is zero. */
RM_INLINE rm_real half_turns(const half_turn_count *at, rm_real first_forward, rm_real first_up)
{
    const rm_real turn = rm_atan2(at->forward, at->up) - rm_atan2(first_forward, first_up);
    return rm_floor(rm_abs(turn / RM_PI + R(2.0) * at->crossings));
}

RM_INLINE vec level(vec chord)
{
    const rm_real length = rm_sqrt(chord.x * chord.x + chord.y * chord.y);
    const rm_real s = length > R(0.0) ? R(1.0) / length : R(1.0);
    const vec v = {s * chord.x, s * chord.y, R(0.0)};
    return v;
}

/* Set angle theta, plane gamma and bend of the tip's tangent, in the frame of the base. Theta is the polar angle,
 * continued past 180 deg; gamma the azimuth of the side to which the rod bends, opposite to the tangent. "Modeling of a
 * two-degree-of-freedom fiber-reinforced soft pneumatic actuator", Robotica (2023), eqs 1-4, with two-argument
 * arctangents. */
static void put_bend(rm_solution *solution, vec tangent, rm_real turns)
{
    const rm_real sine2 = tangent.x * tangent.x + tangent.y * tangent.y, sine = rm_sqrt(sine2);
    const int vertical = sine2 == R(0.0), back = turns - R(2.0) * rm_floor(R(0.5) * turns) == R(1.0);
    const rm_real polar = rm_atan2(sine, tangent.z);
    const rm_real angle = RM_PI * turns + (back ? RM_PI - polar : polar);
    /* Subtracted, not negated: y = 0 then gives +0, and the azimuth +0 or pi. */
    const rm_real x = back ? tangent.x : R(0.0) - tangent.x, y = back ? tangent.y : R(0.0) - tangent.y;
    rm_real plane = vertical ? R(0.0) : rm_atan2(y, x);
    if (plane < R(0.0)) {
        plane = plane > -RM_ROUNDINGS * RM_EPSILON ? R(0.0) : plane + R(2.0) * RM_PI;
    }
    solution->bending_angle = angle;
    solution->bending_plane = plane;
    const rm_real ratio = (sine2 < RM_FLAT && angle < R(1.0)) ? (R(1.0) - sine2 / R(3.0)) / tangent.z : angle / sine;
    solution->bend[0] = vertical && back ? angle : ratio * x;
    solution->bend[1] = vertical && back ? R(0.0) : ratio * y;
}

/* Derivative of the bend by small turns omega of the tangent, dt = omega x t: two rows. */
static void bend_by_turn(const rm_solution *solution, vec tangent, vec rows[2])
{
    const rm_real sine2 = tangent.x * tangent.x + tangent.y * tangent.y, sine = rm_sqrt(sine2);
    const rm_real theta = solution->bending_angle;
    vec by_x, by_y; /* derivatives of both components of the bend by the tangent */
    if (sine2 < RM_FLAT && theta < R(1.0)) {
        const rm_real g = -(R(1.0) - sine2 / R(3.0)) / tangent.z;
        by_x.x = g + R(2.0 / 3.0) * tangent.x * tangent.x / tangent.z;
        by_x.y = R(2.0 / 3.0) * tangent.x * tangent.y / tangent.z;
        by_x.z = -g * tangent.x / tangent.z;
        by_y.x = by_x.y;
        by_y.y = g + R(2.0 / 3.0) * tangent.y * tangent.y / tangent.z;
        by_y.z = -g * tangent.y / tangent.z;
    } else {
        /* bend = -g (t_x, t_y), g = +-theta/sine. */
        const rm_real turns = rm_floor(theta / RM_PI);
        const rm_real sign = turns - R(2.0) * rm_floor(R(0.5) * turns) == R(1.0) ? R(-1.0) : R(1.0);
        const rm_real g = sign * theta / sine;
        /* theta = ... + sign polar, and polar by (sine, t_z): (t_z, -sine) on the unit sphere. */
        const rm_real by_sine = (sign * sign * tangent.z - sign * theta / sine) / sine, by_up = -R(1.0);
        by_x.x = -g - by_sine * tangent.x * tangent.x / sine;
        by_x.y = -by_sine * tangent.x * tangent.y / sine;
        by_x.z = -by_up * tangent.x;
        by_y.x = by_x.y;
        by_y.y = -g - by_sine * tangent.y * tangent.y / sine;
        by_y.z = -by_up * tangent.y;
    }
    /* v . (omega x t) = omega . (t x v) */
    rows[0] = cross(tangent, by_x);
    rows[1] = cross(tangent, by_y);
}

/* Weights of `steps` + 1 equally spaced points in the integral over unit length: Gregory's rule, with up to 8 finite
 * differences. Davis and Rabinowitz (1984), Methods of Numerical Integration, sec. 2.9. */
static void integral_weights(int steps, rm_real *w)
{
    static const double factors[RM_GREGORY] = {1.0 / 12,       1.0 / 24,         19.0 / 720,         3.0 / 160,
                                               863.0 / 60480,  275.0 / 24192,    33953.0 / 3628800,  8183.0 / 1036800};
    const int most = steps < RM_GREGORY ? steps : RM_GREGORY;
    double binomial[RM_GREGORY + 1] = {1.0}, ends[RM_GREGORY + 1] = {0.5};
    for (int k = 1; k <= most; k++) {
        /* Coefficients of the k-th difference, from the end inwards: (-1)^i binomial(k, i). */
        for (int i = k; i > 0; i--) {
            binomial[i] = (i < k ? binomial[i] : 0.0) - binomial[i - 1];
        }
        for (int i = 0; i <= k; i++) {
            ends[i] += factors[k - 1] * binomial[i];
        }
    }
    for (int n = 0; n <= steps; n++) {
        w[n] = R(1.0);
    }
    for (int i = 0; i <= most; i++) {
        const rm_real less = R(ends[i]);
        w[i] -= less;
        w[steps - i] -= less;
    }
    for (int n = 0; n <= steps; n++) {
        w[n] /= (rm_real)steps;
    }
}

/* Hermite's cubic between two nodes, from values and slopes by the step; x from 0 to 1. */
RM_INLINE vec between(vec start, vec end, vec start_slope, vec end_slope, rm_real x)
{
    const rm_real y = R(1.0) - x, left = (R(1.0) + R(2.0) * x) * y * y, right = x * x * (R(3.0) - R(2.0) * x);
    const vec value = along(scale(left, start), right, end);
    return along(along(value, x * y * y, start_slope), -x * x * y, end_slope);
}

/* Slope of the drift at a node by the step, from the parabola through it and its neighbours. */
RM_INLINE vec drift_rise(const rm_node *nodes, int steps, int n)
{
    if (steps == 1) {
        return sub(vec_of(nodes[1].drift), vec_of(nodes[0].drift));
    }
    const int m = n == 0 ? 1 : (n == steps ? steps - 1 : n);
    const vec before = vec_of(nodes[m - 1].drift), after = vec_of(nodes[m + 1].drift);
    const vec rise = scale(R(0.5), sub(after, before));
    return along(rise, (rm_real)(n - m), along(add(before, after), R(-2.0), vec_of(nodes[m].drift)));
}

/* Pose at the arc length s from the nodes: Magnus' expansion of order 4 with the curvature at two Gauss points.
 * Iserles, Munthe-Kaas, Norsett and Zanna (2000), Acta Numerica 9, 215, sec. 5; brackets have the opposite sign here,
 * as the frame is multiplied from the right. */
static quat pose_between(const rm_node *nodes, int steps, rm_real length, rm_real s, vec *position, vec *turn)
{
    /* The factor lifts a section a rounding below a node onto the node. */
    const rm_real place = s / length * (rm_real)steps * (R(1.0) + R(4.0) * RM_EPSILON);
    int n = (int)place;
    n = n < 0 ? 0 : (n > steps ? steps : n);
    const rm_real h = R(1.0) / (rm_real)steps, x = smaller(larger(place - (rm_real)n, R(0.0)), R(1.0));
    const rm_node *a = nodes + n, *b = n < steps ? a + 1 : a;
    const vec turns[2] = {vec_of(a->turn), vec_of(b->turn)};
    const vec slopes[2] = {scale(h, vec_of(a->rate)), scale(h, vec_of(b->rate))};
    const rm_real gauss = R(0.28867513459481288225), part = x * h;
    const vec first = between(turns[0], turns[1], slopes[0], slopes[1], x * (R(0.5) - gauss));
    const vec second = between(turns[0], turns[1], slopes[0], slopes[1], x * (R(0.5) + gauss));
    const rm_real bracket = R(0.14433756729740644113) * part * part;
    const vec whole = along(scale(R(0.5) * part, add(first, second)), bracket, cross(first, second));
    const vec way = {bracket * (first.y - second.y), -bracket * (first.x - second.x), part};
    const quat q = {a->quaternion[0], vec_of(a->quaternion + 1)};
    vec shift;
    const quat frame = screw_by(q, whole, way, &shift);
    /* Integral of the drift by Simpson's rule, exact for the cubic. */
    const vec drifts[2] = {vec_of(a->drift), vec_of(b->drift)};
    const vec rises[2] = {drift_rise(nodes, steps, n), drift_rise(nodes, steps, n < steps ? n + 1 : n)};
    const vec middle = between(drifts[0], drifts[1], rises[0], rises[1], R(0.5) * x);
    const vec last = between(drifts[0], drifts[1], rises[0], rises[1], x);
    const vec drift = scale(R(1.0 / 6.0), along(add(drifts[0], last), R(4.0), middle));
    *position = along(vec_of(a->position), length, along(shift, part, drift));
    *turn = between(turns[0], turns[1], slopes[0], slopes[1], x);
    return frame;
}

/* Share of the cap's offset that the axis has at s, 1 at the end of the body: the deflection of a beam whose end is
 * displaced sideways without a turn. */
RM_INLINE rm_real share_of_offset(rm_real s, rm_real length)
{
    const rm_real x = smaller(larger(s / length, R(0.0)), R(1.0));
    return x * x * (R(3.0) - R(2.0) * x);
}

#endif
