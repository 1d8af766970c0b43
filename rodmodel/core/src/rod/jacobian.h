/* Derivatives of the pose, by the implicit function theorem on the linearised equations along the rod.
 *
 * With x the unknowns of the shooting, p the inputs, y the pose and e(x, p) = 0 the balance at the end, dy/dp = y_p -
 * y_x e_x^-1 e_p. The columns of the neighbouring solutions are derivatives by the unknowns, the pressures, the tip
 * force and gravity; a tip moment enters only at the end. */
#ifndef RM_JACOBIAN_H
#define RM_JACOBIAN_H

#include "response.h"

#define RM_INPUTS 12

/* RM_WORKSPACE_SIZE counts on it. */
typedef char a_response_has_its_size[2 * sizeof(response) == RM_KEPT_SIZE * sizeof(rm_real) ? 1 : -1];

/* Neighbouring solutions by unknowns and pressures, and by loads if there are 12 inputs. */
typedef struct {
    response end;                   /* columns at the base, then at the end of the body */
    response *kept;                 /* columns at the nodes, with their rates, or NULL */
    column_forces forces;
    rm_real jacobian[6][RM_MOST_COLUMNS]; /* derivative of the residual by the columns */
    rm_real by_input[6][RM_INPUTS]; /* derivatives of the unknowns by the inputs */
    int unknowns, columns, inputs;
    mat world;                      /* frame of the base */
} derivatives;

/* Set up the columns of the derivatives by pressures, with `by_loads` also by loads; `keep` keeps them at the nodes. */
static void prepare_derivatives(const solve_state *at, const rm_input *input, int by_loads, int keep, derivatives *d)
{
    const rm_real identity[9] = {R(1.0), R(0.0), R(0.0), R(0.0), R(1.0), R(0.0), R(0.0), R(0.0), R(1.0)};
    const rm_actuator *a = &at->rod->actuator;
    const rm_real tip_length = a->cap_length + a->stiff_tip;
    const weights w = weights_of(a);
    column_forces *forces = &d->forces;
    d->unknowns = at->equilibrium.unknowns;
    d->columns = d->unknowns == 6 ? 16 : (by_loads ? 12 : 8);
    d->inputs = by_loads ? RM_INPUTS : 3;
    d->kept = keep ? (response *)(void *)at->kept : NULL;
    d->world = mat_of_rows(input->given & RM_BASE ? input->base_rotation : identity);
    memset(forces, 0, sizeof *forces);
    const vec rows[3] = {{d->world.a.x, d->world.b.x, d->world.c.x},
                         {d->world.a.y, d->world.b.y, d->world.c.y},
                         {d->world.a.z, d->world.b.z, d->world.c.z}};
    for (int axis = 0; axis < 3 && by_loads; axis++) {
        /* Components of a world axis in the frame of the base. */
        const rm_real unit[3] = {rows[axis].x, rows[axis].y, rows[axis].z};
        const int f = d->unknowns + 3 + axis, g = f + 3;
        for (int i = 0; i < 3; i++) {
            forces->end[i][f] = forces->cap[i][f] = unit[i];
            forces->lever[i][f] = tip_length * unit[i];
            forces->end[i][g] = w.end_force * unit[i];
            forces->body[i][g] = w.body_force * unit[i];
            forces->cap[i][g] = w.cap_force * unit[i];
            forces->lever[i][g] = w.lever * unit[i];
        }
    }
    if (d->unknowns == 6) {
        set_follower_columns(tip_length, follower_scale(&at->free, a->body_length - a->stiff_tip), forces);
    }
    memset(&d->end, 0, sizeof d->end);
    for (int k = 0; k < 3; k++) {
        put_column(d->end.phi, d->unknowns + k, at->equilibrium.mount_slopes[k]);
    }
}

