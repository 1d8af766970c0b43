/* The branch that an actuator is on. */
#ifndef RM_BRANCHES_H
#define RM_BRANCHES_H

#include "solve.h"

static int goes_on(const rm_branches *branches, int branch, const rm_real *pressure)
{
    return covers_pressure(&branches->rods[branch]->domain, pressure);
}

/* The loading branch has a state wherever it can; else the snapped branch of the chamber with the largest pressure. */
static int jump(const rm_branches *branches, const rm_real *pressure, int before)
{
    int to = before;
    rm_real most = R(-1.0);
    if (goes_on(branches, 0, pressure)) {
        return 0;
    }
    for (int k = 1; k < branches->count; k++) {
        const rm_real high = pressure[branches->chambers[k] - 1];
        if (high > most && goes_on(branches, k, pressure)) {
            most = high;
            to = k;
        }
    }
    return to;
}

static int branch_at(const rm_branches *branches, const rm_real *pressure, int before)
{
    if (before < 0 || before >= branches->count) {
        before = 0;
    }
    return goes_on(branches, before, pressure) ? before : jump(branches, pressure, before);
}

static int is_other_possible(const rm_branches *branches, const rm_real *pressure, int branch)
{
    int found = branch > 0 && goes_on(branches, 0, pressure);
    for (int k = 1; k < branches->count && branch == 0 && !found; k++) {
        found = goes_on(branches, k, pressure);
    }
    return found;
}

#endif
