/* Inputs that nobody should give: random ones, and among them NaN, infinities, denormals, huge numbers, sizes of zero,
 * flags of no meaning, base rotations that are none. Every failure must be flagged, no successful solution may hold a
 * NaN, and no sanitizer may have anything to say. Arguments: how many cases, and the seed. Workspaces and nodes are
 * allocated to the number, so that one step beyond is seen. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "law.h"

#define MOST_STEPS 9

static uint64_t state;

static uint64_t next(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
}

static int pick(int count)
{
    return (int)(next() % (uint64_t)count);
}

static rm_real uniform(double from, double to)
{
    return (rm_real)(from + (to - from) * (double)(next() >> 11) / 9007199254740992.0);
}

static rm_real hostile(void)
{
    static const double values[] = {0.0,  -0.0, 1.0,   -1.0,  1e-3, -1e-3, 1e3,  -1e3,  1e6, -1e6,
                                    1e12, 1e20, -1e20, 1e37, 3e38, -3e38, 1e-20, 1e-38, 1e-45};
    const int count = (int)(sizeof values / sizeof *values), k = pick(count + 6);
    switch (k - count) {
    case 0: return (rm_real)NAN;
    case 1: return (rm_real)INFINITY;
    case 2: return -(rm_real)INFINITY;
#ifndef RM_REAL_FLOAT
    case 3: return 1e290;
    case 4: return -1.7e308;
    case 5: return 5e-324;
#else
    case 3: case 4: case 5: return (rm_real)3.4e38;
#endif
    default: return (rm_real)values[k];
    }
}

/* Plausible numbers up to a size, or now and then hostile ones. */
static void fill(rm_real *p, int count, double least, double most, int one_in)
{
    for (int k = 0; k < count; k++) {
        p[k] = pick(one_in) == 0 ? hostile() : uniform(least, most);
    }
}

static void turn(rm_real *rows)
{
    rm_real q[4], n = 0;
    fill(q, 4, -1.0, 1.0, 1 << 30);
    for (int k = 0; k < 4; k++) {
        n += q[k] * q[k];
    }
    const rm_real s = 2 / n, w = q[0], x = q[1], y = q[2], z = q[3];
    const rm_real found[9] = {1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
                              s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x),
                              s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)};
    memcpy(rows, found, sizeof found);
}

static rm_input any_input(void)
{
    rm_input input;
    const int one_in = pick(3) == 0 ? 3 : (pick(2) ? 30 : 1 << 30);
    const double large = pick(4) == 0 ? 100.0 : 1.0;
    fill(input.pressure, 3, pick(20) == 0 ? -1e4 : 0.0, 6e4 * (pick(10) == 0 ? 20.0 : 1.0), one_in);
    fill(input.tip_force, 3, -0.05 * large, 0.05 * large, one_in);
    fill(input.tip_moment, 3, -1e-3 * large, 1e-3 * large, one_in);
    fill(input.gravity, 3, -10.0 * large, 10.0 * large, one_in);
    fill(input.distributed_force, 3, -0.5 * large, 0.5 * large, one_in);
    fill(input.follower_force, 3, -0.05 * large, 0.05 * large, one_in);
    fill(input.follower_moment, 3, -1e-3 * large, 1e-3 * large, one_in);
    fill(input.base_position, 3, -1.0, 1.0, one_in);
    turn(input.base_rotation);
    if (pick(4) == 0) {
        input.base_rotation[pick(9)] = hostile();
    }
    input.given = pick(4) == 0 ? (int)(next() & 0x7fffffff) - 0x40000000 : pick(8);
    input.reserved = pick(2) ? -1 : 0;
    return input;
}

static rm_options any_options(void)
{
    static const int steps[] = {0, -1, -1000000, 1, 2, 3, 4, 5, 8, MOST_STEPS};
    static const int shots[] = {-1, 0, 1, 2, 3, 20, 512};
    rm_options options;
    rm_default_options(&options);
    options.steps = pick(3) ? 3 + pick(MOST_STEPS - 2) : steps[pick(10)];
    options.max_shots = pick(2) ? 512 : shots[pick(7)];
    options.tolerance = pick(2) ? options.tolerance : hostile();
    options.ask = pick(4) ? pick(2) : (int)(next() & 0x7fffffff);
    return options;
}

static long failures = 0;

static void fail(const char *what, long row)
{
    printf("failed: %s, case %ld\n", what, row);
    failures++;
}