/* Nodes of a rod without loads, which was solved as one arc. */
static void divide_arc(solve_state *at, int steps)
{
    const equilibrium *e = &at->equilibrium;
    for (int n = 0; n <= steps; n++) {
        rm_node *node = at->reached.nodes + n;
        const rm_real part = (rm_real)n / (rm_real)steps;
        const vec way = {R(0.0), R(0.0), part * e->length};
        vec position;
        const quat q = screw_by(e->mount, scale(part, at->reached.end.turn), way, &position);
        memset(node, 0, sizeof *node);
        put_vec(node->position, position);
        node->quaternion[0] = q.w;
        put_vec(node->quaternion + 1, q.v);
        put_vec(node->turn, at->reached.end.turn);
    }
    at->steps = steps;
}

/* Derivatives by the inputs at fixed unknowns: a tip moment has no column. */
RM_INLINE void by_inputs(const derivatives *d, const rm_real *columns, rm_real *found)
{
    const int n = d->unknowns;
    for (int k = 0; k < d->inputs; k++) {
        found[k] = k < 6 ? columns[n + k] : (k < 9 ? R(0.0) : columns[n + k - 3]);
    }
}

/* Derivatives of the unknowns by the inputs, from those of the residual, by Gaussian elimination with partial
 * pivoting. */
static void solve_for_inputs(derivatives *d, rm_real (*missing)[RM_INPUTS])
{
    const int n = d->unknowns, inputs = d->inputs;
    rm_real m[6][6];
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < n; k++) {
            m[i][k] = d->jacobian[i][k];
        }
    }
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++) {
            pivot = rm_abs(m[i][k]) > rm_abs(m[pivot][k]) ? i : pivot;
        }
        const rm_real scale_of_it = R(1.0) / m[pivot][k];
        for (int j = 0; j < n; j++) {
            const rm_real other = m[k][j];
            m[k][j] = scale_of_it * m[pivot][j];
            m[pivot][j] = pivot == k ? m[k][j] : other;
        }
        for (int j = 0; j < inputs; j++) {
            const rm_real other = missing[k][j];
            missing[k][j] = scale_of_it * missing[pivot][j];
            missing[pivot][j] = pivot == k ? missing[k][j] : other;
        }
        for (int i = 0; i < n; i++) {
            const rm_real factor = i == k ? R(0.0) : m[i][k];
            for (int j = 0; j < n; j++) {
                m[i][j] -= factor * m[k][j];
            }
            for (int j = 0; j < inputs; j++) {
                missing[i][j] -= factor * missing[k][j];
            }
        }
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < inputs; j++) {
            d->by_input[i][j] = -missing[i][j];
        }
    }
}

/* Differentiate the equilibrium reached. */
static void differentiate(solve_state *at, const rm_input *input, int steps, int by_loads, int keep, derivatives *d)
{
    equilibrium e = at->equilibrium;
    reached_state *reached = &at->reached;
    const int n = e.unknowns;
    const vec pull = pull_of(&e, reached->unknown);
    e.loads = scaled(&at->loads, at->loaded ? reached->load_fraction : R(0.0));
    prepare_derivatives(at, input, by_loads, keep, d);
    if (!at->loaded) {
        divide_arc(at, steps);
    }
    march_end *end = &reached->end;
    if (d->columns == 8) {
        integrate_response(&e, pull, steps, 8, &d->forces, &d->end, d->kept, reached->nodes, end);
    } else if (d->columns == 12) {
        integrate_response(&e, pull, steps, 12, &d->forces, &d->end, d->kept, reached->nodes, end);
    } else {
        integrate_response(&e, pull, steps, 16, &d->forces, &d->end, d->kept, reached->nodes, end);
    }
    imbalance_changes(&e, end, pull, n + d->inputs - (by_loads ? 3 : 0), &d->forces, d->end.phi, d->end.moment,
                      d->jacobian);

    /* Pressures move the cap aside as well. */
    const quat q = end->frame;
    const vec push = add(into_body(q, e.loads.cap_force), into_body(q, pull));
    for (int k = 0; k < 3; k++) {
        const vec change = cross(e.offset_slopes[k], push);
        d->jacobian[0][n + k] -= change.x;
        d->jacobian[1][n + k] -= change.y;
        d->jacobian[2][n + k] -= change.z;
    }
    rm_real missing[6][RM_INPUTS];
    for (int i = 0; i < n; i++) {
        by_inputs(d, d->jacobian[i], missing[i]);
    }
    if (by_loads) {
        /* A tip moment enters only here. */
        const mat frame = mat_product(d->world, mat_of_quat(q));
        const vec columns[3] = {frame.a, frame.b, frame.c};
        for (int i = 0; i < 3; i++) {
            missing[i][6] = -columns[i].x;
            missing[i][7] = -columns[i].y;
            missing[i][8] = -columns[i].z;
        }
    }
    solve_for_inputs(d, missing);
}

