/* Inverse: pressures for a target bend or tip position, with the least co-contraction that reaches it.
 *
 * The target is a point: the tip's position, or the bend (theta cos gamma, theta sin gamma), which is smooth where the
 * rod is straight. Least squares over the domain finds the nearest pressures, in this order:
 *
 * 1. On the faces where one chamber has no pressure, without co-contraction. Two neighbouring chambers reach a sector
 *    of bending planes; the likeliest face comes first.
 * 2. If no face reaches the target, in the whole domain, from the nearest point of the faces. A face that comes close
 *    is followed into the domain at once.
 * 3. If that misses the target, again from there with more co-contraction: the poses of three pressures are close to a
 *    folded surface.
 * 4. Where a chamber alone may go further, along each of them: without the one or the other of those beside it, then
 *    with both, from two starts.
 * 5. If the target is still out of reach, from every local minimum of a grid over the domain.
 *
 * With loads, the search starts from the result for the rod without loads, which is cheap, and every step starts from
 * the solution of the step before. */
#ifndef RM_INVERSE_H
#define RM_INVERSE_H

#include "jacobian.h"
#include "least_squares.h"

/* Distances at which a target counts as reached, of position [over body and cap length] and of bend [rad]. */
#define RM_POSITION_REACHED R(1.5e-3)
#define RM_BEND_REACHED R(1e-3)
/* Tolerance of Newton's method in the search [rad]. */
#define RM_SEARCH_TOLERANCE R(1e-5)
/* Distance at which a search ends, over that at which a target is reached: two or three steps before rounding. */
#define RM_PART R(1e-3)
/* The same under loads: about the error of the integration. */
#define RM_LOADED_PART R(1e-2)
/* Distance, in rod lengths or radians, at which the search without loads ends for a rod with loads. */
#define RM_NEAR R(0.1)
/* Distance at which a face is followed into the domain before the other faces are tried. */
#define RM_CLOSE R(0.05)
/* Relative decrease of the sum of squares below which the search on a face ends. */
#define RM_WORTH R(1e-2)
/* Start of the search on a face, over the largest pressures. */
#define RM_START R(0.3)
/* Increase of the pressures for the search with more co-contraction, over the largest. */
#define RM_RAISE R(0.4)
/* Pressure over the largest that is set to zero: it moves the tip by less than the search's tolerance. */
#define RM_EMPTY R(5e-6)
/* Largest number of local minima of the grid from which to search. */
#define RM_FOLLOWED 8
/* Largest coordinate of a target, in rod lengths or radians: one in millimetres, or most in degrees, is beyond. */
#define RM_FARTHEST R(10.0)

typedef struct {
    const rm_rod *rod;
    const rm_input *input;
    rm_options options;
    rm_real *workspace;
    const rm_target *target;
    rm_real scale;     /* largest pressure [Pa] */
    rm_real unit;      /* unit of distances, which makes them near one */
    rm_real tolerance; /* distance at which the target is reached, in that unit */
    int loaded;        /* whether the loads are applied */
    int evaluations;
} search;

/* Derivative of V e3 by the turn along d, V = I + B turn^ + C turn^^2. */
static vec screw_change(vec turn, half_angle h, vec d)
{
    const rm_real x = dot(turn, turn), b = R(2.0) * h.sine * h.sine, c = h.third;
    rm_real db, dc;
    if (x < R(1.0)) {
        db = series(x, R(-1.0 / 24.0), R(2.0 / 720.0), R(-3.0 / 40320.0), R(4.0 / 3628800.0), R(-5.0 / 479001600.0),
                    R(6.0 / 87178291200.0), R(-7.0 / 20922789888000.0), R(8.0 / 6402373705728000.0));
        dc = series(x, R(-1.0 / 120.0), R(2.0 / 5040.0), R(-3.0 / 362880.0), R(4.0 / 39916800.0),
                    R(-5.0 / 6227020800.0), R(6.0 / 1307674368000.0), R(-7.0 / 355687428096000.0),
                    R(8.0 / 121645100408832000.0));
    } else {
        db = (R(0.5) * (R(1.0) - x * c) - b) / x;
        dc = (b - R(3.0) * c) / (R(2.0) * x);
    }
    const vec ahead = {R(0.0), R(0.0), R(1.0)}, once = cross(turn, ahead), twice = cross(turn, once);
    const rm_real dx = R(2.0) * dot(turn, d);
    const vec first = along(scale(db * dx, once), b, cross(d, ahead));
    const vec second = add(cross(d, once), cross(turn, cross(d, ahead)));
    return add(along(first, dc * dx, twice), scale(c, second));
}

