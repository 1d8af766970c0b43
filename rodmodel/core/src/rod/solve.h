/* The solve: from an input to the pose and its flags. */
#ifndef RM_SOLVE_H
#define RM_SOLVE_H

#include "kinematics.h"
#include "volumes.h"

/* Factor on the limits of the domain: a change of units rounds. */
#define RM_SLACK R(1.000001)
/* Largest error of R^T R - I, entry by entry: a rotation in single precision passes. */
#define RM_ORTHOGONAL R(1e-5)
/* Largest tolerance [rad]: above, any guess would pass for an equilibrium. */
#define RM_LOOSEST R(1e-2)

/* State of a solve; its arrays lie in the workspace. */
typedef struct {
    const rm_rod *rod;
    contracted section;
    equilibrium equilibrium;
    section_state free; /* section at the free curvature */
    vec free_curvature;
    rm_node *nodes[2];
    expansion *expansions; /* expansions of the law at every stage of a step, and at the end */
    rm_real *features;
    rm_real *lifts;       /* c phi' of ridges, summed over sections */
    rm_real *weights;     /* quadrature weights of the nodes */
    rm_real *kept;        /* room for a Jacobian's columns at the nodes, with their rates; NULL without one */
    rm_real jacobians[12][RM_MOST_COLUMNS];
    reached_state reached;
    resultants loads;     /* full load, frame of the base */
    int loaded;
    int steps;            /* number of steps between the nodes: 1 for an arc */
} solve_state;

RM_INLINE size_t aligned(size_t count)
{
    return RM_PADDED(count);
}

/* RM_WORKSPACE_SIZE counts on these sizes. */
typedef char node_has_the_size_that_the_header_says[sizeof(rm_node) == RM_NODE_SIZE * sizeof(rm_real) ? 1 : -1];
typedef char an_expansion_has_it[sizeof(expansion) == RM_EXPANSION_SIZE * sizeof(rm_real) ? 1 : -1];

static size_t workspace_size(const rm_rod *rod, int steps, int with_jacobian)
{
    return RM_WORKSPACE_SIZE((size_t)rod->law.images, (size_t)rod->law.ridges, (size_t)rod->law.features,
                             (size_t)steps, with_jacobian);
}

/* Lay out the workspace and contract the law; volumes and derivatives need its slopes by the pressures. */
static void begin(solve_state *at, const rm_rod *rod, const rm_real *pressure, int steps, int with_jacobian,
                  int with_slopes, rm_real *memory)
{
    const size_t total = (size_t)rod->law.images * (size_t)rod->law.ridges;
    const size_t inputs = aligned(3 + (size_t)rod->law.features);
    memory += (64 - (uintptr_t)memory % 64) % 64 / sizeof(rm_real);
    at->rod = rod;
    contract(&rod->law, pressure, with_jacobian || with_slopes, memory, memory + inputs, &at->section);
    memory += inputs + 6 * total;
    at->features = memory;
    memory += inputs;
    at->lifts = memory;
    memory += total;
    at->weights = memory;
    memory += aligned((size_t)steps + 1);
    at->expansions = (expansion *)(void *)memory;
    memory += (4 * (size_t)steps + 1) * (sizeof(expansion) / sizeof(rm_real));
    at->nodes[0] = (rm_node *)(void *)memory;
    at->nodes[1] = at->nodes[0] + steps + 1;
    at->kept = with_jacobian ? (rm_real *)(at->nodes[1] + steps + 1) : NULL;
    at->free_curvature = find_free_curvature(&at->section, &at->free);
}

/* Largest angle by which the forces may shear a section: that grows with the force as long as it is small. */
#define RM_SHEARED R(0.2)

/* Cosine of half the largest turn of the base that is believed, 0.5 rad: elsewhere in their domains the laws that ship
 * have up to 0.3. A section that is about to give way would turn it by any angle. */
#define RM_HALF_TURNED R(0.96891242171064478473)

static int shears_little(const rm_actuator *a, const resultants *l)
{
    const rm_real force = rm_sqrt(dot(l->end_force, l->end_force)) + rm_sqrt(dot(l->body_force, l->body_force))
                          + rm_sqrt(dot(l->follower_force, l->follower_force));
    return a->shear_compliance * force <= RM_SHEARED;
}

