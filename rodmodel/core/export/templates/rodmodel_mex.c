/* The rod for MATLAB and Octave:
 *
 *     [tip, bend, converged] = rodmodel_mex(pressure, tip_force, gravity)
 *
 * `pressure` has three gauge pressures [Pa]; `tip_force` [N] and `gravity` [m/s^2], world frame, three components each,
 * may be left out. `tip` is the position of the cap's outer face (3, 1) [m], `bend` (theta cos gamma, theta sin gamma)
 * (2, 1) [rad]; where `converged` is false they are not the equilibrium. Built by
 *
 *     mex rodmodel_mex.c rodmodel_core.c law.c                   MATLAB
 *     mkoctfile --mex rodmodel_mex.c rodmodel_core.c law.c       Octave
 */
#include "law.h"
#include "mex.h"

#define STEPS 8

static rm_real workspace[ROD_WORKSPACE_SIZE(STEPS, 0)];

static void read_three(const mxArray *from, const char *complaint, rm_real *to)
{
    if (!mxIsDouble(from) || mxIsComplex(from) || mxGetNumberOfElements(from) != 3) {
        mexErrMsgIdAndTxt("rodmodel:input", complaint);
    }
    for (int k = 0; k < 3; k++) {
        to[k] = (rm_real)mxGetPr(from)[k];
    }
}

static mxArray *column(const rm_real *numbers, int count)
{
    mxArray *found = mxCreateDoubleMatrix((mwSize)count, 1, mxREAL);
    for (int k = 0; k < count; k++) {
        mxGetPr(found)[k] = (double)numbers[k];
    }
    return found;
}

void mexFunction(int outputs, mxArray *output[], int inputs, const mxArray *given[])
{
    rm_input input = {0};
    rm_options options;
    rm_solution solution;
    if (inputs < 1 || inputs > 3 || outputs > 3) {
        mexErrMsgIdAndTxt("rodmodel:usage", "rodmodel_mex: expected (pressure, tip_force, gravity) and 3 outputs at most");
    }
    read_three(given[0], "pressure: expected three real numbers [Pa]", input.pressure);
    if (inputs > 1) {
        input.given = RM_LOADS;
        read_three(given[1], "tip_force: expected three real numbers [N]", input.tip_force);
    }
    if (inputs > 2) {
        read_three(given[2], "gravity: expected three real numbers [m/s^2]", input.gravity);
    }
    rm_default_options(&options);
    options.steps = STEPS;
    const int result = rm_solve(&rod, &input, &options, NULL, workspace, NULL, &solution);
    output[0] = column(solution.tip_position, 3);
    if (outputs > 1) {
        output[1] = column(solution.bend, 2);
    }
    if (outputs > 2) {
        output[2] = mxCreateLogicalScalar(result == RM_SUCCESSFUL);
    }
}
