/* How the rod is called: predict, follow a path, differentiate, invert. Numbers are printed in SI with all their digits;
 * the exit status is 0 where everything succeeded. */
#include <stdio.h>

#include "law.h"

#define STEPS 8
#define PATH 20
#define CYCLE 28

/* Which give a number back as it was. */
#ifdef RM_REAL_FLOAT
#define DIGITS 9
#else
#define DIGITS 17
#endif

/* Nothing is allocated: what a solve needs lies here. */
static rm_real workspace[ROD_WORKSPACE_SIZE(STEPS, 1)];
static int failures = 0;

static void print_numbers(const char *name, const rm_real *numbers, int count)
{
    printf("%s", name);
    for (int k = 0; k < count; k++) {
        printf(" %.*g", DIGITS, (double)numbers[k]);
    }
    printf("\n");
}

static void expect(int good, const char *what)
{
    if (!good) {
        printf("failed: %s\n", what);
        failures++;
    }
}

/* Pressures as parts of the largest ones; all three at once stay in the domain too. */
static void set_pressure(rm_input *input, rm_real first, rm_real second, rm_real third)
{
    const rm_domain *domain = &rod.domain;
    const rm_real parts[3] = {first, second, third}, third_of_sum = domain->pressure_sum_max / 3;
    const rm_real beside = domain->beside_max / (1 + 2 * domain->beside_share);
    const rm_real alike = domain->beside_max > 0 && beside < third_of_sum ? beside : third_of_sum;
    for (int k = 0; k < 3; k++) {
        const rm_real most = domain->pressure_max[k];
        input->pressure[k] = parts[k] * (most < alike ? most : alike);
    }
}

static void set_loads(rm_input *input)
{
    input->given |= RM_LOADS;
    input->tip_force[1] = (rm_real)2e-3; /* 2 mN along y */
    input->gravity[2] = (rm_real)9.81;   /* hanging: the rod points along +z, and down is +z here */
}

static void print_solution(const char *name, const rm_input *input, const rm_solution *solution)
{
    rm_real numbers[9];
    for (int k = 0; k < 3; k++) {
        numbers[k] = input->pressure[k];
        numbers[3 + k] = solution->tip_position[k];
    }
    numbers[6] = solution->bending_angle;
    numbers[7] = solution->bending_plane;
    numbers[8] = (rm_real)solution->in_domain;
    print_numbers(name, numbers, 9);
}

static void predict(const rm_options *options)
{
    static const double parts[3][3] = {{0.0, 0.0, 0.0}, {0.7, 0.2, 0.0}, {0.1, 0.0, 0.6}};
    rm_solution solution;
    for (int loaded = 0; loaded < 2; loaded++) {
        for (int k = 0; k < 3; k++) {
            rm_input input = {0};
            set_pressure(&input, (rm_real)parts[k][0], (rm_real)parts[k][1], (rm_real)parts[k][2]);
            if (loaded) {
                set_loads(&input);
            }
            expect(rm_solve(&rod, &input, options, NULL, workspace, NULL, &solution) == RM_SUCCESSFUL, "predict");
            print_solution("predict", &input, &solution);
        }
    }
}

/* As a control loop does: each solve starts from the last one. */
static void follow_path(const rm_options *options)
{
    rm_input input = {0};
    rm_solution solution;
    set_loads(&input);
    for (int n = 0; n <= PATH; n++) {
        const rm_real part = (rm_real)n / (rm_real)PATH;
        set_pressure(&input, (rm_real)0.6 * part, (rm_real)0.3 * part, 0);
        const rm_real *start = n > 0 ? solution.unknown : NULL;
        expect(rm_solve(&rod, &input, options, start, workspace, NULL, &solution) == RM_SUCCESSFUL, "path");
    }
    print_solution("path", &input, &solution);
}