/* Derivatives by the pressures of the tip of a rod without loads, an arc, after its solve. */
static void differentiate_arc(solve_state *at, const rm_input *input, vec positions[3], vec turns[3])
{
    const equilibrium *e = &at->equilibrium;
    const rm_real identity[9] = {R(1.0), R(0.0), R(0.0), R(0.0), R(1.0), R(0.0), R(0.0), R(0.0), R(1.0)};
    const mat world = mat_of_rows(input->given & RM_BASE ? input->base_rotation : identity);
    const vec turn = at->reached.end.turn, cap = cap_of(e);
    const half_angle h = half_angle_of(dot(turn, turn));
    const sym flexibility = sym_inverse(at->free.stiffness);
    const quat end = at->reached.end.frame;
    vec moments[3], stiffened[3];
    slopes_by_pressure(&at->section, no_vec(), moments, stiffened);
    const vec tip = add(at->reached.end.position, out_of_body(end, cap)); /* base frame */
    for (int k = 0; k < 3; k++) {
        const vec d = scale(-e->length, sym_apply(flexibility, moments[k]));
        const vec once = cross(turn, d);
        /* Turn of the end, in its frame; displacements of the end, and of the cap relative to it. */
        const vec phi = along(along(d, R(-2.0) * h.sine * h.sine, once), h.third, cross(turn, once));
        const vec way = out_of_body(e->mount, scale(e->length, screw_change(turn, h, d)));
        const vec cap_way = out_of_body(end, add(cross(phi, cap), e->offset_slopes[k]));
        const vec mount = out_of_body(e->mount, e->mount_slopes[k]);
        positions[k] = mat_apply(world, add(add(way, cap_way), cross(mount, tip)));
        turns[k] = mat_apply(world, add(mount, out_of_body(end, phi)));
    }
}

static rm_real miss(const search *s, const rm_solution *solution, vec *residual)
{
    const rm_real *point = s->target->point;
    vec r = no_vec();
    if (s->target->is_bend) {
        r.x = solution->bend[0] - point[0];
        r.y = solution->bend[1] - point[1];
    } else {
        r = sub(vec_of(solution->tip_position), vec_of(point));
    }
    *residual = scale(R(1.0) / s->unit, r);
    return dot(*residual, *residual);
}

