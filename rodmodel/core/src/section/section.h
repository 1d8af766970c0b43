/* The section law at one pressure: a quadratic of the curvature and a sum of ridge functions. */
#ifndef RM_SECTION_H
#define RM_SECTION_H

#include "contract.h"

/* Longest first Newton step for the free curvature, over the curvature scale. */
#define RM_LONGEST R(0.2)
/* Least shift of a stiffness that is not positive, over the size of its diagonal. */
#define RM_SHIFTED R(1e-6)
/* Largest number of these steps. */
#define RM_MOST_ROOT_STEPS 100

typedef struct {
    vec moment;    /* dPi/du [N m] */
    sym stiffness; /* d2Pi/du2 [N m^2] */
} section_state;

/* Section at a curvature, with the third derivatives d3Pi/du3 [N m^3]: entries 111, 112, 113, 122, 123, 133, 222,
 * 223, 233, 333. */
typedef struct {
    vec curvature;
    section_state section;
    rm_real third[10];
} expansion;

/* Moment and stiffness over their scales, from the sums of c phi' d and of -c phi'' d d / 4 over the ridges. */
RM_INLINE section_state section_of_sums(const contracted *at, vec x, const rm_real *sums)
{
    const rm_real *q = at->law->quadratic;
    const sym a = {q[0], q[1], q[2], q[3], q[4], q[5]};
    section_state found;
    found.moment = add(add(at->slope, sym_apply(a, x)), vec_of(sums));
    found.stiffness.xx = a.xx - R(4.0) * sums[3];
    found.stiffness.xy = a.xy - R(4.0) * sums[4];
    found.stiffness.xz = a.xz - R(4.0) * sums[5];
    found.stiffness.yy = a.yy - R(4.0) * sums[6];
    found.stiffness.yz = a.yz - R(4.0) * sums[7];
    found.stiffness.zz = a.zz - R(4.0) * sums[8];
    return found;
}

/* Sums over the ridges at x = u/u_s for `section_of_sums`; if `with_slopes`, then those of -c phi'' d e / 4, with e the
 * slopes of the offsets by the pressures. `keep` stores c phi'' and c phi''' of the ridges.
 *
 * With r = 1/(1 + z^2): phi' = r^2, phi'' = -4 z r^3, phi''' = (20 - 24 r) r^3; the factor -4 is applied last. */
RM_INLINE void sum_ridges(const contracted *at, vec x, int keep, int with_slopes, rm_real sums[18])
{
    const rm_law *law = at->law;
    const int total = at->total;
    const rm_real *dx = law->directions, *dy = dx + total, *dz = dy + total;
    const rm_real *weights = law->weights, *offsets = at->offsets;
    lanes parts[18];
    memset(parts, 0, sizeof parts);
    for (int j = 0; j < total; j += RM_LANES) {
        const lanes a = LOAD(dx + j), b = LOAD(dy + j), c = LOAD(dz + j);
        const lanes z = LOAD(offsets + j) + x.x * a + x.y * b + x.z * c;
        const lanes r = inverse_of(R(1.0) + z * z);
        const lanes lift = LOAD(weights + j) * r * r, cube = lift * r, bend = z * cube;
        if (keep) {
            STORE(at->bend + j, bend);
            STORE(at->jerk + j, (R(20.0) - R(24.0) * r) * cube);
        }
        const lanes ba = bend * a, bb = bend * b, bc = bend * c;
        parts[0] += lift * a;
        parts[1] += lift * b;
        parts[2] += lift * c;
        parts[3] += ba * a;
        parts[4] += ba * b;
        parts[5] += ba * c;
        parts[6] += bb * b;
        parts[7] += bb * c;
        parts[8] += bc * c;
        for (int k = 0; k < 3 && with_slopes; k++) {
            const lanes e = LOAD(at->offset_slopes + k * total + j);
            parts[9 + 3 * k] += ba * e;
            parts[10 + 3 * k] += bb * e;
            parts[11 + 3 * k] += bc * e;
        }
    }
    sum_lanes(parts, with_slopes ? 18 : 9, sums);
}