static int is_good(const rm_input *input)
{
    int good = 1;
    const rm_real *loads = input->tip_force; /* the loads follow one another */
    for (int k = 0; k < 3; k++) {
        good &= is_finite(input->pressure[k]) & (input->pressure[k] >= R(0.0));
    }
    if (input->given & RM_LOADS) {
        for (int k = 0; k < 12; k++) {
            good &= is_finite(loads[k]);
        }
        for (int k = 0; k < 3; k++) {
            good &= is_finite(input->follower_moment[k]);
        }
    }
    if (input->given & RM_FOLLOWER_FORCE) {
        for (int k = 0; k < 3; k++) {
            good &= is_finite(input->follower_force[k]);
        }
    }
    if (input->given & RM_BASE) {
        const mat base = mat_of_rows(input->base_rotation);
        const vec columns[3] = {base.a, base.b, base.c};
        for (int i = 0; i < 3; i++) {
            good &= is_finite(input->base_position[i]);
            for (int k = 0; k < 3; k++) {
                good &= rm_abs(dot(columns[i], columns[k]) - (i == k ? R(1.0) : R(0.0))) < RM_ORTHOGONAL;
            }
        }
        good &= determinant(base) > R(0.0);
    }
    return good;
}

/* Return whether steps and tolerance are in range; the other options are not restricted. */
static int is_usable(const rm_options *options)
{
    return (options->steps >= 1) & (options->tolerance >= R(0.0)) & (options->tolerance <= RM_LOOSEST);
}

static int covers_pressure(const rm_domain *domain, const rm_real *p)
{
    const rm_real sum = p[0] + p[1] + p[2], most = domain->beside_max;
    int outside = 0;
    for (int k = 0; k < 3 && most > R(0.0); k++) {
        outside |= !(p[k] + domain->beside_share * (sum - p[k]) <= RM_SLACK * most);
    }
    for (int k = 0; k < 3; k++) {
        outside |= (domain->pressure_min[k] > R(0.0)) & (RM_SLACK * p[k] < domain->pressure_min[k]);
    }
    const rm_real beside = RM_SLACK * domain->single_beside;
    int alone = 0;
    for (int k = 0; k < 3; k++) {
        alone |= (domain->single_max[k] > R(0.0)) & (p[k] <= RM_SLACK * domain->single_max[k])
                 & (p[(k + 1) % 3] <= beside) & (p[(k + 2) % 3] <= beside);
    }
    const int together = (p[0] <= RM_SLACK * domain->pressure_max[0]) & (p[1] <= RM_SLACK * domain->pressure_max[1])
                         & (p[2] <= RM_SLACK * domain->pressure_max[2])
                         & (sum <= RM_SLACK * domain->pressure_sum_max) & !outside;
    return alone | together;
}

static void fill_with_nan(rm_real *p, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        p[k] = not_a_number();
    }
}

static int fail(rm_solution *solution, int result)
{
    memset(solution, 0, sizeof *solution);
    fill_with_nan(solution->tip_position, offsetof(rm_solution, result) / sizeof(rm_real));
    solution->result = result;
    return result;
}