static void evaluate_pose(void *what, vec point, const place *near, place *there)
{
    search *s = (search *)what;
    solve_state at;
    rm_solution solution;
    rm_input input = *s->input;
    vec positions[3], turns[3];
    put_vec(input.pressure, scale(s->scale, point));
    s->evaluations++;
    there->point = point;
    there->cost = infinite();
    if (!s->loaded) {
        input.given &= RM_BASE;
    }
    derivatives d;
    if (!is_good(&input)) {
        return;
    }
    begin(&at, s->rod, input.pressure, s->options.steps, 1, 1, s->workspace);
    rm_real start[6];
    if (s->loaded && near != NULL) {
        const vec way = sub(point, near->point);
        for (int k = 0; k < 6; k++) {
            start[k] = near->memory[k] + dot(vec_of(near->memory_slope[k]), way);
        }
    }
    const rm_real *from = s->loaded && near != NULL ? start : NULL;
    if (solve_begun(&at, &input, &s->options, from, &solution) != RM_SUCCESSFUL) {
        return;
    }
    if (at.loaded) {
        rm_real position[3 * RM_INPUTS], turn[3 * RM_INPUTS];
        differentiate(&at, &input, s->options.steps, 0, 0, &d);
        const vec cap = cap_of(&at.equilibrium);
        put_pose_change(&at, &d, &d.end, at.reached.end.frame, cap, R(1.0), position, turn);
        for (int k = 0; k < 3; k++) {
            const vec p = {position[k], position[RM_INPUTS + k], position[2 * RM_INPUTS + k]};
            const vec t = {turn[k], turn[RM_INPUTS + k], turn[2 * RM_INPUTS + k]};
            positions[k] = p;
            turns[k] = t;
        }
    } else {
        differentiate_arc(&at, &input, positions, turns);
    }
    memcpy(there->memory, solution.unknown, sizeof there->memory);
    memset(there->memory_slope, 0, sizeof there->memory_slope);
    for (int k = 0; at.loaded && k < d.unknowns; k++) {
        for (int j = 0; j < 3; j++) {
            there->memory_slope[k][j] = s->scale * at.reached.scales[k] * d.by_input[k][j];
        }
    }
    const rm_real cost = miss(s, &solution, &there->residual);
    vec *const columns[3] = {&there->slope.a, &there->slope.b, &there->slope.c};
    vec rows[2];
    if (s->target->is_bend) {
        const vec ahead = {R(0.0), R(0.0), R(1.0)};
        bend_by_turn(&solution, out_of_body(at.reached.end.frame, ahead), rows);
    }
    for (int k = 0; k < 3; k++) {
        vec change = positions[k];
        if (s->target->is_bend) {
            const vec turn = (input.given & RM_BASE) ? mat_back(mat_of_rows(input.base_rotation), turns[k]) : turns[k];
            change.x = dot(rows[0], turn);
            change.y = dot(rows[1], turn);
            change.z = R(0.0);
        }
        *columns[k] = scale(s->scale / s->unit, change);
        if (!is_finite(largest(*columns[k]))) {
            return;
        }
    }
    there->cost = cost;
}

/* Search in the first three stages; return the best fit, and the face on which or from which it was found. */
static least_squares_fit seek(search *s, const polytope *box, const vec starts[3], const int order[3],
                              rm_real enough_distance, rm_real part, int *face)
{
    const rm_real enough = part * s->tolerance * part * s->tolerance;
    least_squares_fit best;
    memset(&best, 0, sizeof best);
    best.best.point = starts[order[0]];
    best.best.cost = infinite();
    *face = order[0];
    int deepen = 0;
    for (int stage = 0; stage < 5 && !(rm_sqrt(best.best.cost) <= enough_distance);) {
        const int on_face = stage < 3 && !deepen, here = order[stage < 3 ? stage : 2];
        const int raise = stage == 4 && !deepen;
        const vec at = best.best.point;
        vec start = on_face ? starts[here] : at;
        if (raise) {
            const vec raised = {at.x + RM_RAISE, at.y + RM_RAISE, at.z + RM_RAISE};
            start = within(raised, box);
        }
        const place from = best.best;
        const place *near = on_face || raise || !(from.cost < infinite()) ? NULL : &from;
        const least_squares_fit fit =
            least_squares(evaluate_pose, s, start, near, box, on_face ? here : -1, enough, on_face ? RM_WORTH : R(0.0));
        /* A search that starts at the best point may end a rounding above it. */
        const int better = fit.best.cost <= best.best.cost * R(1.000001);
        if (better) {
            best = fit;
            if (on_face) {
                *face = here;
            }
        }
        deepen = on_face && better && rm_sqrt(fit.best.cost) <= RM_CLOSE;
        stage += deepen ? 0 : 1;
    }
    return best;
}