/* Moment and stiffness at x, both over their scales. */
RM_INLINE section_state linearise_scaled(const contracted *at, vec x, int keep)
{
    rm_real sums[18];
    sum_ridges(at, x, keep, 0, sums);
    return section_of_sums(at, x, sums);
}

RM_INLINE sym sym_scale(rm_real s, sym m)
{
    const sym found = {s * m.xx, s * m.xy, s * m.xz, s * m.yy, s * m.yz, s * m.zz};
    return found;
}

RM_INLINE section_state in_units(const contracted *at, section_state scaled)
{
    const section_state found = {scale(at->moment_scale, scaled.moment),
                                 sym_scale(at->stiffness_scale, scaled.stiffness)};
    return found;
}

/* Moment [N m] and stiffness [N m^2] at a curvature [1/m]. */
RM_INLINE section_state linearise(const contracted *at, vec curvature, int keep)
{
    return in_units(at, linearise_scaled(at, scale(R(1.0) / at->law->curvature_scale, curvature), keep));
}

/* Third derivatives [N m^3], after `linearise` with `keep`. */
RM_INLINE void third_derivatives(const contracted *at, rm_real third[10])
{
    const int total = at->total;
    const rm_real *dx = at->law->directions, *dy = dx + total, *dz = dy + total;
    lanes parts[16];
    memset(parts, 0, sizeof parts);
    for (int j = 0; j < total; j += RM_LANES) {
        const lanes a = LOAD(dx + j), b = LOAD(dy + j), c = LOAD(dz + j), w = LOAD(at->jerk + j);
        const lanes wa = w * a, wb = w * b, waa = wa * a, wbb = wb * b, wcc = w * c * c, wab = wa * b;
        parts[0] += waa * a;
        parts[1] += waa * b;
        parts[2] += waa * c;
        parts[3] += wbb * a;
        parts[4] += wab * c;
        parts[5] += wcc * a;
        parts[6] += wbb * b;
        parts[7] += wbb * c;
        parts[8] += wcc * b;
        parts[9] += wcc * c;
    }
    rm_real sums[16];
    sum_lanes(parts, 10, sums);
    for (int k = 0; k < 10; k++) {
        third[k] = at->third_scale * sums[k];
    }
}

/* Change of the stiffness along a change of curvature. */
RM_INLINE sym stiffening(const rm_real t[10], vec y)
{
    const sym found = {t[0] * y.x + t[1] * y.y + t[2] * y.z, t[1] * y.x + t[3] * y.y + t[4] * y.z,
                       t[2] * y.x + t[4] * y.y + t[5] * y.z, t[3] * y.x + t[6] * y.y + t[7] * y.z,
                       t[4] * y.x + t[7] * y.y + t[8] * y.z, t[5] * y.x + t[8] * y.y + t[9] * y.z};
    return found;
}

