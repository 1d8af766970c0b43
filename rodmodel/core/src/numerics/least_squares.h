/* Least squares over the pressures of a domain by the Levenberg-Marquardt method: each step minimises the damped
 * linear model exactly over the whole domain, faces included. The search is non-monotone (a watchdog): a few
 * steps may increase the cost, which helps along curved valleys, and are undone if none after them improves on the
 * best. A search that goes on for long has a target out of reach and a curved valley: the model then has the
 * residual's second derivatives too, from differences of the gradient. Nocedal and Wright (2006), Numerical Optimization, ch. 10.3; Chamberlain, Powell, Lemarechal and Pedersen
 * (1982), Math. Program. Study 16, 1. */
#ifndef RM_LEAST_SQUARES_H
#define RM_LEAST_SQUARES_H

#include "polytope.h"

/* Largest number of steps in a search; a long valley, where a third pressure hardly moves the tip, needs many. */
#define RM_MOST_STEPS 200
/* Levenberg-Marquardt damping: first, least and largest value, for derivatives near one. With the least, the model is
 * still positive definite to rounding. */
#define RM_DAMPING R(1e-3)
#define RM_LEAST_DAMPING (R(64.0) * RM_EPSILON)
#define RM_MOST_DAMPING R(1e8)
/* Steps after which the model has second derivatives, and the displacement for their differences. */
#define RM_LONG 40
#define RM_DISPLACED (R(16.0) * rm_sqrt(RM_EPSILON))
/* Factor on the damping after a better step, and after a failed one. */
#define RM_SHRINK R(0.1)
#define RM_GROW R(5.0)
/* Largest number of successive steps without a better point. */
#define RM_ASTRAY 2
/* Largest cost at such a step over the best one. */
#define RM_HIGHEST R(100.0)

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

/* Return half of the cost's second derivatives, from its gradient displaced along each axis, or `model` where that is
 * undefined; add what makes it positive definite to `shift`. */
static sym second_derivatives(evaluation evaluate, void *what, const place *at, vec gradient, sym model,
                              const polytope *box, rm_real *shift)
{
    const rm_real point[3] = {at->point.x, at->point.y, at->point.z};
    vec rows[3];
    for (int k = 0; k < 3; k++) {
        rm_real displaced[3] = {point[0], point[1], point[2]};
        place there;
        const rm_real step = point[k] + RM_DISPLACED > box->bound[3 + k] ? -RM_DISPLACED : RM_DISPLACED;
        displaced[k] += step;
        evaluate(what, vec_of(displaced), at, &there);
        if (!(there.cost < infinite())) {
            return model;
        }
        rows[k] = scale(R(1.0) / step, sub(mat_back(there.slope, there.residual), gradient));
    }
    const sym h = {rows[0].x, R(0.5) * (rows[0].y + rows[1].x), R(0.5) * (rows[0].z + rows[2].x),
                   rows[1].y, R(0.5) * (rows[1].z + rows[2].y), rows[2].z};
    /* Gershgorin's bound of the least eigenvalue. */
    const rm_real xy = rm_abs(h.xy), xz = rm_abs(h.xz), yz = rm_abs(h.yz);
    const rm_real least = smaller(h.xx - xy - xz, smaller(h.yy - xy - yz, h.zz - xz - yz));
    *shift = larger(*shift, *shift - least);
    return h;
}

/* Minimise from `start`, inside the polytope or its face without a chamber (-1: all of it), until the cost is at most
 * `enough`, or the linear model predicts a relative decrease of at most `worth`. */
static least_squares_fit least_squares(evaluation evaluate, void *what, vec start, const place *near,
                                       const polytope *box, int without, rm_real enough, rm_real worth)
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
        rm_real shift = damping;
        if (fit.steps > RM_LONG) {
            h = second_derivatives(evaluate, what, &at, gradient, h, box, &shift);
            fit.steps += 3;
        }
        const sym bare = h;
        h.xx += shift;
        h.yy += shift;
        h.zz += shift;
        const vec trial = minimum_over(h, gradient, at.point, box, without);
        const vec step = sub(trial, at.point);
        const rm_real promise = -dot(along(sym_apply(bare, step), R(2.0), gradient), step);
        const int going = promise > larger(worth, small) * at.cost && largest(step) > small;
        if (!going && astray == 0) {
            fit.converged = 1;
            break;
        }
        evaluate(what, trial, &at, &there);
        fit.steps++;
        /* Back at the best point is no better: the same steps would follow for ever. */
        const int better = there.cost < fit.best.cost;
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
