/* Least squares over the pressures of a domain, 0 <= p_k <= p_max,k and sum p <= p_sum, by the Levenberg-Marquardt
 * method: each step minimises the damped linear model exactly over the whole domain, faces included. The search is
 * non-monotone (a watchdog): a few steps may increase the cost, which helps along curved valleys, and are undone if
 * none after them improves on the best. Nocedal and Wright (2006), Numerical Optimization, chs 10.3 and 16;
 * Chamberlain, Powell, Lemarechal and Pedersen (1982), Math. Program. Study 16, 1. */
#ifndef RM_POLYTOPE_H
#define RM_POLYTOPE_H

#include "vector.h"

/* Largest number of steps in a search; a long valley, where a third pressure hardly moves the tip, needs many. */
#define RM_MOST_STEPS 200
/* Levenberg-Marquardt damping: first, least and largest value, for derivatives near one. */
#define RM_DAMPING R(1e-3)
#define RM_LEAST_DAMPING R(1e-14)
#define RM_MOST_DAMPING R(1e8)
/* Factor on the damping after a better step, and after a failed one. */
#define RM_SHRINK R(0.1)
#define RM_GROW R(5.0)
/* Largest number of successive steps without a better point. */
#define RM_ASTRAY 2
/* Largest cost at such a step over the best one. */
#define RM_HIGHEST R(100.0)

/* A domain in units of its largest pressure, or its face on which chamber `without` has no pressure; -1: the domain. */
typedef struct {
    rm_real upper[3], total;
    int without;
} polytope;

/* A point with its residual. */
typedef struct {
    vec point;
    rm_real cost;      /* sum of squares of the residual; infinite if undefined */
    vec residual;
    mat slope;         /* derivative of the residual by the point */
    rm_real memory[6]; /* start for the solve at a nearby point */
    rm_real memory_slope[6][3]; /* derivative of `memory` by the point */
} place;

typedef struct {
    place best;
    int converged; /* no step within the polytope makes the residual smaller */
    int steps;
} least_squares_fit;

/* Evaluate residual and slope at a point, starting from a nearby place or NULL; the cost is infinite if undefined. */
typedef void (*evaluation)(void *what, vec point, const place *near, place *there);

RM_INLINE rm_real component(vec v, int k)
{
    return k == 0 ? v.x : (k == 1 ? v.y : v.z);
}

/* Minimise d.H d/2 + g.d over the polytope, with d from `point` and H positive definite: enumerate the faces, and take
 * the least of the minima in their planes that lie inside the polytope. */
