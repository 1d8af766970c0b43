/* The functions of rodmodel_core.h, in one translation unit, so that a compiler can inline the loops.
 *
 * RM_VARIANT, if defined, is a suffix of every public name: variants for several instruction sets in one program. */
#ifdef RM_VARIANT
#define RM_JOINED(name, variant) name##variant
#define RM_NAMED(name, variant) RM_JOINED(name, variant)
#define rm_workspace_size RM_NAMED(rm_workspace_size, RM_VARIANT)
#define rm_check_rod RM_NAMED(rm_check_rod, RM_VARIANT)
#define rm_default_options RM_NAMED(rm_default_options, RM_VARIANT)
#define rm_orient_size RM_NAMED(rm_orient_size, RM_VARIANT)
#define rm_orient RM_NAMED(rm_orient, RM_VARIANT)
#define rm_solve RM_NAMED(rm_solve, RM_VARIANT)
#define rm_solve_batch RM_NAMED(rm_solve_batch, RM_VARIANT)
#define rm_solve_with_jacobian RM_NAMED(rm_solve_with_jacobian, RM_VARIANT)
#define rm_stations RM_NAMED(rm_stations, RM_VARIANT)
#define rm_free_curvature RM_NAMED(rm_free_curvature, RM_VARIANT)
#define rm_section_at RM_NAMED(rm_section_at, RM_VARIANT)
#define rm_inverse RM_NAMED(rm_inverse, RM_VARIANT)
#define rm_inverse_batch RM_NAMED(rm_inverse_batch, RM_VARIANT)
#define rm_branch_at RM_NAMED(rm_branch_at, RM_VARIANT)
#define rm_other_branch_possible RM_NAMED(rm_other_branch_possible, RM_VARIANT)
#endif

#include "rodmodel_core.h"

#include "branches.h"
#include "inverse.h"
#include "orient.h"
#include "stations.h"

size_t rm_workspace_size(const rm_rod *rod, int steps, int with_jacobian)
{
    return workspace_size(rod, steps, with_jacobian);
}

void rm_default_options(rm_options *options)
{
    memset(options, 0, sizeof *options);
    options->steps = 8;
    options->max_shots = 512;
#ifdef RM_REAL_FLOAT
    options->tolerance = R(1e-5);
#else
    options->tolerance = R(1e-10);
#endif
}

size_t rm_orient_size(const rm_oriented *oriented)
{
    return 2 * (size_t)oriented->law.images * (size_t)oriented->law.features;
}

void rm_orient(const rm_oriented *oriented, rm_real psi, rm_real *memory, rm_law *law)
{
    orient(oriented, psi, memory, law);
}

int rm_solve(const rm_rod *rod, const rm_input *input, const rm_options *options, const rm_real *start,
             rm_real *workspace, rm_node *nodes, rm_solution *solution)
{
    solve_state at;
    const int result = solve(&at, rod, input, options, start, workspace, solution);
    if (nodes != NULL && is_finite(solution->tip_position[0])) {
        copy_nodes(&at, nodes);
    }
    return result;
}

int rm_solve_with_jacobian(const rm_rod *rod, const rm_input *input, const rm_options *options,
                           const rm_real *start, rm_real *workspace, rm_node *nodes, rm_solution *solution,
                           rm_jacobian *jacobian, int count, const rm_real *arc_lengths, rm_real *positions,
                           rm_real *turns)
{
    solve_state at;
    const int result = solve_with_jacobian(&at, rod, input, options, start, workspace, solution, jacobian, count,
                                           arc_lengths, positions, turns);
    if (nodes != NULL && is_finite(solution->tip_position[0])) {
        copy_nodes(&at, nodes);
    }
    return result;
}

void rm_stations(const rm_rod *rod, const rm_input *input, const rm_solution *solution, const rm_node *nodes,
                 int count, const rm_real *arc_lengths, rm_real *positions, rm_real *rotations,
                 rm_real *curvatures)
{
    put_stations(rod, input, solution, nodes, count, arc_lengths, positions, rotations, curvatures);
}

int rm_solve_batch(const rm_rod *rod, const rm_input *inputs, int count, const rm_options *options,
                   rm_real *workspace, rm_solution *solutions)
{
    int good = 0;
    for (int row = 0; row < count; row++) {
        good += rm_solve(rod, inputs + row, options, NULL, workspace, NULL, solutions + row) == RM_SUCCESSFUL;
    }
    return good;
}

int rm_free_curvature(const rm_rod *rod, const rm_real *pressure, rm_real *workspace, rm_real *curvature)
{
    solve_state at;
    begin(&at, rod, pressure, 1, 0, 0, workspace);
    put_vec(curvature, at.free_curvature);
    return is_finite(curvature[0]) ? 0 : RM_BAD_INPUT;
}

