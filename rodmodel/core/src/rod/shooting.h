/* Shooting with fixed steps: Newton's method, with load steps where it needs them.
 *
 * The first load step is the full load. A load step that fails is halved; one that succeeds doubles the next, whose
 * start is extrapolated along it. Two bounds keep the rod on the branch of equilibria that starts at zero load: u L
 * changes by at most RM_MAX_TURN in a load step, and a Newton correction is at most RM_CONTRACTION of the one before
 * (Deuflhard 2011, Newton Methods for Nonlinear Problems, ch. 5). Without them a long load step may end on another
 * branch, a coil.
 *
 * Stability: the stiffness of every section must be positive definite (Legendre's condition); elsewhere a wall of the
 * section would snap. Forces and weight have a potential. An equilibrium is a minimum of the energy if no two
 * neighbouring solutions from the base meet again along the rod (Jacobi's condition), and if the free end resists every
 * turn. A rod that may buckle to any side violates either condition in two directions at once, and a determinant keeps
 * its sign; so eigenvalues are tested. Moments and follower forces have no potential. Then the loads must have passed
 * no bifurcation: the determinant of the shooting Jacobian stays positive. Gelfand and Fomin (1963), Calculus of
 * Variations, ch. 5; Kumar and Healey (2010), J. Elast. 98, 89. */
#ifndef RM_SHOOTING_H
#define RM_SHOOTING_H

#include "march.h"

#define RM_SMALLEST_LOAD_STEP R(1.0 / 65536.0)
#define RM_MAX_TURN R(1.0)
#define RM_CONTRACTION R(0.5)
/* Largest difference of orders 2 and 4 within a step, over 1 + the largest u L: above, steps are too few. */
#define RM_ROUGHNESS R(0.02)
/* Largest distance of a section from the base, over its arc length. */
#define RM_STRETCH R(1.02)

enum outcome { ARRIVED, UNSTABLE, DIVERGED, UNRESOLVED };

typedef struct {
    rm_real unknown[6];
    rm_real load_fraction;
    int load_steps, shots;
    int stable;
    int outcome;         /* outcome of the last load step tried */
    march_end end;
    rm_node *nodes;      /* nodes of the equilibrium */
    rm_real (*jacobian)[RM_MOST_COLUMNS]; /* derivative of the residual by the unknowns over their scales */
    rm_real scales[6];   /* scales of the unknowns, which make them near one */
} reached_state;

/* Solve n <= 6 equations by Gaussian elimination with partial pivoting; return the determinant. */
static rm_real eliminate(rm_real (*matrix)[RM_MOST_COLUMNS], const rm_real *right, int n, rm_real *solution)
{
    rm_real rows[6][7], product = R(1.0);
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < n; k++) {
            rows[i][k] = matrix[i][k];
        }
        rows[i][n] = right[i];
    }
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++) {
            if (rm_abs(rows[i][k]) > rm_abs(rows[pivot][k])) {
                pivot = i;
            }
        }
        if (pivot != k) {
            for (int j = k; j <= n; j++) {
                const rm_real other = rows[k][j];
                rows[k][j] = rows[pivot][j];
                rows[pivot][j] = other;
            }
            product = -product;
        }
        product *= rows[k][k];
        for (int i = k + 1; i < n; i++) {
            const rm_real factor = rows[i][k] / rows[k][k];
            for (int j = k; j <= n; j++) {
                rows[i][j] -= factor * rows[k][j];
            }
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        rm_real sum = rows[k][n];
        for (int j = k + 1; j < n; j++) {
            sum -= rows[k][j] * solution[j];
        }
        solution[k] = sum / rows[k][k];
    }
    return product;
}

RM_INLINE rm_real solve_small(rm_real (*matrix)[RM_MOST_COLUMNS], const rm_real *right, int n, rm_real *solution)
{
    if (n != 3) {
        return eliminate(matrix, right, n, solution);
    }
    const mat m = {{matrix[0][0], matrix[1][0], matrix[2][0]},
                   {matrix[0][1], matrix[1][1], matrix[2][1]},
                   {matrix[0][2], matrix[1][2], matrix[2][2]}};
    put_vec(solution, mat_solve(m, vec_of(right)));
    return determinant(m);
}