/* Solve a valid input: set `equilibrium`, `reached` and its nodes; without loads an arc of one step. */
static void equilibrate(solve_state *at, const rm_input *input, const rm_options *options, const rm_real *start)
{
    const rm_actuator *a = &at->rod->actuator;
    const rm_domain *domain = &at->rod->domain;
    equilibrium *e = &at->equilibrium;
    reached_state *reached = &at->reached;
    at->loaded = (input->given & (RM_LOADS | RM_FOLLOWER_FORCE)) != 0;
    at->steps = at->loaded ? options->steps : 1;
    e->section = &at->section;
    e->length = a->body_length - a->stiff_tip;
    e->tip_length = a->cap_length + a->stiff_tip;
    e->shear = a->shear_compliance;
    e->unknowns = (input->given & RM_FOLLOWER_FORCE) ? 6 : 3;
    e->nearby = RM_NEARBY * rm_cbrt(options->tolerance) * at->section.law->curvature_scale;
    e->loads = at->loads = resultants_of(a, input);
    set_ends(e, a, input->pressure, at->free_curvature, &at->free);
    if (at->loaded) {
        int warm = start != NULL;
        for (int k = 0; warm && k < e->unknowns; k++) {
            warm = is_finite(start[k]);
        }
        follow(e, domain, at->free_curvature, &at->free, warm ? start : NULL, options, at->expansions, at->nodes[0],
               at->nodes[1], at->jacobians, reached);
        if (warm && !(reached->load_fraction == R(1.0) && reached->stable)) {
            const int shots = reached->shots;
            follow(e, domain, at->free_curvature, &at->free, NULL, options, at->expansions, at->nodes[0],
                   at->nodes[1], at->jacobians, reached);
            reached->shots += shots;
        }
        return;
    }
    rm_node *nodes = at->nodes[0];
    march_end *end = &reached->end;
    const vec turn = scale(e->length, at->free_curvature), way = {R(0.0), R(0.0), e->length};
    memset(reached, 0, sizeof *reached);
    memset(nodes, 0, 2 * sizeof *nodes);
    put_vec(reached->unknown, turn);
    reached->load_fraction = R(1.0);
    reached->stable = sym_is_positive(at->free.stiffness);
    reached->outcome = ARRIVED;
    reached->nodes = nodes;
    end->frame = screw_by(e->mount, turn, way, &end->position);
    end->turn = turn;
    end->section = at->free;
    end->moment_share = share_of(at->free.moment, domain);
    nodes[0].quaternion[0] = e->mount.w;
    put_vec(nodes[0].quaternion + 1, e->mount.v);
    nodes[1].quaternion[0] = end->frame.w;
    put_vec(nodes[1].quaternion + 1, end->frame.v);
    put_vec(nodes[1].position, end->position);
    put_vec(nodes[0].turn, turn);
    put_vec(nodes[1].turn, turn);
}

/* Half turns of the tangent along the nodes, or along an arc; an arc of at most a quarter turn has none. */
static rm_real count_half_turns(const solve_state *at)
{
    const vec chord = level(at->reached.end.position), ahead = {R(0.0), R(0.0), R(1.0)};
    const vec turn = at->reached.end.turn, base = out_of_body(at->equilibrium.mount, ahead);
    half_turn_count count = {chord.x * base.x + chord.y * base.y, base.z, R(0.0)};
    const rm_real forward = count.forward, up = count.up;
    if (at->loaded) {
        for (int n = 1; n <= at->steps; n++) {
            const rm_node *node = at->reached.nodes + n;
            const quat q = {node->quaternion[0], vec_of(node->quaternion + 1)};
            count_tangent(&count, chord, out_of_body(q, ahead));
        }
    } else if (dot(turn, turn) > R(0.25) * RM_PI * RM_PI) {
        const vec part = scale(R(1.0 / RM_ARC_SAMPLES), turn);
        const half_angle h = half_angle_of(dot(part, part));
        quat q = at->equilibrium.mount;
        for (int n = 0; n < RM_ARC_SAMPLES; n++) {
            q = turned(q, h, part);
            count_tangent(&count, chord, out_of_body(q, ahead));
        }
    } else {
        return R(0.0);
    }
    return half_turns(&count, forward, up);
}

/* Chamber volumes, -d/dp of the rod's energy: a quadrature over the nodes; the stiff tip, less the held length, at the
 * free curvature; the held length, at rest; and the work of the loads on base and cap, which the pressures move. With
 * that work, dV/dF is dx/dp of the tip. */