/* Derivatives by the inputs of a number at a section, from its columns. */
RM_INLINE void of_inputs(const derivatives *d, const rm_real *columns, rm_real *found)
{
    by_inputs(d, columns, found);
    for (int x = 0; x < d->unknowns; x++) {
        for (int k = 0; k < d->inputs; k++) {
            found[k] += columns[x] * d->by_input[x][k];
        }
    }
}

/* Add the product of a matrix and rows of derivatives. */
RM_INLINE void add_product(const derivatives *d, mat m, rm_real (*rows)[RM_INPUTS], rm_real *found)
{
    rm_real entries[3][3];
    matrix_rows(entries, m);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < d->inputs; k++) {
            found[RM_INPUTS * i + k] +=
                entries[i][0] * rows[0][k] + entries[i][1] * rows[1][k] + entries[i][2] * rows[2][k];
        }
    }
}

/* Derivatives, in the world frame, of the section's turn and of a point at `arm` from the section, in its frame. The
 * arm includes `share` of the cap's offset. */
static void put_pose_change(const solve_state *at, const derivatives *d, const response *v, quat q, vec arm,
                            rm_real share, rm_real *positions, rm_real *turns)
{
    rm_real phi[3][RM_INPUTS], change[3][RM_INPUTS], shift[3][RM_INPUTS];
    const mat frame = mat_product(d->world, mat_of_quat(q));
    for (int i = 0; i < 3; i++) {
        of_inputs(d, v->phi[i], phi[i]);
        of_inputs(d, v->shift[i], shift[i]);
    }
    for (int k = 0; k < d->inputs; k++) {
        const vec p = {phi[0][k], phi[1][k], phi[2][k]};
        vec c = cross(p, arm);
        if (k < 3) {
            c = along(c, share, at->equilibrium.offset_slopes[k]);
        }
        change[0][k] = c.x;
        change[1][k] = c.y;
        change[2][k] = c.z;
    }
    memset(positions, 0, 3 * RM_INPUTS * sizeof(rm_real));
    memset(turns, 0, 3 * RM_INPUTS * sizeof(rm_real));
    add_product(d, frame, phi, turns);
    add_product(d, frame, change, positions);
    add_product(d, mat_scale(at->equilibrium.length, d->world), shift, positions);
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
        const response *a = d->kept + 2 * n, *b = a + 2;
        response v;
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
        result = solve_begun(at, input, options, start, solution);
    } else {
        fail(solution, RM_BAD_INPUT);
    }
    if (!is_finite(solution->tip_position[0])) {
        fill_with_nan(jacobian->position, sizeof *jacobian / sizeof(rm_real));
        fill_with_nan(positions, (size_t)count * 3 * RM_INPUTS);
        fill_with_nan(turns, (size_t)count * 3 * RM_INPUTS);
        return result;
    }
    differentiate(at, input, options->steps, 1, count > 0, &d);
    solution->steps = at->steps;
    const vec cap = cap_of(&at->equilibrium);
    const quat q = at->reached.end.frame;
    const vec ahead = {R(0.0), R(0.0), R(1.0)};
    put_pose_change(at, &d, &d.end, q, cap, R(1.0), jacobian->position, jacobian->turn);
    put_bend_change(&d, solution, out_of_body(q, ahead), jacobian);
    if (count > 0) {
        put_stations_change(at, &d, count, arc_lengths, positions, turns);
    }
    return result;
}

#endif