RM_INLINE int is_stable(const equilibrium *e, const march_end *end, variations *at,
                        rm_real (*jacobian)[RM_MOST_COLUMNS], rm_real determinant_of_it)
{
    const resultants *l = &e->loads;
    const int no_branching = determinant_of_it > R(0.0);
    const int conservative = largest(l->end_moment) == R(0.0) && largest(l->follower_moment) == R(0.0);
    if (e->unknowns == 6 || !conservative) {
        return no_branching;
    }
    const mat turns = {column_of(at->phi, 0), column_of(at->phi, 1), column_of(at->phi, 2)};
    const mat moments = {{jacobian[0][0], jacobian[1][0], jacobian[2][0]},
                         {jacobian[0][1], jacobian[1][1], jacobian[2][1]},
                         {jacobian[0][2], jacobian[1][2], jacobian[2][2]}};
    /* With A the moments and B the turns of the end, B^-1 A has the eigenvalues of A B^-1. */
    return end->apart & is_positive(divided(turns, moments));
}

RM_INLINE vec pull_of(const equilibrium *e, const rm_real *unknown)
{
    return e->unknowns == 6 ? vec_of(unknown + 3) : no_vec();
}

/* Scale of a follower force: it turns the end by about 1 rad. */
RM_INLINE rm_real follower_scale(const section_state *free, rm_real length)
{
    return free->stiffness.xx / (length * length);
}

/* Set the columns of the unknown follower force. */
RM_INLINE void set_follower_columns(rm_real tip_length, rm_real by, column_forces *forces)
{
    for (int i = 0; i < 3; i++) {
        forces->end[i][3 + i] = by;
        forces->cap[i][3 + i] = by;
        forces->lever[i][3 + i] = by * tip_length;
    }
}

/* Integrate with the neighbouring solutions by the unknowns; set the Newton correction, to be subtracted, in units of
 * the unknowns' scales. */
static void shoot_three(const equilibrium *e, const rm_domain *domain, const rm_real *unknown, int steps,
                        expansion *stored, rm_node *nodes, march_end *end, rm_real (*jacobian)[RM_MOST_COLUMNS], rm_real *correction,
                        int *stable)
{
    variations at;
    columns_of_rows moments;
    rm_real missing[6];
    start_columns(&at);
    march(e, domain, vec_of(unknown), no_vec(), steps, 4, NULL, &at, stored, nodes, end);
    imbalance_at(e, end, no_vec(), missing);
    moments_of_columns(e, end, 3, &at, moments);
    imbalance_changes(e, end, no_vec(), 3, NULL, at.phi, moments, jacobian);
    *stable = is_stable(e, end, &at, jacobian, solve_small(jacobian, missing, 3, correction));
}

static void shoot_six(const equilibrium *e, const rm_domain *domain, const rm_real *unknown, const rm_real *scales,
                      int steps, expansion *stored, rm_node *nodes, march_end *end,
                      rm_real (*jacobian)[RM_MOST_COLUMNS], rm_real *correction, int *stable)
{
    variations at;
    columns_of_rows moments;
    column_forces forces;
    rm_real missing[6];
    const vec pull = vec_of(unknown + 3);
    memset(&forces, 0, sizeof forces);
    set_follower_columns(e->tip_length, scales[3], &forces);
    start_columns(&at);
    march(e, domain, vec_of(unknown), pull, steps, 8, &forces, &at, stored, nodes, end);
    imbalance_at(e, end, pull, missing);
    moments_of_columns(e, end, 6, &at, moments);
    imbalance_changes(e, end, pull, 6, &forces, at.phi, moments, jacobian);
    *stable = is_stable(e, end, &at, jacobian, solve_small(jacobian, missing, 6, correction));
}

/* Integrate without neighbouring solutions, with the law from nearby expansions; set the correction of a simplified
 * Newton step, with the Jacobian of the shot that stored the expansions. */
