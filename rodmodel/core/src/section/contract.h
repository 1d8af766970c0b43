/* The section law at one pressure: features of the pressures, and with them the offsets of the ridges. */
#ifndef RM_CONTRACT_H
#define RM_CONTRACT_H

#include "vector.h"

#define RM_MOST_IMAGES 6
/* Hidden functions whose derivatives are at hand at a time. */
#define RM_CHUNK 16

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
                for (int k = 0; k < 3; k++) {
                    STORE(slopes[order[k]] + j, s * LOAD(law->mixing + k * ridges + j));
                }
            }
            for (int first = 0; first < law->features; first += RM_CHUNK) {
                /* Derivatives of some hidden functions by the pressures. */
                rm_real by[RM_CHUNK][3];
                const int count = law->features - first < RM_CHUNK ? law->features - first : RM_CHUNK;
                for (int f = 0; f < count; f++) {
                    const rm_real h = features[3 + first + f], dh = s * (R(1.0) - h * h);
                    for (int k = 0; k < 3; k++) {
                        by[f][k] = dh * law->feature_weights[3 * (first + f) + k];
                    }
                }
                for (int j = 0; j < ridges; j += RM_LANES) {
                    lanes x = LOAD(slopes[order[0]] + j), y = LOAD(slopes[order[1]] + j);
                    lanes z = LOAD(slopes[order[2]] + j);
                    for (int f = 0; f < count; f++) {
                        const lanes e = LOAD(law->mixing + (3 + first + f) * ridges + j);
                        x += by[f][0] * e;
                        y += by[f][1] * e;
                        z += by[f][2] * e;
                    }
                    STORE(slopes[order[0]] + j, x);
                    STORE(slopes[order[1]] + j, y);
                    STORE(slopes[order[2]] + j, z);
                }
            }
        }
    }
}

#endif