static void put_volumes(solve_state *at, const rm_real *pressure, rm_real *volume)
{
    const rm_actuator *a = &at->rod->actuator;
    const equilibrium *e = &at->equilibrium;
    const int total = at->section.total, sections = at->loaded ? at->steps + 1 : 1;
    const rm_real free = a->stiff_tip - a->held_length;
    vec curvatures = scale(free, at->free_curvature);
    memset(at->lifts, 0, (size_t)total * sizeof(rm_real));
    integral_weights(at->steps, at->weights);
    for (int n = 0; n < sections; n++) {
        const rm_real share = at->loaded ? e->length * at->weights[n] : e->length;
        const vec u = scale(R(1.0) / e->length, vec_of(at->reached.nodes[n].turn));
        add_lifts(&at->section, u, share, at->lifts);
        curvatures = along(curvatures, share, u);
    }
    if (free != R(0.0)) {
        add_lifts(&at->section, at->free_curvature, free, at->lifts);
    }
    volumes_of(&at->section, pressure, at->lifts, e->length + free, curvatures, at->features, volume);
    if (at->loaded) {
        const vec base = scale(R(1.0) / e->length, vec_of(at->reached.nodes[0].turn));
        const vec moment = linearise(&at->section, base, 0).moment;
        const vec pull = pull_of(e, at->reached.unknown);
        const vec push = into_body(at->reached.end.frame, along(pull, at->reached.load_fraction, e->loads.cap_force));
        for (int k = 0; k < 3; k++) {
            volume[k] += dot(moment, e->mount_slopes[k]) + dot(push, e->offset_slopes[k]);
        }
    }
    if (a->held_length != R(0.0)) {
        static const rm_real none[3] = {R(0.0), R(0.0), R(0.0)};
        rm_real rest[3];
        contracted still = at->section;
        /* Overwrites c phi'' and c phi''': stations and derivatives compute them anew from the offsets. */
        contract(&at->rod->law, none, 0, at->features, at->section.bend, &still);
        memset(at->lifts, 0, (size_t)total * sizeof(rm_real));
        add_lifts(&still, no_vec(), a->held_length, at->lifts);
        volumes_of(&still, none, at->lifts, a->held_length, no_vec(), at->features, rest);
        for (int k = 0; k < 3; k++) {
            volume[k] += rest[k];
        }
    }
}

/* Add two quantities that are linear between eight nodes, and constant outside them. */
static void add_between_nodes(const rm_real *nodes, rm_real at, const rm_real *first, const rm_real *second,
                              rm_real *first_sum, rm_real *second_sum)
{
    int after = 1;
    while (after < 7 && at > nodes[after]) {
        after++;
    }
    const int before = after - 1;
    const rm_real way = (at - nodes[before]) / (nodes[after] - nodes[before]);
    const rm_real share = way > R(0.0) ? (way < R(1.0) ? way : R(1.0)) : R(0.0);
    *first_sum += first[before] + share * (first[after] - first[before]);
    *second_sum += second[before] + share * (second[after] - second[before]);
}

/* Set the rod's bounds at a sum of pressures, the bending angle and the moment on the base. */
static void put_error_bound(const rm_error_bound *bound, rm_real pressure_sum, rm_solution *solution)
{
    solution->angle_error = bound->angle_per_moment * solution->base_moment;
    solution->tip_error = bound->tip_per_moment * solution->base_moment;
    add_between_nodes(bound->pressure_sum, pressure_sum, bound->angle, bound->tip, &solution->angle_error,
                      &solution->tip_error);
    add_between_nodes(bound->bending_angle, solution->bending_angle, bound->angle_by_bend, bound->tip_by_bend,
                      &solution->angle_error, &solution->tip_error);
}