static void check(const equilibrium *e, const rm_domain *domain, const rm_real *unknown, int steps, expansion *stored,
                  rm_node *nodes, march_end *end, rm_real (*jacobian)[RM_MOST_COLUMNS], rm_real *correction)
{
    variations none; /* not read: there are no columns */
    rm_real missing[6];
    const vec pull = pull_of(e, unknown);
    march(e, domain, vec_of(unknown), pull, steps, 0, NULL, &none, stored, nodes, end);
    imbalance_at(e, end, pull, missing);
    solve_small(jacobian, missing, e->unknowns, correction);
}

RM_INLINE int is_resolved(const march_end *end)
{
    return (end->roughness <= RM_ROUGHNESS * (R(1.0) + end->sharpest))
           & (end->longest_way <= RM_STRETCH * RM_STRETCH);
}

/* Slope of the unknowns by the load fraction at no load: the loads' moment about the base, on the rod in its free
 * shape, bends the first section. */
static void first_slope(const equilibrium *e, vec free_curvature, const sym *flexibility, rm_real *slope)
{
    const resultants *l = &e->loads;
    const vec turn = scale(e->length, free_curvature), ahead = {R(0.0), R(0.0), R(1.0)};
    vec end, half;
    screw_by(e->mount, scale(R(0.5), turn), scale(R(0.5) * e->length, ahead), &half);
    const quat frame = screw_by(e->mount, turn, scale(e->length, ahead), &end);
    /* Mean of the positions by Simpson's rule. */
    const vec middle = add(scale(R(4.0 / 6.0), half), scale(R(1.0 / 6.0), end)), axis = out_of_body(frame, ahead);
    vec moment = add(l->end_moment, out_of_body(frame, l->follower_moment));
    moment = add(moment, add(cross(end, l->end_force), cross(axis, l->lever)));
    moment = add(moment, cross(middle, l->body_force));
    moment = add(moment, cross(out_of_body(frame, e->offset), l->cap_force));
    if (e->unknowns == 6) {
        const vec pulled = out_of_body(frame, l->follower_force);
        moment = add(moment, cross(along(end, e->tip_length, axis), pulled));
        put_vec(slope + 3, pulled);
    }
    put_vec(slope, scale(e->length, sym_apply(*flexibility, into_body(e->mount, moment))));
    for (int k = 0; k < e->unknowns; k++) {
        if (!is_finite(slope[k])) {
            for (int j = 0; j < e->unknowns; j++) {
                slope[j] = R(0.0);
            }
            return;
        }
    }
}

RM_INLINE rm_real farthest(const rm_node *a, const rm_node *b, int steps)
{
    rm_real most = R(0.0);
    for (int n = 0; n <= steps; n++) {
        const rm_real d = largest(sub(vec_of(a[n].turn), vec_of(b[n].turn)));
        most = (d > most || d != d) ? d : most; /* a NaN stays */
    }
    return most;
}

/* Solve for the equilibrium that the rod reaches from its free shape as the loads grow in proportion, or for the one
 * that Newton's method finds from `start`, if it is not NULL. If the full load cannot be reached, `reached` is the
 * equilibrium at the largest fraction that was. Sizes: 4 steps + 1 expansions, twice steps + 1 nodes, two Jacobians. */