/* Larger numbers count as infinite in the core. */
#ifdef RM_REAL_FLOAT
#define MOST ((rm_real)1e30)
#else
#define MOST 1e300
#endif

static int all_finite(const rm_real *p, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        if (!(p[k] >= -MOST && p[k] <= MOST)) {
            return 0;
        }
    }
    return 1;
}

/* Numbers but the volumes, which may not have been asked for, and the error, which is NaN outside the domain. */
static void check_solution(const rm_solution *s, int returned, long row)
{
    const int sound = all_finite(s->tip_position, 3) && all_finite(s->tip_rotation, 9) && all_finite(s->bend, 2)
                      && all_finite(&s->bending_angle, 1) && all_finite(&s->bending_plane, 1) && all_finite(s->unknown, 6)
                      && all_finite(s->free_curvature, 3) && s->moment_share >= 0;
    if (returned != s->result || returned < RM_SUCCESSFUL || returned > RM_TOO_MANY_SHOTS) {
        fail("what is returned is not the result", row);
    }
    if (returned == RM_SUCCESSFUL && !(sound && s->load_fraction == 1)) {
        fail("a successful solution holds a NaN, or not the full load", row);
    }
    if (s->in_domain && s->angle_error != s->angle_error) {
        fail("a solution in the domain has no error", row);
    }
}

static int must_be_bad(const rm_input *input, const rm_options *options)
{
    int bad = options->steps < 1 || !(options->tolerance >= 0 && options->tolerance <= (rm_real)1e-2);
    for (int k = 0; k < 3; k++) {
        bad |= !(input->pressure[k] >= 0 && all_finite(input->pressure + k, 1));
    }
    if (input->given & RM_LOADS) {
        bad |= !all_finite(input->tip_force, 12) || !all_finite(input->follower_moment, 3);
    }
    if (input->given & RM_FOLLOWER_FORCE) {
        bad |= !all_finite(input->follower_force, 3);
    }
    if (input->given & RM_BASE) {
        bad |= !all_finite(input->base_position, 3) || !all_finite(input->base_rotation, 9);
    }
    return bad;
}

static void *room(size_t size)
{
    void *p = malloc(size ? size : 1);
    if (p == NULL) {
        abort();
    }
    return p;
}

/* With numbers of no actuator, which overflow where a calibration's do not. */
static rm_rod changed;

static void try_solve(const rm_rod *of, long row)
{
    const rm_input input = any_input();
    const rm_options options = any_options();
    const int steps = options.steps < 1 ? 1 : options.steps, jacobian_too = pick(3) == 0;
    rm_real *workspace = room(sizeof *workspace * rm_workspace_size(of, steps, jacobian_too));
    rm_node *nodes = pick(2) ? room(sizeof *nodes * ((size_t)steps + 1)) : NULL;
    const int count = nodes ? pick(4) : 0;
    rm_real start[6], lengths[4], positions[4 * 36], turns[4 * 36], curvatures[12];
    rm_solution solution;
    rm_jacobian jacobian;
    int result;
    fill(start, 6, -2.0, 2.0, 10);
    fill(lengths, 4, -0.01, 0.08, 10);
    memset(&solution, 0x55, sizeof solution);
    if (jacobian_too) {
        result = rm_solve_with_jacobian(of, &input, &options, pick(2) ? start : NULL, workspace, nodes, &solution,
                                        &jacobian, count, lengths, positions, turns);
        if (result == RM_SUCCESSFUL && of != &changed && !all_finite(jacobian.position, 36 + 36 + 24)) {
            fail("the Jacobian of a successful solution holds a NaN", row);
        }
    } else {
        result = rm_solve(of, &input, &options, pick(2) ? start : NULL, workspace, nodes, &solution);
    }
    check_solution(&solution, result, row);
    if (must_be_bad(&input, &options) != (result == RM_BAD_INPUT) && !(input.given & RM_BASE)) {
        fail("a bad input is not called one, or a good one is", row);
    }
    if (nodes != NULL && all_finite(solution.tip_position, 1)) {
        rm_stations(of, &input, &solution, nodes, 4, lengths, positions, turns, curvatures);
        if (result == RM_SUCCESSFUL && of != &changed && lengths[0] >= 0 && lengths[0] < of->actuator.body_length
            && !(all_finite(positions, 3) && all_finite(turns, 9) && all_finite(curvatures, 3))) {
            fail("a station of a successful solution holds a NaN", row);
        }
    }
    free(nodes);
    free(workspace);
}

