/* Stack that the functions of the core take on a microcontroller, by painting it: bytes below the caller. And the bytes
 * of their workspace. */
#include <stdint.h>
#include <stdio.h>

#include "law.h"

#define STEPS 8
#define PAINT 0xA5A5A5A5u

extern uint32_t stack_limit[];

static rm_real workspace[ROD_WORKSPACE_SIZE(STEPS, 1)];
static rm_input input;
static rm_options options;
static rm_solution solution;
static rm_jacobian jacobian;
static rm_inverse_result found;
static rm_target target;
static int good = 1;

static void solve_free(void)
{
    input.given = 0;
    good &= rm_solve(&rod, &input, &options, NULL, workspace, NULL, &solution) == RM_SUCCESSFUL;
}

static void solve_loaded(void)
{
    input.given = RM_LOADS;
    good &= rm_solve(&rod, &input, &options, NULL, workspace, NULL, &solution) == RM_SUCCESSFUL;
}

static void differentiate(void)
{
    good &= rm_solve_with_jacobian(&rod, &input, &options, NULL, workspace, NULL, &solution, &jacobian, 0, NULL, NULL,
                                   NULL) == RM_SUCCESSFUL;
}

static void invert(void)
{
    target.point[0] = solution.tip_position[0];
    target.point[1] = solution.tip_position[1];
    target.point[2] = solution.tip_position[2];
    good &= rm_inverse(&rod, &target, &input, &options, workspace, &found) == RM_SUCCESSFUL && found.reached;
}

static unsigned long depth(void (*call)(void))
{
    /* Volatile: a loop that becomes a call of memset would paint over that call's own frame. */
    volatile uint32_t *const low = stack_limit, *high, *p;
    __asm__ volatile("mov %0, sp" : "=r"(high));
    for (p = low; p < high; p++) {
        *p = PAINT;
    }
    call();
    for (p = low; p < high && *p == PAINT; p++) {
    }
    return (unsigned long)((char *)high - (char *)p);
}

int main(void)
{
    rm_default_options(&options);
    options.steps = STEPS;
    input.pressure[0] = (rm_real)20e3;
    input.pressure[1] = (rm_real)5e3;
    input.tip_force[1] = (rm_real)2e-3;
    input.gravity[2] = (rm_real)9.81;
    printf("stack_free %lu\n", depth(solve_free));
    printf("stack_loaded %lu\n", depth(solve_loaded));
    printf("stack_jacobian %lu\n", depth(differentiate));
    printf("stack_inverse %lu\n", depth(invert));
    printf("workspace_solve %lu\n", (unsigned long)(ROD_WORKSPACE_SIZE(STEPS, 0) * sizeof(rm_real)));
    printf("workspace_jacobian %lu\n", (unsigned long)sizeof workspace);
    printf("good %d\n", good);
    return !good;
}
