/* Energy and chamber volumes of a section. */
#ifndef RM_VOLUMES_H
#define RM_VOLUMES_H

#include "section.h"

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