/* Search where single chambers go beyond the domain, the one that points to the target first: `order` is ascending.
 * `sure` becomes false if no search along one of them converged. */
static least_squares_fit seek_alone(search *s, const rm_domain *domain, const int order[3], rm_real part, int *sure)
{
    const rm_real enough = part * s->tolerance * part * s->tolerance;
    least_squares_fit best;
    memset(&best, 0, sizeof best);
    best.best.cost = infinite();
    for (int n = 2; n >= 0; n--) {
        const int chamber = order[n];
        if (!(domain->single_max[chamber] > R(0.0))) {
            continue;
        }
        rm_domain alone = *domain;
        polytope box;
        least_squares_fit from;
        int known = 0;
        alone.beside_max = R(0.0);
        alone.pressure_sum_max = R(0.0);
        for (int k = 0; k < 3; k++) {
            alone.pressure_max[k] = k == chamber ? domain->single_max[k] : domain->single_beside;
            alone.pressure_sum_max += alone.pressure_max[k];
        }
        set_polytope(&alone, s->scale, &box);
        for (int stage = 1; stage <= 4; stage++) {
            /* On a face from no pressure beside: where it hardly moves the tip, none is wanted. Then in all of it, from
             * the better face and from the middle. */
            const int face = stage < 3 ? (chamber + stage) % 3 : -1;
            const rm_real beside = stage == 4 ? R(0.5) * domain->single_beside / s->scale : R(0.0);
            rm_real middle[3] = {beside, beside, beside};
            middle[chamber] = R(0.5) * (domain->pressure_max[chamber] + domain->single_max[chamber]) / s->scale;
            const vec start = stage == 3 ? from.best.point : vec_of(middle);
            const place *near = stage == 3 && from.best.cost < infinite() ? &from.best : NULL;
            const least_squares_fit fit =
                least_squares(evaluate_pose, s, start, near, &box, face, enough, R(0.0));
            const rm_real off = rm_sqrt(fit.best.cost), least = rm_sqrt(best.best.cost);
            if (stage == 1 || fit.best.cost < from.best.cost) {
                from = fit;
            }
            known |= face < 0 && fit.converged;
            /* Pressure in both of the others is worth what it brings nearer. */
            if (off < least && (face >= 0 || off <= s->tolerance || off + s->tolerance < least)) {
                best = fit;
            }
            if (off <= s->tolerance) {
                return best;
            }
        }
        *sure &= known;
    }
    return best;
}

/* Search the whole domain from the local minima of a grid; a fit on a face that is as near, to the tolerance, replaces
 * the best. `costs` holds RM_GRID^3 numbers. Return whether every search converged. */