static vec minimum_over(sym h, vec gradient, vec point, const polytope *box)
{
    const rm_real slack = R(8.0) * RM_EPSILON;
    const rm_real rows[3][3] = {{h.xx, h.xy, h.xz}, {h.xy, h.yy, h.yz}, {h.xz, h.yz, h.zz}};
    const rm_real g[3] = {gradient.x, gradient.y, gradient.z}, from[3] = {point.x, point.y, point.z};
    rm_real least = infinite(), best[3] = {from[0], from[1], from[2]};
    for (int face = 0; face < 54; face++) {
        const int with_total = face >= 27, states[3] = {face % 3, face / 3 % 3, face / 9 % 3};
        int free[3], count = 0, usable = 1;
        rm_real d[3], total = R(0.0);
        for (int k = 0; k < 3; k++) {
            if (states[k] == 0) {
                free[count++] = k;
                usable &= box->without != k;
            } else {
                const rm_real held = states[k] == 1 ? R(0.0) : box->upper[k];
                usable &= !(states[k] == 2 && box->without == k);
                d[k] = held - from[k];
                total += held;
            }
        }
        const rm_real left = box->total - total;
        if (!usable || left < -slack || (with_total && count == 0)) {
            continue;
        }
        /* For the free coordinates, H d = -g - (terms of the fixed ones) - multiplier. */
        rm_real m[3][3] = {{R(1.0), R(0.0), R(0.0)}, {R(0.0), R(1.0), R(0.0)}, {R(0.0), R(0.0), R(1.0)}};
        rm_real right[3] = {R(0.0), R(0.0), R(0.0)}, ones[3] = {R(0.0), R(0.0), R(0.0)};
        for (int i = 0; i < count; i++) {
            right[i] = -g[free[i]];
            ones[i] = R(1.0);
            for (int k = 0; k < 3; k++) {
                if (states[k] != 0) {
                    right[i] -= rows[free[i]][k] * d[k];
                }
            }
            for (int j = 0; j < count; j++) {
                m[i][j] = rows[free[i]][free[j]];
            }
        }
        const sym block = {m[0][0], m[0][1], m[0][2], m[1][1], m[1][2], m[2][2]};
        const sym inverse = sym_inverse(block);
        vec step = sym_apply(inverse, vec_of(right));
        if (with_total) {
            const vec answer = sym_apply(inverse, vec_of(ones));
            rm_real now = R(0.0);
            for (int i = 0; i < count; i++) {
                now += from[free[i]] + component(step, i);
            }
            step = along(step, (left - now) / dot(answer, vec_of(ones)), answer);
        }
        rm_real value = R(0.0), sum = R(0.0), at[3];
        int inside = 1;
        for (int i = 0; i < count; i++) {
            d[free[i]] = component(step, i);
        }
        for (int k = 0; k < 3; k++) {
            at[k] = from[k] + d[k];
            sum += at[k];
            inside &= (at[k] >= -slack) & (at[k] <= box->upper[k] + slack);
            value += g[k] * d[k]
                     + R(0.5) * d[k] * (rows[k][0] * d[0] + rows[k][1] * d[1] + rows[k][2] * d[2]);
        }
        if (inside && sum <= box->total + slack && value < least) {
            least = value;
            for (int k = 0; k < 3; k++) {
                /* The bounds must hold exactly, without rounding. */
                best[k] = smaller(larger(at[k], R(0.0)), box->upper[k]);
            }
        }
    }
    return vec_of(best);
}

/* Minimise from `start`, inside the polytope, until the cost is at most `enough`, or the linear model predicts a
 * relative decrease of at most `worth`. */
static least_squares_fit least_squares(evaluation evaluate, void *what, vec start, const place *near,
                                       const polytope *box, rm_real enough, rm_real worth)
{
    /* Machine epsilon to the power 0.6. */
#ifdef RM_REAL_FLOAT
    const rm_real small = R(7e-5);
#else
    const rm_real small = 4e-10;
#endif
    least_squares_fit fit;
    place at;
    rm_real damping = RM_DAMPING;
    int astray = 0;
    enough = larger(enough, small * small);
    evaluate(what, start, near, &at);
    fit.best = at;
    fit.steps = 1;
    fit.converged = at.cost <= enough;
    while (!fit.converged && at.cost < infinite() && fit.steps < RM_MOST_STEPS) {
        place there;
        sym h = {dot(at.slope.a, at.slope.a), dot(at.slope.a, at.slope.b), dot(at.slope.a, at.slope.c),
                 dot(at.slope.b, at.slope.b), dot(at.slope.b, at.slope.c), dot(at.slope.c, at.slope.c)};
        const vec gradient = mat_back(at.slope, at.residual);
        const sym bare = h;
        h.xx += damping;
        h.yy += damping;
        h.zz += damping;
        const vec trial = minimum_over(h, gradient, at.point, box), step = sub(trial, at.point);
        const rm_real promise = -dot(along(sym_apply(bare, step), R(2.0), gradient), step);
        const int going = promise > larger(worth, small) * at.cost && largest(step) > small;
        if (!going && astray == 0) {
            fit.converged = 1;
            break;
        }
        evaluate(what, trial, &at, &there);
        fit.steps++;
        const int better = there.cost <= fit.best.cost;
        const int taken = there.cost < infinite() && astray < RM_ASTRAY && there.cost <= RM_HIGHEST * fit.best.cost;
        if (better) {
            fit.best = there;
            fit.converged = there.cost <= enough;
        }
        at = better || taken ? there : fit.best;
        astray = better || !taken ? 0 : astray + 1;
        if (better || !taken) {
            damping = smaller(larger(damping * (better ? RM_SHRINK : RM_GROW), RM_LEAST_DAMPING), RM_MOST_DAMPING);
        }
    }
    return fit;
}

#endif