static void try_section(const rm_rod *of, long row)
{
    rm_real *workspace = room(sizeof *workspace * rm_workspace_size(of, 1, 0));
    rm_real pressure[3], curvature[3];
    rm_section section;
    fill(pressure, 3, 0.0, 6e4, 4);
    fill(curvature, 3, -60.0, 60.0, 4);
    if (rm_section_at(of, curvature, pressure, workspace, &section) == 0
        && !(all_finite(section.moment, 3) && all_finite(section.stiffness, 9) && all_finite(section.volume, 3))) {
        fail("a section that is said to be good holds a NaN", row);
    }
    if (rm_free_curvature(of, pressure, workspace, curvature) == 0 && !all_finite(curvature, 3)) {
        fail("a free curvature that is said to be good holds a NaN", row);
    }
    free(workspace);
}

static void try_inverse(const rm_rod *of, long row)
{
    const rm_input input = any_input();
    rm_options options = any_options();
    const int steps = options.steps < 1 ? 1 : options.steps;
    rm_real *workspace = room(sizeof *workspace * rm_workspace_size(of, steps, 1));
    rm_target target;
    rm_inverse_result found;
    memset(&found, 0x55, sizeof found);
    fill(target.point, 3, -0.05, 0.06, 8);
    target.is_bend = pick(3) == 0 ? pick(100) - 50 : 0;
    target.reserved = 0;
    const int result = rm_inverse(of, &target, &input, &options, workspace, &found);
    check_solution(&found.solution, result, row);
    if ((found.reached || found.nearest) && !(result == RM_SUCCESSFUL && all_finite(found.pressure, 4))) {
        fail("an inverse is said to be reached without an answer", row);
    }
    free(workspace);
}

/* Rods whose numbers are not those of a calibration: refused, or safe to solve. */
static void try_rod(long row)
{
    static const int sizes[] = {-8, -1, 0, 7, 12, 1 << 20, 1 << 30};
    changed = rod;
    rm_law *law = &changed.law;
    rm_real *const scalars[] = {&law->pressure_scale, &law->curvature_scale, &law->energy_scale, &law->rest_volume,
                                &law->constant, law->slope + pick(3), law->quadratic + pick(6),
                                law->slope_by_pressure + pick(9), law->pressure_quadratic + pick(9),
                                &changed.actuator.body_length + pick(12), &changed.domain.pressure_max[0] + pick(6),
                                changed.error_bound.angle + pick(8), changed.error_bound.pressure_sum + pick(8),
                                changed.error_bound.tip_by_bend + pick(8), changed.error_bound.bending_angle + pick(8)};
    if (pick(4) == 0) {
        int *const which[] = {&law->images, &law->ridges, &law->features};
        int *const size = which[pick(3)];
        const int before = *size;
        *size = sizes[pick(7)];
        if (rm_check_rod(&changed) == 0 && *size > before) {
            fail("more ridges or features than a law may have", row);
        }
        if (*size > before || rm_check_rod(&changed) != 0) {
            return;
        }
    } else {
        *scalars[pick(15)] = hostile();
    }
    if (rm_check_rod(&changed) == 0) {
        for (int k = 0; k < 3; k++) {
            if (!(changed.domain.pressure_max[k] >= 0 && changed.domain.pressure_sum_max > 0)) {
                fail("a domain without pressures is taken for one", row);
            }
        }
        try_solve(&changed, row);
    }
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        return 2;
    }
    const long count = atol(argv[1]);
    state = (uint64_t)atol(argv[2]) * 2654435769u + 88172645463325252u;
    rm_options options;
    rm_default_options(&options);
    if (rm_solve_batch(&rod, NULL, 0, &options, NULL, NULL) != 0
        || rm_inverse_batch(&rod, NULL, NULL, 0, 0, &options, NULL, NULL) != 0) {
        fail("nothing asked for, something found", -1);
    }
    for (long row = 0; row < count; row++) {
        try_solve(&rod, row);
        try_rod(row);
        if (row % 4 == 0) {
            try_section(&rod, row);
        }
        if (row % 200 == 0) {
            try_inverse(&rod, row);
        }
#ifdef ROD_ORIENT_SIZE
        rm_real *memory = room(sizeof *memory * ROD_ORIENT_SIZE);
        rm_rod turned;
        rod_at_psi(pick(2) ? uniform(-10.0, 10.0) : hostile(), memory, &turned);
        try_solve(&turned, row);
        free(memory);
#endif
    }
    printf("%ld cases, %ld failures\n", count, failures);
    return failures != 0;
}
