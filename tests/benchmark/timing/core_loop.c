/* Times of the core's functions, call by call, inside C: what Python's call adds is left out.
 *
 * It is compiled with the core's sources in it, so that the section's sums can be timed by themselves. */
#define _POSIX_C_SOURCE 199309L
#include <time.h>

#include "rodmodel_core.c"

static double now(void)
{
    struct timespec at;
    clock_gettime(CLOCK_MONOTONIC, &at);
    return (double)at.tv_sec + 1e-9 * (double)at.tv_nsec;
}

/* Seconds of each solve of `count` inputs; from the last one's solution where `warm`. Returns how many succeed. */
int loop_solves(const rm_rod *rod, const rm_input *inputs, int count, const rm_options *options, int warm,
                int with_jacobian, rm_real *workspace, double *seconds)
{
    rm_solution solution;
    rm_jacobian jacobian;
    int good = 0, result = RM_NOT_CONVERGED;
    for (int k = 0; k < count; k++) {
        const rm_real *start = warm && result == RM_SUCCESSFUL ? solution.unknown : NULL;
        const double begun = now();
        result = with_jacobian ? rm_solve_with_jacobian(rod, inputs + k, options, start, workspace, NULL, &solution,
                                                        &jacobian, 0, NULL, NULL, NULL)
                               : rm_solve(rod, inputs + k, options, start, workspace, NULL, &solution);
        seconds[k] = now() - begun;
        good += result == RM_SUCCESSFUL;
    }
    return good;
}

/* Seconds that the law alone takes for each input: its pressures once, then so many sums over its ridges, each at a
 * curvature that waits for the sums before, as those of an integration do. Returns a sum, so that none is left out. */
double loop_sums(const rm_rod *rod, const rm_input *inputs, int count, int passes, rm_real *memory, double *seconds)
{
    double checked = 0.0;
    for (int k = 0; k < count; k++) {
        const double begun = now();
        rm_real *features = memory + (64 - (uintptr_t)memory % 64) % 64 / sizeof(rm_real);
        contracted section;
        contract(&rod->law, inputs[k].pressure, 0, features, features + aligned(3 + (size_t)rod->law.features), &section);
        vec at = section.guess;
        for (int n = 0; n < passes; n++) {
            at = along(at, R(1e-9), linearise_scaled(&section, at, 0).moment);
        }
        seconds[k] = now() - begun;
        checked += at.x;
    }
    return checked;
}
