/* The section law at one pressure: a quadratic of the curvature and a sum of ridge functions. */
#ifndef RM_SECTION_H
#define RM_SECTION_H

#include "vector.h"

/* Longest Newton step for the free curvature, over the curvature scale. */
#define RM_LONGEST R(0.2)
/* Largest number of these steps. */
#define RM_MOST_ROOT_STEPS 60

#define RM_MOST_IMAGES 6

/* Law contracted at a pressure. Its arrays over `total` ridges lie in the workspace. */
typedef struct {
    const rm_law *law;
    int total;
    rm_real *offsets;             /* b + e.h, for all images */
    rm_real *offset_slopes;       /* (3, total): derivatives by the pressures [1/Pa], or NULL */
    rm_real *bend;                /* -c phi''/4; written by `linearise` */
    rm_real *jerk;                /* c phi''' */
    rm_real moment_scale, stiffness_scale, third_scale;
    vec slope;                    /* slope at these pressures */
    vec slope_slopes[3];          /* its derivatives by the pressures [1/Pa] */
    rm_real constant;
    vec guess;                    /* the network's guess of the free curvature, over u_s */
} contracted;

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

/* Largest distance from an expansion at which it replaces the law, over the curvature scale; the stiffness' error is of
 * second order in it. */
#define RM_NEARBY R(1e-3)

#if RM_LANES > 1 && !defined(RM_REAL_FLOAT)
typedef long long integers __attribute__((vector_size(RM_LANES * sizeof(long long))));

/* tanh x = 1 - 2/(e^2x + 1), with an absolute error of one rounding; e^y = 2^n e^r with |r| <= ln 2 / 2. */
RM_INLINE lanes tanh_of(lanes x)
{
    const double to_integer = 6755399441055744.0; /* 1.5 2^52: adding it rounds a number to an integer */
    lanes y = 2.0 * x;
    y = (lanes)(((integers)y & (y < 40.0)) | ((integers)(y - y + 40.0) & (y >= 40.0)));
    y = (lanes)(((integers)y & (y > -40.0)) | ((integers)(y - y - 40.0) & (y <= -40.0)));
    const lanes shifted = y * 1.4426950408889634074 + to_integer, n = shifted - to_integer;
    const lanes r = (y - n * 6.93147180369123816490e-1) - n * 1.90821492927058770002e-10;
    lanes e = r * (1.0 / 6227020800.0) + 1.0 / 479001600.0;
    e = e * r + 1.0 / 39916800.0;
    e = e * r + 1.0 / 3628800.0;
    e = e * r + 1.0 / 362880.0;
    e = e * r + 1.0 / 40320.0;
    e = e * r + 1.0 / 5040.0;
    e = e * r + 1.0 / 720.0;
    e = e * r + 1.0 / 120.0;
    e = e * r + 1.0 / 24.0;
    e = e * r + 1.0 / 6.0;
    e = e * r + 0.5;
    e = e * r + 1.0;
    e = e * r + 1.0;
    const integers exponent = ((integers)shifted << 52) + (1023LL << 52);
    return 1.0 - 2.0 / (e * (lanes)exponent + 1.0);
}
#define RM_TANH_OF
#endif

/* Features h of an image: the scaled pressures q, then the hidden functions. */
RM_INLINE void features_of(const rm_law *law, int image, const rm_real *pressure, rm_real *features)
{
    const int *order = law->orders + 3 * image;
    const rm_real *biases = law->feature_biases + image * law->features;
    const rm_real s = R(1.0) / law->pressure_scale;
    const rm_real q[3] = {s * pressure[order[0]], s * pressure[order[1]], s * pressure[order[2]]};
    rm_real *hidden = features + 3;
    for (int k = 0; k < 3; k++) {
        features[k] = q[k];
    }
    for (int f = 0; f < law->features; f++) {
        const rm_real *w = law->feature_weights + 3 * f;
        hidden[f] = w[0] * q[0] + w[1] * q[1] + w[2] * q[2] + biases[f];
    }
    int f = 0;
#ifdef RM_TANH_OF
    for (; f + RM_LANES <= law->features; f += RM_LANES) {
        STORE(hidden + f, tanh_of(LOAD(hidden + f)));
    }
#endif
    for (; f < law->features; f++) {
        hidden[f] = rm_tanh(hidden[f]);
    }
}

/* Contract a law at pressures. `features` holds 3 + features numbers, `arrays` images * ridges times 3, or times 6 with
 * slopes. */
