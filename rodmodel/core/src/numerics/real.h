/* Numbers of the chosen precision, and SIMD vectors of them. */
#ifndef RM_REAL_H
#define RM_REAL_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "rodmodel_core.h"

/* A literal of the chosen precision. */
#define R(x) ((rm_real)(x))

#ifdef RM_REAL_FLOAT
#define rm_sqrt sqrtf
#define rm_sin sinf
#define rm_cos cosf
#define rm_tanh tanhf
#define rm_atan atanf
#define rm_atan2 atan2f
#define rm_floor floorf
#define rm_abs fabsf
#define rm_cbrt cbrtf
#define RM_EPSILON R(1.1920929e-7)
#define RM_TINY R(1e-30)
#else
#define rm_sqrt sqrt
#define rm_sin sin
#define rm_cos cos
#define rm_tanh tanh
#define rm_atan atan
#define rm_atan2 atan2
#define rm_floor floor
#define rm_abs fabs
#define rm_cbrt cbrt
#define RM_EPSILON 2.220446049250313e-16
#define RM_TINY 1e-300
#endif

#define RM_PI R(3.141592653589793238462643)

/* Sums over ridges have one partial sum per lane, as successive additions to a single sum wait for each other.
 * Compilers with GNU extensions have vector types; others, and processors without vectors, have one lane. */
#if defined(__GNUC__) && defined(__AVX512F__)
#define RM_LANES 8
#elif defined(__GNUC__) && defined(__AVX__)
#define RM_LANES 4
#elif defined(__GNUC__) && (defined(__SSE2__) || defined(__aarch64__))
#define RM_LANES 2
#else
#define RM_LANES 1
#endif

#if RM_LANES > 1
typedef rm_real lanes __attribute__((vector_size(RM_LANES * sizeof(rm_real))));
typedef rm_real loose_lanes
    __attribute__((vector_size(RM_LANES * sizeof(rm_real)), aligned(sizeof(rm_real)), may_alias));
#define LOAD(p) ((lanes)(*(const loose_lanes *)(p)))
#define STORE(p, v) (*(loose_lanes *)(p) = (loose_lanes)(v))
#else
typedef rm_real lanes;
#define LOAD(p) (*(p))
#define STORE(p, v) (*(p) = (v))
#endif

/* 1/x for x >= 1. AVX-512 divides slowly but has an estimate of 14 bits, which two Newton steps quadruple; the last
 * digit may differ from that of a division. */
#if RM_LANES == 8 && !defined(RM_REAL_FLOAT)
#include <immintrin.h>
static inline __attribute__((always_inline)) lanes inverse_of(lanes x)
{
    lanes r = (lanes)_mm512_rcp14_pd((__m512d)x);
    r = r + r * (1.0 - x * r);
    return r + r * (1.0 - x * r);
}
#else
#define inverse_of(x) (R(1.0) / (x))
#endif

/* Neighbouring solutions are integrated in blocks of four, or of eight where vectors have as many lanes. */
#if defined(__GNUC__)
#define RM_BLOCK (RM_LANES > 4 ? RM_LANES : 4)
typedef rm_real block __attribute__((vector_size(RM_BLOCK * sizeof(rm_real))));
typedef rm_real loose_block
    __attribute__((vector_size(RM_BLOCK * sizeof(rm_real)), aligned(sizeof(rm_real)), may_alias));
#define GET(p) ((block)(*(const loose_block *)(p)))
#define PUT(p, v) (*(loose_block *)(p) = (loose_block)(v))
#else
#define RM_BLOCK 1
typedef rm_real block;
#define GET(p) (*(p))
#define PUT(p, v) (*(p) = (v))
#endif

#if defined(__GNUC__)
#define RM_INLINE static inline __attribute__((always_inline))
#else
#define RM_INLINE static inline
#endif

/* Sum the lanes of each of `count` vectors. */
RM_INLINE void sum_lanes(const lanes *parts, int count, rm_real *sums)
{
#if RM_LANES == 8 && defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
#define RM_SHUFFLED_SUMS
    int k = 0;
    for (; k + 8 <= count; k += 8) {
        lanes half[4], quarter[2];
        for (int i = 0; i < 4; i++) {
            const lanes a = parts[k + 2 * i], b = parts[k + 2 * i + 1];
            half[i] = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14)
                      + __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
        }
        for (int i = 0; i < 2; i++) {
            const lanes a = half[2 * i], b = half[2 * i + 1];
            quarter[i] = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13)
                         + __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
        }
        STORE(sums + k, __builtin_shufflevector(quarter[0], quarter[1], 0, 1, 2, 3, 8, 9, 10, 11)
                            + __builtin_shufflevector(quarter[0], quarter[1], 4, 5, 6, 7, 12, 13, 14, 15));
    }
#endif
#endif
#ifdef RM_SHUFFLED_SUMS
    for (; k < count; k++)
#else
    for (int k = 0; k < count; k++)
#endif
    {
#if RM_LANES == 8
        const lanes v = parts[k];
        sums[k] = ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7]));
#elif RM_LANES == 4
        const lanes v = parts[k];
        sums[k] = (v[0] + v[2]) + (v[1] + v[3]);
#elif RM_LANES == 2
        const lanes v = parts[k];
        sums[k] = v[0] + v[1];
#else
        sums[k] = parts[k];
#endif
    }
}

/* Return whether a number is finite; false for a NaN. Compilers may drop isfinite. */
RM_INLINE int is_finite(rm_real x)
{
    return rm_abs(x) <= (R(1.0) / RM_TINY);
}

RM_INLINE rm_real not_a_number(void)
{
    return (rm_real)NAN;
}

RM_INLINE rm_real infinite(void)
{
    return (rm_real)INFINITY;
}

RM_INLINE rm_real larger(rm_real a, rm_real b)
{
    return a > b ? a : b;
}

RM_INLINE rm_real smaller(rm_real a, rm_real b)
{
    return a < b ? a : b;
}

#endif