RM_INLINE sym sym_add(sym a, sym b)
{
    const sym found = {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
    return found;
}

/* Return whether a curvature is at most `distance` from that of an expansion; false for a NaN. */
RM_INLINE int is_near(const expansion *at, vec curvature, rm_real distance)
{
    return largest(sub(curvature, at->curvature)) <= distance;
}

/* Section at a curvature near that of an expansion. The moment's error is of third order in the distance. */
RM_INLINE section_state expand(const expansion *near, vec curvature)
{
    const vec way = sub(curvature, near->curvature);
    const sym more = stiffening(near->third, way);
    section_state found = near->section;
    found.moment = add(found.moment, sym_apply(found.stiffness, way));
    found.moment = along(found.moment, R(0.5), sym_apply(more, way));
    found.stiffness = sym_add(found.stiffness, more);
    return found;
}

/* Derivatives by the pressures of the moment [N m/Pa], and of the stiffness applied to y [1/m^2], after `linearise`
 * with `keep`. Returns the change of the stiffness along y. */
RM_INLINE sym slopes_by_pressure(const contracted *at, vec y, vec moment[3], vec stiffened[3])
{
    const int total = at->total;
    const rm_real *dx = at->law->directions, *dy = dx + total, *dz = dy + total;
    lanes parts[24];
    memset(parts, 0, sizeof parts);
    for (int j = 0; j < total; j += RM_LANES) {
        const lanes a = LOAD(dx + j), b = LOAD(dy + j), c = LOAD(dz + j);
        const lanes bend = LOAD(at->bend + j), w = LOAD(at->jerk + j) * (y.x * a + y.y * b + y.z * c);
        const lanes wa = w * a, wb = w * b;
        parts[0] += wa * a;
        parts[1] += wa * b;
        parts[2] += wa * c;
        parts[3] += wb * b;
        parts[4] += wb * c;
        parts[5] += w * c * c;
        for (int k = 0; k < 3; k++) {
            const lanes e = LOAD(at->offset_slopes + k * total + j), be = bend * e, we = w * e;
            parts[6 + 3 * k] += be * a;
            parts[7 + 3 * k] += be * b;
            parts[8 + 3 * k] += be * c;
            parts[15 + 3 * k] += we * a;
            parts[16 + 3 * k] += we * b;
            parts[17 + 3 * k] += we * c;
        }
    }
    rm_real sums[24];
    sum_lanes(parts, 24, sums);
    for (int k = 0; k < 3; k++) {
        moment[k] = scale(at->moment_scale, along(at->slope_slopes[k], R(-4.0), vec_of(sums + 6 + 3 * k)));
        stiffened[k] = scale(at->stiffness_scale, vec_of(sums + 15 + 3 * k));
    }
    const sym found = {sums[0], sums[1], sums[2], sums[3], sums[4], sums[5]};
    return sym_scale(at->third_scale, found);
}

/* Section at a curvature [1/m], and the derivatives of its moment by the pressures [N m/Pa]. */
RM_INLINE section_state linearise_by_pressure(const contracted *at, vec curvature, vec by_pressure[3])
{
    const vec x = scale(R(1.0) / at->law->curvature_scale, curvature);
    rm_real sums[18];
    sum_ridges(at, x, 0, 1, sums);
    for (int k = 0; k < 3; k++) {
        by_pressure[k] = scale(at->moment_scale, along(at->slope_slopes[k], R(-4.0), vec_of(sums + 9 + 3 * k)));
    }
    return in_units(at, section_of_sums(at, x, sums));
}

/* Stiffness with which a step of Newton's method goes down in energy: the section's own where it is positive definite,
 * else shifted so far that its least eigenvalue changes sign. A larger shift makes small steps beside a saddle. */
RM_INLINE sym descending(sym k)
{
    if (sym_is_positive(k)) {
        return k;
    }
    const rm_real size = rm_abs(k.xx) + rm_abs(k.yy) + rm_abs(k.zz);
    const rm_real shift = larger(R(-2.0) * sym_least_eigenvalue(k), RM_SHIFTED * size);
    k.xx += shift;
    k.yy += shift;
    k.zz += shift;
    return k;
}

/* Root of the moment near the guess [1/m], by Newton's method with limited steps; NaN if none is found. From where the
 * section would give way it goes down in energy, to one of the roots beside. The limit is halved when a step turns
 * back, as steps over a soft stretch could go to and fro for ever. Sets the section there, with c phi'' and c phi''' of
 * its ridges kept. */
static vec find_free_curvature(const contracted *at, section_state *section)
{
    const rm_real limit = rm_sqrt(RM_EPSILON), u_s = at->law->curvature_scale;
    rm_real longest = RM_LONGEST;
    vec x = at->guess, before = {R(0.0), R(0.0), R(0.0)};
    for (int n = 0; n < RM_MOST_ROOT_STEPS; n++) {
        const section_state here = linearise_scaled(at, x, 0);
        const vec change = sym_apply(sym_inverse(descending(here.stiffness)), here.moment);
        const rm_real size = largest(change);
        longest *= dot(change, before) < R(0.0) ? R(0.5) : R(1.0);
        before = change;
        if (!(size <= infinite()) || size == infinite()) {
            break;
        }
        x = along(x, size > longest ? -longest / size : R(-1.0), change);
        if (size <= limit) {
            /* Newton's method converges quadratically: the next change would be a rounding. */
            *section = linearise(at, scale(u_s, x), 1);
            return scale(u_s, x);
        }
    }
    const vec none = {not_a_number(), not_a_number(), not_a_number()};
    section->moment = none;
    *section = linearise(at, none, 1);
    return none;
}

#endif