static void contract(const rm_law *law, const rm_real *pressure, int with_slopes, rm_real *features, rm_real *arrays,
                     contracted *at)
{
    const int inputs = 3 + law->features, ridges = law->ridges, total = law->images * ridges;
    at->law = law;
    at->total = total;
    at->offsets = arrays;
    at->bend = at->offsets + total;
    at->jerk = at->bend + total;
    at->offset_slopes = with_slopes ? at->jerk + total : NULL;
    at->moment_scale = law->energy_scale / law->curvature_scale;
    at->stiffness_scale = at->moment_scale / law->curvature_scale;
    at->third_scale = at->stiffness_scale / law->curvature_scale;

    const rm_real s = R(1.0) / law->pressure_scale;
    const vec q = scale(s, vec_of(pressure));
    const vec b[3] = {vec_of(law->slope_by_pressure), vec_of(law->slope_by_pressure + 3),
                      vec_of(law->slope_by_pressure + 6)};
    at->slope = along(along(along(vec_of(law->slope), q.x, b[0]), q.y, b[1]), q.z, b[2]);
    const vec c = {dot(vec_of(law->pressure_quadratic), q), dot(vec_of(law->pressure_quadratic + 3), q),
                   dot(vec_of(law->pressure_quadratic + 6), q)};
    at->constant = law->constant + R(0.5) * dot(c, q)
                   - law->rest_volume / law->energy_scale * (pressure[0] + pressure[1] + pressure[2]);
    at->guess = no_vec();
    for (int k = 0; k < 3; k++) {
        at->slope_slopes[k] = scale(s, b[k]);
    }

    for (int image = 0; image < law->images; image++) {
        features_of(law, image, pressure, features);
        const rm_real *rest = law->rest_features + image * law->features;
        const rm_real *guess = law->guess + 3 * inputs * image;
        vec way = no_vec();
        for (int k = 0; k < inputs; k++) {
            const rm_real change = k < 3 ? features[k] : features[k] - rest[k - 3];
            at->constant += law->slopes[k] * change;
            way.x += guess[k] * change;
            way.y += guess[inputs + k] * change;
            way.z += guess[2 * inputs + k] * change;
        }
        at->guess = add(at->guess, way);
        rm_real *offsets = at->offsets + image * ridges;
        for (int j = 0; j < ridges; j += RM_LANES) {
            lanes first = LOAD(law->offsets + j), second = first - first;
            int k = 0;
            for (; k + 2 <= inputs; k += 2) {
                first += features[k] * LOAD(law->mixing + k * ridges + j);
                second += features[k + 1] * LOAD(law->mixing + (k + 1) * ridges + j);
            }
            if (k < inputs) {
                first += features[k] * LOAD(law->mixing + k * ridges + j);
            }
            STORE(offsets + j, first + second);
        }
        if (with_slopes) {
            const int *order = law->orders + 3 * image;
            rm_real *slopes[3];
            for (int k = 0; k < 3; k++) {
                slopes[order[k]] = at->offset_slopes + order[k] * total + image * ridges;
            }
            for (int j = 0; j < ridges; j += RM_LANES) {
                lanes by[3];
                for (int k = 0; k < 3; k++) {
                    by[k] = s * LOAD(law->mixing + k * ridges + j);
                }
                for (int f = 0; f < law->features; f++) {
                    const rm_real *w = law->feature_weights + 3 * f;
                    const rm_real h = features[3 + f], dh = s * (R(1.0) - h * h);
                    const lanes e = LOAD(law->mixing + (3 + f) * ridges + j);
                    for (int k = 0; k < 3; k++) {
                        by[k] += (dh * w[k]) * e;
                    }
                }
                for (int k = 0; k < 3; k++) {
                    STORE(slopes[order[k]] + j, by[k]);
                }
            }
        }
    }
}

/* Moment and stiffness at x = u/u_s, both over their scales; `keep` stores c phi'' and c phi''' of the ridges.
 *
 * With r = 1/(1 + z^2): phi' = r^2, phi'' = -4 z r^3, phi''' = (20 - 24 r) r^3; the factor -4 is applied last. */
RM_INLINE section_state linearise_scaled(const contracted *at, vec x, int keep)
{
    const rm_law *law = at->law;
    const int total = at->total;
    const rm_real *dx = law->directions, *dy = dx + total, *dz = dy + total;
    const rm_real *weights = law->weights, *offsets = at->offsets;
    lanes parts[16];
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
    }
    rm_real sums[16];
    sum_lanes(parts, 9, sums);
    const rm_real *q = law->quadratic;
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

RM_INLINE sym sym_scale(rm_real s, sym m)
{
    const sym found = {s * m.xx, s * m.xy, s * m.xz, s * m.yy, s * m.yz, s * m.zz};
    return found;
}