static int seek_everywhere(search *s, const polytope *box, rm_real *costs, least_squares_fit *best)
{
    const rm_real *most = box->bound + 3;
    const int side = RM_GRID, count = side * side * side;
    int sure = best->best.cost < infinite();
    place there, before;
    there.cost = infinite();
    vec nearest[3];
    rm_real least[3] = {infinite(), infinite(), infinite()};
    for (int n = 0; n < count; n++) {
        const int place_of[3] = {n % side, n / side % side, n / (side * side)};
        const rm_real step = R(1.0) / (rm_real)(side - 1);
        const vec corner = {most[0] * step * (rm_real)place_of[0], most[1] * step * (rm_real)place_of[1],
                            most[2] * step * (rm_real)place_of[2]};
        const vec point = within(corner, box);
        const int follows = place_of[0] > 0 && there.cost < infinite();
        before = there;
        evaluate_pose(s, point, follows ? &before : NULL, &there);
        costs[n] = there.cost;
        for (int k = 0; k < 3; k++) {
            if (place_of[k] == 0 && there.cost < least[k]) {
                least[k] = there.cost;
                nearest[k] = point;
            }
        }
    }
    /* Search from the lowest local minima in ascending order. */
    rm_real above = R(-1.0);
    for (int followed = 0; followed < RM_FOLLOWED; followed++) {
        int lowest = -1;
        for (int n = 0; n < count; n++) {
            if (!(costs[n] > above) || !(costs[n] < infinite()) || (lowest >= 0 && costs[n] >= costs[lowest])) {
                continue;
            }
            const int x = n % side, y = n / side % side, z = n / (side * side);
            int minimum = 1;
            for (int m = 0; m < 27 && minimum; m++) {
                const int i = x + m % 3 - 1, j = y + m / 3 % 3 - 1, k = z + m / 9 - 1;
                if (i >= 0 && j >= 0 && k >= 0 && i < side && j < side && k < side) {
                    minimum = costs[n] <= costs[i + side * (j + side * k)];
                }
            }
            lowest = minimum ? n : lowest;
        }
        if (lowest < 0) {
            break;
        }
        above = costs[lowest];
        const rm_real step = R(1.0) / (rm_real)(side - 1);
        const vec corner = {most[0] * step * (rm_real)(lowest % side), most[1] * step * (rm_real)(lowest / side % side),
                            most[2] * step * (rm_real)(lowest / (side * side))};
        const least_squares_fit fit =
            least_squares(evaluate_pose, s, within(corner, box), NULL, box, -1, R(0.0), R(0.0));
        sure &= fit.converged;
        if (fit.best.cost < best->best.cost) {
            *best = fit;
        }
    }
    /* Prefer a face that is as near with a smaller sum of pressures. */
    const rm_real bound = rm_sqrt(best->best.cost) + s->tolerance;
    least_squares_fit chosen = *best;
    rm_real pressure = best->best.point.x + best->best.point.y + best->best.point.z - R(1e-6);
    for (int k = 0; k < 3; k++) {
        if (!(least[k] < infinite())) {
            continue;
        }
        const least_squares_fit fit =
            least_squares(evaluate_pose, s, nearest[k], NULL, box, k, R(0.0), R(0.0));
        const rm_real sum = fit.best.point.x + fit.best.point.y + fit.best.point.z;
        if (fit.converged && rm_sqrt(fit.best.cost) <= bound && sum < pressure) {
            chosen = fit;
            pressure = sum;
        }
    }
    *best = chosen;
    return sure;
}