/* Set pose and flags of the equilibrium reached. */
static int put_solution(solve_state *at, const rm_input *input, const rm_options *options, rm_solution *solution)
{
    static const int results[] = {RM_SUCCESSFUL, RM_UNSTABLE, RM_NOT_CONVERGED, RM_UNRESOLVED};
    const reached_state *reached = &at->reached;
    const equilibrium *e = &at->equilibrium;
    const march_end *end = &reached->end;
    vec tip = add(end->position, out_of_body(end->frame, cap_of(e)));
    mat frame = mat_of_quat(end->frame);

    put_bend(solution, frame.c, count_half_turns(at));
    solution->moment_share = rm_sqrt(end->moment_share);
    if (input->given & RM_BASE) {
        const mat base = mat_of_rows(input->base_rotation);
        tip = add(vec_of(input->base_position), mat_apply(base, tip));
        frame = mat_product(base, frame);
    }
    put_vec(solution->tip_position, tip);
    put_mat(solution->tip_rotation, frame);
    for (int k = 0; k < 6; k++) {
        solution->unknown[k] = k < e->unknowns ? reached->unknown[k] : R(0.0);
    }
    put_vec(solution->free_curvature, at->free_curvature);
    solution->load_fraction = reached->load_fraction;
    solution->load_steps = reached->load_steps;
    solution->shots = reached->shots;
    solution->steps = at->steps;
    int result = results[reached->outcome];
    if (reached->load_fraction < R(1.0) && reached->shots >= options->max_shots) {
        result = RM_TOO_MANY_SHOTS;
    } else if (reached->load_fraction < R(1.0) && result == RM_SUCCESSFUL) {
        result = RM_NOT_CONVERGED;
    }
    if (result == RM_NOT_CONVERGED && reached->load_fraction > R(0.0)) {
        /* The smallest load step finds no equilibrium nearby: the branch has a limit point here. */
        result = RM_UNSTABLE;
    }
    if (!(is_finite(tip.x) && is_finite(tip.y) && is_finite(tip.z))) {
        result = RM_NOT_CONVERGED;
    }
    solution->result = result;
    solution->stable = reached->stable;
    solution->in_domain = covers_pressure(&at->rod->domain, input->pressure) && solution->moment_share <= RM_SLACK
                          && shears_little(&at->rod->actuator, &at->loads) && e->mount.w >= RM_HALF_TURNED;
    solution->base_moment = rm_sqrt(dot(end->base_moment, end->base_moment));
    solution->angle_error = solution->tip_error = not_a_number();
    if (solution->in_domain) {
        const rm_real *p = input->pressure;
        put_error_bound(&at->rod->error_bound, p[0] + p[1] + p[2], solution);
    }
    if ((options->ask & RM_VOLUMES) == 0) {
        fill_with_nan(solution->chamber_volume, 3);
    }
    return result;
}

/* Set rate and drift of the last node, at which no step starts, for stations. */
static void complete_nodes(solve_state *at)
{
    if (at->steps > 1 || at->loaded) {
        equilibrium e = at->equilibrium;
        rm_node *last = at->reached.nodes + at->steps;
        const march_end *end = &at->reached.end;
        e.loads = scaled(&at->loads, at->reached.load_fraction);
        const vec u = scale(R(1.0) / e.length, end->turn);
        const section_state section = linearise(e.section, u, 0);
        const balanced_section here =
            balance_section(&e, R(1.0), end->frame, u, pull_of(&e, at->reached.unknown), &section);
        put_vec(last->rate, scale(e.length * e.length, here.slope));
        put_vec(last->drift, out_of_body(end->frame, here.across));
    }
}

/* If no load step succeeded, return to the rod without loads. */
static void fall_back(solve_state *at, const rm_input *input, const rm_options *options)
{
    if (at->loaded && at->reached.load_fraction == R(0.0)) {
        rm_input bare = *input;
        const reached_state failed = at->reached;
        bare.given &= RM_BASE;
        equilibrate(at, &bare, options, NULL);
        at->reached.load_fraction = R(0.0);
        at->reached.outcome = failed.outcome == ARRIVED ? DIVERGED : failed.outcome;
        at->reached.shots = failed.shots;
    }
}

/* Solve after `begin`. */
static int solve_begun(solve_state *at, const rm_input *input, const rm_options *options, const rm_real *start,
                       rm_solution *solution)
{
    if (!(is_finite(at->free_curvature.x) && is_finite(at->free_curvature.y) && is_finite(at->free_curvature.z))) {
        return fail(solution, RM_NOT_CONVERGED);
    }
    equilibrate(at, input, options, start);
    fall_back(at, input, options);
    const int result = put_solution(at, input, options, solution);
    if (options->ask & RM_VOLUMES) {
        put_volumes(at, input->pressure, solution->chamber_volume);
    }
    return result;
}

static int solve(solve_state *at, const rm_rod *rod, const rm_input *input, const rm_options *options,
                 const rm_real *start, rm_real *workspace, rm_solution *solution)
{
    if (!is_good(input) || !is_usable(options)) {
        return fail(solution, RM_BAD_INPUT);
    }
    begin(at, rod, input->pressure, options->steps, 0, options->ask & RM_VOLUMES, workspace);
    return solve_begun(at, input, options, start, solution);
}

static void copy_nodes(solve_state *at, rm_node *nodes)
{
    complete_nodes(at);
    memcpy(nodes, at->reached.nodes, ((size_t)at->steps + 1) * sizeof *nodes);
}

#endif