int rm_section_at(const rm_rod *rod, const rm_real *curvature, const rm_real *pressure, rm_real *workspace,
                  rm_section *section)
{
    solve_state at;
    const vec u = vec_of(curvature);
    begin(&at, rod, pressure, 1, 0, 0, workspace);
    const section_state s = linearise(&at.section, u, 0);
    const sym k = s.stiffness;
    const rm_real rows[9] = {k.xx, k.xy, k.xz, k.xy, k.yy, k.yz, k.xz, k.yz, k.zz};
    const rm_real *q = rod->law.quadratic;
    const sym a = {q[0], q[1], q[2], q[3], q[4], q[5]};
    const vec x = scale(R(1.0) / rod->law.curvature_scale, u);
    memcpy(section->stiffness, rows, sizeof rows);
    put_vec(section->moment, s.moment);
    section->energy = rod->law.energy_scale
                      * (at.section.constant + dot(at.section.slope, x) + R(0.5) * dot(x, sym_apply(a, x))
                         + ridge_energy(&at.section, x));
    memset(at.lifts, 0, (size_t)at.section.total * sizeof(rm_real));
    add_lifts(&at.section, u, R(1.0), at.lifts);
    volumes_of(&at.section, pressure, at.lifts, R(1.0), u, at.features, section->volume);
    return is_finite(section->energy) ? 0 : RM_BAD_INPUT;
}

int rm_inverse(const rm_rod *rod, const rm_target *target, const rm_input *input, const rm_options *options,
               rm_real *workspace, rm_inverse_result *result)
{
    return find_pressures(rod, target, input, options, workspace, result);
}

int rm_inverse_batch(const rm_rod *rod, const rm_target *targets, const rm_input *inputs, int inputs_each,
                     int count, const rm_options *options, rm_real *workspace, rm_inverse_result *results)
{
    int reached = 0;
    for (int row = 0; row < count; row++) {
        rm_inverse(rod, targets + row, inputs + (inputs_each ? row : 0), options, workspace, results + row);
        reached += results[row].reached;
    }
    return reached;
}

/* Limits that keep sizes within an int, and a workspace within a few megabytes. */
#define RM_MOST_RIDGES 65536
#define RM_MOST_FEATURES 4096

int rm_check_rod(const rm_rod *rod)
{
    const rm_law *law = &rod->law;
    const rm_actuator *a = &rod->actuator;
    const rm_domain *domain = &rod->domain;
    const rm_real positive[] = {law->pressure_scale, law->curvature_scale, law->energy_scale,
                                a->body_length,      a->body_length - a->stiff_tip, a->tip_offset_curvature,
                                domain->moment_max,  domain->torque_max,           domain->pressure_sum_max};
    const rm_real finite[] = {law->rest_volume, law->constant,  a->cap_length,       a->mass_per_length,
                              a->cap_mass,      a->base_turn,   a->base_lag,         a->base_stiffness,
                              a->base_growth,   a->tip_offset,  a->tip_draw,         a->held_length,
                              a->shear_compliance};
    int good = law->images >= 1 && law->images <= RM_MOST_IMAGES && law->ridges >= 0 && law->ridges % 8 == 0
               && law->ridges <= RM_MOST_RIDGES / RM_MOST_IMAGES && law->features >= 0
               && law->features <= RM_MOST_FEATURES;
    for (size_t k = 0; k < sizeof positive / sizeof *positive; k++) {
        good &= is_finite(positive[k]) & (positive[k] > R(0.0));
    }
    for (size_t k = 0; k < sizeof finite / sizeof *finite; k++) {
        good &= is_finite(finite[k]);
    }
    good &= is_finite(domain->beside_share) & (domain->beside_share >= R(0.0));
    good &= is_finite(domain->beside_max) & (domain->beside_max >= R(0.0));
    good &= is_finite(domain->single_beside);
    for (int k = 0; k < 3; k++) {
        good &= is_finite(domain->pressure_max[k]) & (domain->pressure_max[k] >= R(0.0));
        good &= is_finite(domain->pressure_min[k]) & is_finite(domain->single_max[k]);
    }
    for (int k = 0; k < 8; k++) {
        const rm_error_bound *bound = &rod->error_bound;
        good &= is_finite(bound->angle[k]) & is_finite(bound->pressure_sum[k]);
        good &= is_finite(bound->angle_by_bend[k]) & is_finite(bound->tip_by_bend[k]);
        good &= is_finite(bound->bending_angle[k]);
        good &= k == 0 || (bound->pressure_sum[k] > bound->pressure_sum[k - 1]
                           && bound->bending_angle[k] > bound->bending_angle[k - 1]);
    }
    for (int k = 0; good && k < 3 * law->images; k++) {
        good &= law->orders[k] >= 0 && law->orders[k] < 3;
    }
    return good ? 0 : RM_BAD_INPUT;
}

int rm_branch_at(const rm_branches *branches, const rm_real *pressure, int before)
{
    return branch_at(branches, pressure, before);
}

int rm_other_branch_possible(const rm_branches *branches, const rm_real *pressure, int branch)
{
    return is_other_possible(branches, pressure, branch);
}