static int find_pressures(const rm_rod *rod, const rm_target *target, const rm_input *input,
                          const rm_options *options, rm_real *workspace, rm_inverse_result *result)
{
    const rm_domain *domain = &rod->domain;
    const rm_actuator *a = &rod->actuator;
    rm_input bare = *input;
    search s;
    polytope box;
    memset(bare.pressure, 0, sizeof bare.pressure);
    memset(result, 0, sizeof *result);
    s.rod = rod;
    s.input = &bare;
    s.options = *options;
    s.options.ask = 0;
    s.workspace = workspace;
    s.target = target;
    s.unit = target->is_bend ? R(1.0) : a->body_length + a->cap_length;
    s.tolerance = target->is_bend ? RM_BEND_REACHED : RM_POSITION_REACHED;
    s.scale = larger(larger(domain->pressure_max[0], domain->pressure_max[1]), domain->pressure_max[2]);
    s.evaluations = 0;
    s.loaded = (input->given & (RM_LOADS | RM_FOLLOWER_FORCE)) != 0;
    int near = 1; /* false for a NaN */
    const rm_real *least = domain->pressure_min;
    const int whole = !(least[0] > R(0.0)) & !(least[1] > R(0.0)) & !(least[2] > R(0.0));
    for (int k = 0; k < (target->is_bend ? 2 : 3); k++) {
        const rm_real from = !target->is_bend && (input->given & RM_BASE) ? input->base_position[k] : R(0.0);
        near &= rm_abs(target->point[k] - from) <= RM_FARTHEST * s.unit;
    }
    if (!is_good(&bare) || !is_usable(options) || !near || !whole) {
        fill_with_nan(result->pressure, 4);
        return fail(&result->solution, RM_BAD_INPUT);
    }
    set_polytope(domain, s.scale, &box);

    /* The likeliest face is without the chamber that bends the rod farthest from the target's direction. */
    vec way = vec_of(target->point);
    if (!target->is_bend) {
        if (input->given & RM_BASE) {
            way = mat_back(mat_of_rows(input->base_rotation), sub(way, vec_of(input->base_position)));
        }
        way = scale(R(-1.0), way);
    }
    rm_real towards[3];
    int order[3] = {0, 1, 2};
    for (int k = 0; k < 3; k++) {
        const vec axis = bending_axis(k); /* (sine, -cosine) of the chamber's azimuth */
        towards[k] = -axis.y * way.x + axis.x * way.y;
    }
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 2 - i; k++) {
            if (towards[order[k]] > towards[order[k + 1]]) {
                const int other = order[k];
                order[k] = order[k + 1];
                order[k + 1] = other;
            }
        }
    }
    vec starts[3];
    for (int k = 0; k < 3; k++) {
        const vec far = {k == 0 ? R(0.0) : box.bound[3], k == 1 ? R(0.0) : box.bound[4],
                         k == 2 ? R(0.0) : box.bound[5]};
        starts[k] = scale(RM_START, within(far, &box));
    }
    const int loaded = s.loaded, ascending[3] = {order[0], order[1], order[2]};
    int face;
    s.loaded = 0;
    least_squares_fit fit = seek(&s, &box, starts, order, loaded ? RM_NEAR : s.tolerance, RM_PART, &face);
    if (loaded) {
        s.loaded = 1;
        s.options.steps = RM_SEARCH_STEPS;
        s.options.tolerance = larger(RM_SEARCH_TOLERANCE, options->tolerance);
        rm_real start[3];
        put_vec(start, fit.best.point);
        start[face] = R(0.0);
        starts[face] = vec_of(start);
        /* Try that face first, the others in the same order. */
        for (int k = 2; k > 0; k--) {
            if (order[k] == face) {
                order[k] = order[k - 1];
                order[k - 1] = face;
            }
        }
        fit = seek(&s, &box, starts, order, s.tolerance, RM_LOADED_PART, &face);
    }
    int nearest = rm_sqrt(fit.best.cost) <= s.tolerance;
    if (!nearest) {
        int sure = 1;
        const least_squares_fit alone =
            seek_alone(&s, domain, ascending, loaded ? RM_LOADED_PART : RM_PART, &sure);
        nearest = rm_sqrt(alone.best.cost) <= s.tolerance;
        if (!nearest) {
            rm_real *costs = workspace + workspace_size(rod, options->steps, 1) - RM_GRID * RM_GRID * RM_GRID;
            nearest = seek_everywhere(&s, &box, costs, &fit) && sure;
        }
        if (alone.best.cost < fit.best.cost) {
            fit = alone;
        }
    }
    rm_real found[3];
    put_vec(found, fit.best.point);
    for (int k = 0; k < 3; k++) {
        /* The largest pressure in its unit: the way into another one and back rounds. */
        const rm_real most = larger(domain->pressure_max[k], domain->single_max[k]);
        bare.pressure[k] = found[k] > RM_EMPTY ? smaller(s.scale * found[k], most) : R(0.0);
    }
    put_vec(result->pressure, vec_of(bare.pressure));
    solve_state at;
    const int ended = solve(&at, rod, &bare, options, NULL, workspace, &result->solution);
    vec residual;
    result->distance = s.unit * rm_sqrt(miss(&s, &result->solution, &residual));
    result->reached = ended == RM_SUCCESSFUL && result->distance <= s.tolerance * s.unit;
    result->converged = ended == RM_SUCCESSFUL && fit.converged;
    result->nearest = result->converged && nearest;
    result->evaluations = s.evaluations;
    return ended;
}

#endif