static void follow(const equilibrium *whole, const rm_domain *domain, vec free_curvature, const section_state *free,
                   const rm_real *start, const rm_options *options, expansion *stored, rm_node *first_nodes, rm_node *second_nodes,
                   rm_real (*jacobians)[RM_MOST_COLUMNS], reached_state *reached)
{
    const int n = whole->unknowns, steps = options->steps;
    const sym flexibility = sym_inverse(free->stiffness);
    equilibrium e = *whole;
    rm_node *spare = second_nodes;
    rm_real (*tangent)[RM_MOST_COLUMNS] = jacobians, (*spare_tangent)[RM_MOST_COLUMNS] = jacobians + 6;
    rm_real slope[6], guess[6], correction[6], step = R(1.0), size = infinite();
    int warm = start != NULL, sure = 0, stable = 1;

    reached->nodes = first_nodes;
    reached->jacobian = tangent;
    reached->load_fraction = R(0.0);
    reached->load_steps = reached->shots = 0;
    reached->stable = 1;
    reached->outcome = DIVERGED;
    for (int k = 0; k < 6; k++) {
        reached->unknown[k] = slope[k] = R(0.0);
        reached->scales[k] = k < 3 ? R(1.0) : follower_scale(free, whole->length);
    }
    put_vec(reached->unknown, scale(whole->length, free_curvature));
    for (int k = 0; k <= steps; k++) {
        put_vec(first_nodes[k].turn, vec_of(reached->unknown));
    }
    if (warm) {
        for (int k = 0; k < n; k++) {
            guess[k] = start[k];
        }
    } else {
        first_slope(whole, free_curvature, &flexibility, slope);
        for (int k = 0; k < n; k++) {
            guess[k] = reached->unknown[k] + slope[k];
        }
    }

    while (reached->load_fraction < R(1.0) && step >= RM_SMALLEST_LOAD_STEP && reached->shots < options->max_shots) {
        const rm_real left = R(1.0) - reached->load_fraction;
        const rm_real target = step < left ? reached->load_fraction + step : R(1.0);
        /* The first guess needs only half the steps: its own error is larger than theirs. */
        const int rough = steps > 1 && reached->shots == 0 && !warm;
        const int taken = rough ? steps / 2 : steps;
        march_end end;
        e.loads = scaled(&whole->loads, target);
        if (sure) {
            check(&e, domain, guess, taken, stored, spare, &end, tangent, correction);
        } else if (n == 3) {
            shoot_three(&e, domain, guess, taken, stored, spare, &end, tangent, correction, &stable);
        } else {
            shoot_six(&e, domain, guess, reached->scales, taken, stored, spare, &end, tangent, correction, &stable);
        }
        reached->shots++;
        const rm_real before = size;
        size = R(0.0);
        for (int k = 0; k < n; k++) {
            const rm_real c = rm_abs(correction[k]);
            size = (c > size || c != c) ? c : size; /* a NaN stays */
        }
        const int done = size <= options->tolerance && !rough;
        const int near = done && farthest(spare, reached->nodes, steps) <= RM_MAX_TURN;
        const int resolved = is_resolved(&end);
        const int holds = stable && end.convex;
        const int good = done && resolved && (warm || (near && holds));
        /* Comparisons with a NaN are false: it ends the iteration. */
        const int hopeful = !done && size <= RM_CONTRACTION * before && size <= RM_MAX_TURN;

        if (good) {
            const rm_real by = R(1.0) / step;
            for (int k = 0; k < n; k++) {
                slope[k] = by * (guess[k] - reached->unknown[k]);
                reached->unknown[k] = guess[k];
            }
            rm_node *const nodes = reached->nodes;
            reached->nodes = spare;
            spare = nodes;
            rm_real (*const jacobian)[RM_MOST_COLUMNS] = spare_tangent;
            reached->jacobian = tangent;
            spare_tangent = tangent;
            tangent = jacobian;
            reached->end = end;
            reached->load_fraction = target;
            reached->load_steps++;
            reached->stable = holds;
        }
        if (!hopeful && !rough) {
            reached->outcome = good ? ARRIVED : (done && !resolved ? UNRESOLVED : (done && near ? UNSTABLE : DIVERGED));
        }
        /* With quadratic convergence the next correction is ratio size^2; if it is below the tolerance, the next shot
         * is the last one and needs no new Jacobian. */
        const rm_real ratio = before < infinite() ? size / (before * before) : R(1.0);
        const int was_sure = sure;
        sure = hopeful && !was_sure && !rough && ratio * size * size <= options->tolerance;
        /* After a failed warm start the full load is tried from the free shape. */
        const rm_real factor = good ? R(2.0) : ((hopeful || warm || rough) ? R(1.0) : R(0.5));
        step = smaller(factor * step, R(1.0) - reached->load_fraction);
        if (warm && !hopeful && !good) {
            first_slope(whole, free_curvature, &flexibility, slope);
        }
        warm = warm && hopeful;
        for (int k = 0; k < n; k++) {
            guess[k] = hopeful ? guess[k] - reached->scales[k] * correction[k]
                               : reached->unknown[k] + step * slope[k];
        }
        size = (hopeful && !rough) ? size : infinite();
    }
}

#endif
