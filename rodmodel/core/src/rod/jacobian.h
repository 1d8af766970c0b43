/* Derivatives of the pose, by the implicit function theorem on the linearised equations along the rod.
 *
 * With x the unknowns of the shooting, p the inputs, y the pose and e(x, p) = 0 the balance at the end, dy/dp = y_p -
 * y_x e_x^-1 e_p. The columns of the neighbouring solutions are derivatives by the unknowns, the pressures, the tip
 * force and gravity; a tip moment enters only at the end. */
#ifndef RM_JACOBIAN_H
#define RM_JACOBIAN_H

#include "solve.h"

/* Column of an input: pressures, tip force, tip moment (-1, as it has no column), gravity. */
RM_INLINE int column_of_input(int input, int unknowns)
{
    return input < 6 ? unknowns + input : (input < 9 ? -1 : unknowns + input - 3);
}

/* Complete the derivatives of the equilibrium reached, with another shot if the last one did not integrate them. */
static void differentiate(solve_state *at, const rm_options *options, derivatives *d)
{
    equilibrium e = at->equilibrium;
    reached_state *reached = &at->reached;
    const int n = e.unknowns, steps = options->steps;
    const vec pull = pull_of(&e, reached->unknown);
    e.loads = scaled(&at->loads, at->loaded ? reached->load_fraction : R(0.0));
    if (!d->is_done) {
        rm_real correction[6];
        shoot_driven(&e, &at->rod->domain, reached->unknown, steps, d, reached->nodes, &reached->end, correction);
    }
    at->steps = steps;
    if (d->kept != NULL) {
        variations *last = d->kept + 2 * steps;
        section_state section;
        vec drift;
        last[0] = d->end;
        rates_at(&e, R(1.0), reached->end.frame, reached->end.turn, pull, d->columns, 1, &d->forces, last, last + 1,
                 NULL, &section, &drift);
    }

    /* Direct changes of the balance at the end with the pressures, through the law and the cap's offset. */
    vec moments[3], stiffened[3];
    const quat q = reached->end.frame;
    const vec push = add(into_body(q, e.loads.cap_force), into_body(q, pull));
    linearise(e.section, scale(R(1.0) / e.length, reached->end.turn), 1);
    slopes_by_pressure(e.section, no_vec(), moments, stiffened);
    for (int k = 0; k < 3; k++) {
        const vec change = sub(moments[k], cross(e.offset_slopes[k], push));
        d->jacobian[0][n + k] += change.x;
        d->jacobian[1][n + k] += change.y;
        d->jacobian[2][n + k] += change.z;
    }
    for (int k = 0; k < d->inputs; k++) {
        const int column = column_of_input(k, n);
        rm_real right[6] = {R(0.0), R(0.0), R(0.0), R(0.0), R(0.0), R(0.0)}, by[6];
        if (column >= 0) {
            for (int i = 0; i < n; i++) {
                right[i] = -d->jacobian[i][column];
            }
        } else {
            const vec unit = {k == 6 ? R(1.0) : R(0.0), k == 7 ? R(1.0) : R(0.0), k == 8 ? R(1.0) : R(0.0)};
            put_vec(right, into_body(q, mat_back(d->world, unit)));
        }
        solve_small(d->jacobian, right, n, by);
        for (int i = 0; i < n; i++) {
            d->by_input[i][k] = by[i];
        }
    }
}

/* Derivatives by the inputs from the columns' values at a section. */
RM_INLINE void of_inputs(const derivatives *d, rm_real values[3][RM_MOST_COLUMNS], rm_real found[3][RM_INPUTS])
{
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < d->inputs; k++) {
            const int column = column_of_input(k, d->unknowns);
            rm_real sum = column >= 0 ? values[i][column] : R(0.0);
            for (int x = 0; x < d->unknowns; x++) {
                sum += values[i][x] * d->by_input[x][k];
            }
            found[i][k] = sum;
        }
    }
}

/* Derivatives, in the world frame, of the section's turn and of a point at `arm` from the section, in its frame. The
 * arm includes `share` of the cap's offset. */
static void put_pose_change(const solve_state *at, const derivatives *d, variations *v, quat q, vec arm,
                            rm_real share, rm_real *positions, rm_real *turns)
{
    rm_real phi[3][RM_INPUTS], shift[3][RM_INPUTS];
    of_inputs(d, v->phi, phi);
    of_inputs(d, v->shift, shift);
    for (int k = 0; k < d->inputs; k++) {
        const vec p = {phi[0][k], phi[1][k], phi[2][k]}, s = {shift[0][k], shift[1][k], shift[2][k]};
        vec change = cross(p, arm);
        if (k < 3) {
            change = along(change, share, at->equilibrium.offset_slopes[k]);
        }
        const vec position = mat_apply(d->world, along(out_of_body(q, change), at->equilibrium.length, s));
        const vec turn = mat_apply(d->world, out_of_body(q, p));
        positions[k] = position.x;
        positions[RM_INPUTS + k] = position.y;
        positions[2 * RM_INPUTS + k] = position.z;
        turns[k] = turn.x;
        turns[RM_INPUTS + k] = turn.y;
        turns[2 * RM_INPUTS + k] = turn.z;
    }
}