static void differentiate(const rm_options *options)
{
    rm_input input = {0};
    rm_solution solution;
    rm_jacobian jacobian;
    set_pressure(&input, (rm_real)0.5, (rm_real)0.2, 0);
    set_loads(&input);
    expect(rm_solve_with_jacobian(&rod, &input, options, NULL, workspace, NULL, &solution, &jacobian, 0, NULL, NULL,
                                  NULL) == RM_SUCCESSFUL, "jacobian");
    for (int row = 0; row < 3; row++) {
        /* By the three pressures [m/Pa] and the components of the tip force [m/N]. */
        print_numbers("jacobian", jacobian.position + 12 * row, 6);
    }
}

static void invert(const rm_options *options)
{
    rm_input input = {0};
    rm_solution solution;
    rm_target target = {{0, 0, 0}, 0, 0};
    rm_inverse_result result;
    set_pressure(&input, (rm_real)0.5, (rm_real)0.2, 0);
    set_loads(&input);
    expect(rm_solve(&rod, &input, options, NULL, workspace, NULL, &solution) == RM_SUCCESSFUL, "target");
    for (int k = 0; k < 3; k++) {
        target.point[k] = solution.tip_position[k];
    }
    expect(rm_inverse(&rod, &target, &input, options, workspace, &result) == RM_SUCCESSFUL && result.reached,
           "inverse");
    for (int k = 0; k < 3; k++) {
        input.pressure[k] = result.pressure[k];
    }
    print_solution("inverse", &input, &result.solution);
}

#ifdef ROD_ORIENT_SIZE
/* The rod at other orientations of the winding. */
static void turn_winding(const rm_options *options)
{
    static rm_real memory[ROD_ORIENT_SIZE];
    rm_rod turned;
    rm_input input = {0};
    rm_solution solution;
    set_pressure(&input, (rm_real)0.7, (rm_real)0.2, 0);
    for (int k = 0; k < 3; k++) {
        rod_at_psi((rm_real)ROD_PSI + (rm_real)0.1 * (rm_real)k, memory, &turned);
        expect(rm_solve(&turned, &input, options, NULL, workspace, NULL, &solution) == RM_SUCCESSFUL, "psi");
        print_solution("psi", &input, &solution);
    }
}
#endif

#ifdef ROD_BRANCHES
/* One chamber up to the end of its snapped branch and back: the number of the branch is all the memory that is needed. */
static void cycle(const rm_options *options)
{
    const rm_rod *last = branches.rods[branches.count - 1];
    const int chamber = branches.chambers[branches.count - 1] - 1;
    int branch = 0;
    for (int n = 0; n <= CYCLE; n++) {
        const int up = n <= CYCLE / 2 ? n : CYCLE - n;
        rm_input input = {0};
        rm_solution solution;
        input.pressure[chamber] = last->domain.pressure_max[chamber] * (rm_real)up / (rm_real)(CYCLE / 2);
        branch = rm_branch_at(&branches, input.pressure, branch);
        expect(rm_solve(branches.rods[branch], &input, options, NULL, workspace, NULL, &solution) == RM_SUCCESSFUL,
               "cycle");
        print_solution("cycle", &input, &solution);
    }
}
#endif

int main(void)
{
    rm_options options;
    rm_default_options(&options);
    options.steps = STEPS;
    expect(rm_check_rod(&rod) == 0, "the rod's numbers");
    expect(rm_workspace_size(&rod, STEPS, 1) == ROD_WORKSPACE_SIZE(STEPS, 1), "the workspace's size");
    printf("# name, pressures [Pa], tip x y z [m], bending angle and plane [rad], in_domain\n");
    predict(&options);
    follow_path(&options);
    differentiate(&options);
    invert(&options);
#ifdef ROD_ORIENT_SIZE
    turn_winding(&options);
#endif
#ifdef ROD_BRANCHES
    cycle(&options);
#endif
    printf("failures %d\n", failures);
    return failures != 0;
}