/* Moment [N m] and stiffness [N m^2] at a curvature [1/m]. */
RM_INLINE section_state linearise(const contracted *at, vec curvature, int keep)
{
    section_state found = linearise_scaled(at, scale(R(1.0) / at->law->curvature_scale, curvature), keep);
    found.moment = scale(at->moment_scale, found.moment);
    found.stiffness = sym_scale(at->stiffness_scale, found.stiffness);
    return found;
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

/* Section at a curvature, from a nearby expansion, else from the law. */
RM_INLINE section_state linearise_near(const contracted *at, vec curvature, const expansion *near)
{
    const vec way = sub(curvature, near->curvature);
    if (!(largest(way) <= RM_NEARBY * at->law->curvature_scale)) {
        return linearise(at, curvature, 0);
    }
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

/* Root of the moment near the guess [1/m], by Newton's method with limited steps; NaN if none is found. Sets the
 * section there, with c phi'' and c phi''' of its ridges kept. */
static vec find_free_curvature(const contracted *at, section_state *section)
{
    const rm_real limit = rm_sqrt(RM_EPSILON), u_s = at->law->curvature_scale;
    vec x = at->guess;
    for (int n = 0; n < RM_MOST_ROOT_STEPS; n++) {
        const section_state here = linearise_scaled(at, x, 0);
        const vec change = sym_apply(sym_inverse(here.stiffness), here.moment);
        const rm_real size = largest(change);
        if (!(size <= infinite()) || size == infinite()) {
            break;
        }
        x = along(x, size > RM_LONGEST ? -RM_LONGEST / size : R(-1.0), change);
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

/* Sum of c phi over the ridges, phi = (z/(1 + z^2) + arctan z)/2. */
RM_INLINE rm_real ridge_energy(const contracted *at, vec x)
{
    const rm_law *law = at->law;
    const int total = at->total;
    const rm_real *dx = law->directions, *dy = dx + total, *dz = dy + total;
    rm_real sum = R(0.0);
    for (int j = 0; j < total; j++) {
        const rm_real z = at->offsets[j] + x.x * dx[j] + x.y * dy[j] + x.z * dz[j];
        sum += law->weights[j] * R(0.5) * (z / (R(1.0) + z * z) + rm_atan(z));
    }
    return sum;
}

/* Add c phi' of every ridge at a curvature [1/m], times a factor, to an array. */
RM_INLINE void add_lifts(const contracted *at, vec curvature, rm_real factor, rm_real *lifts)
{
    const rm_law *law = at->law;
    const int total = at->total;
    const rm_real *dx = law->directions, *dy = dx + total, *dz = dy + total;
    const vec x = scale(R(1.0) / law->curvature_scale, curvature);
    for (int j = 0; j < total; j += RM_LANES) {
        const lanes z = LOAD(at->offsets + j) + x.x * LOAD(dx + j) + x.y * LOAD(dy + j) + x.z * LOAD(dz + j);
        const lanes r = inverse_of(R(1.0) + z * z);
        STORE(lifts + j, LOAD(lifts + j) + factor * LOAD(law->weights + j) * r * r);
    }
}

/* Chamber volumes per length, summed over sections with factors, from three sums over the sections: the lifts, the
 * factors, and the factors times curvatures. */
static void volumes_of(const contracted *at, const rm_real *pressure, const rm_real *lifts, rm_real factors,
                       vec curvatures, rm_real *features, rm_real volume[3])
{
    const rm_law *law = at->law;
    const int inputs = 3 + law->features, ridges = law->ridges;
    const rm_real s = R(1.0) / law->pressure_scale;
    const vec x = scale(R(1.0) / law->curvature_scale, curvatures), q = scale(s, vec_of(pressure));
    for (int k = 0; k < 3; k++) {
        const rm_real slope = dot(vec_of(law->slope_by_pressure + 3 * k), x)
                              + factors * dot(vec_of(law->pressure_quadratic + 3 * k), q);
        volume[k] = factors * law->rest_volume - law->energy_scale * s * slope;
    }
    for (int image = 0; image < law->images; image++) {
        const int *order = law->orders + 3 * image;
        features_of(law, image, pressure, features);
        rm_real by[3] = {R(0.0), R(0.0), R(0.0)};
        for (int n = 0; n < inputs; n++) {
            lanes part = LOAD(lifts + image * ridges) - LOAD(lifts + image * ridges);
            for (int j = 0; j < ridges; j += RM_LANES) {
                part += LOAD(lifts + image * ridges + j) * LOAD(law->mixing + n * ridges + j);
            }
            rm_real sum;
            sum_lanes(&part, 1, &sum);
            const rm_real lift = sum + factors * law->slopes[n];
            if (n < 3) {
                by[n] += lift;
            } else {
                const rm_real h = features[n], *w = law->feature_weights + 3 * (n - 3);
                for (int k = 0; k < 3; k++) {
                    by[k] += lift * (R(1.0) - h * h) * w[k];
                }
            }
        }
        for (int k = 0; k < 3; k++) {
            volume[order[k]] -= law->energy_scale * s * by[k];
        }
    }
}

#endif