static void put_bend_change(const derivatives *d, const rm_solution *solution, vec tangent, rm_jacobian *jacobian)
{
    vec rows[2];
    bend_by_turn(solution, tangent, rows);
    const rm_real theta = solution->bending_angle;
    for (int k = 0; k < RM_INPUTS; k++) {
        const vec world = {jacobian->turn[k], jacobian->turn[RM_INPUTS + k], jacobian->turn[2 * RM_INPUTS + k]};
        const vec turn = mat_back(d->world, world);
        const rm_real first = dot(rows[0], turn), second = dot(rows[1], turn);
        jacobian->bend[k] = first;
        jacobian->bend[RM_INPUTS + k] = second;
        const int straight = !(theta > RM_STRAIGHT);
        const rm_real b0 = solution->bend[0], b1 = solution->bend[1];
        jacobian->bending_angle[k] = straight ? not_a_number() : (b0 * first + b1 * second) / theta;
        jacobian->bending_plane[k] = straight ? not_a_number() : (b0 * second - b1 * first) / (theta * theta);
    }
}

/* Derivatives along the rod, from the kept nodes. */
static void put_stations_change(solve_state *at, const derivatives *d, int count, const rm_real *arc_lengths,
                                rm_real *positions, rm_real *turns)
{
    const rm_real length = at->equilibrium.length, end = length + at->equilibrium.tip_length;
    const rm_real h = R(1.0) / (rm_real)at->steps;
    for (int k = 0; k < count; k++, positions += 3 * RM_INPUTS, turns += 3 * RM_INPUTS) {
        const rm_real s = arc_lengths[k], body = smaller(s, length), place = body / length * (rm_real)at->steps;
        if (!(s >= R(0.0) && s <= end * (R(1.0) + R(4.0) * RM_EPSILON))) {
            fill_with_nan(positions, 3 * RM_INPUTS);
            fill_with_nan(turns, 3 * RM_INPUTS);
            continue;
        }
        int n = (int)place;
        n = n >= at->steps ? at->steps - 1 : n;
        const rm_real x = place - (rm_real)n, y = R(1.0) - x;
        const rm_real left = (R(1.0) + R(2.0) * x) * y * y, right = x * x * (R(3.0) - R(2.0) * x);
        const rm_real first = h * x * y * y, second = -h * x * x * y;
        const variations *a = at->kept + 2 * n, *b = a + 2;
        variations v;
        for (int i = 0; i < 3; i++) {
            for (int c = 0; c < d->columns; c++) {
                v.phi[i][c] = left * a[0].phi[i][c] + right * b[0].phi[i][c] + first * a[1].phi[i][c]
                              + second * b[1].phi[i][c];
                v.shift[i][c] = left * a[0].shift[i][c] + right * b[0].shift[i][c] + first * a[1].shift[i][c]
                                + second * b[1].shift[i][c];
            }
        }
        vec position, turn;
        const rm_real share = share_of_offset(body, length);
        const vec ahead = {R(0.0), R(0.0), s - body};
        const quat q = pose_between(at->reached.nodes, at->steps, length, body, &position, &turn);
        put_pose_change(at, d, &v, q, along(ahead, share, at->equilibrium.offset), share, positions, turns);
    }
}

static int solve_with_jacobian(solve_state *at, const rm_rod *rod, const rm_input *input, const rm_options *options,
                               const rm_real *start, rm_real *workspace, rm_solution *solution,
                               rm_jacobian *jacobian, int count, const rm_real *arc_lengths, rm_real *positions,
                               rm_real *turns)
{
    derivatives d;
    int result = RM_BAD_INPUT;
    if (is_good(input) && is_usable(options)) {
        begin(at, rod, input->pressure, options->steps, 1, 1, workspace);
        prepare_derivatives(at, input, 1, count > 0, &d);
        result = solve_begun(at, input, options, start, &d, solution);
    } else {
        fail(solution, RM_BAD_INPUT);
    }
    if (!is_finite(solution->tip_position[0])) {
        fill_with_nan(jacobian->position, sizeof *jacobian / sizeof(rm_real));
        fill_with_nan(positions, (size_t)count * 3 * RM_INPUTS);
        fill_with_nan(turns, (size_t)count * 3 * RM_INPUTS);
        return result;
    }
    differentiate(at, options, &d);
    solution->steps = at->steps;
    const vec cap = {at->equilibrium.offset.x, at->equilibrium.offset.y, at->equilibrium.tip_length};
    const quat q = at->reached.end.frame;
    const vec ahead = {R(0.0), R(0.0), R(1.0)};
    put_pose_change(at, &d, &d.end, q, cap, R(1.0), jacobian->position, jacobian->turn);
    put_bend_change(&d, solution, out_of_body(q, ahead), jacobian);
    if (count > 0) {
        complete_nodes(at);
        put_stations_change(at, &d, count, arc_lengths, positions, turns);
    }
    return result;
}

#endif
