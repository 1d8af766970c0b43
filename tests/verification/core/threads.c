/* Two threads at once, each with a workspace of its own, must find to the last bit what one finds. */
#include <pthread.h>
#include <stdio.h>
#include <string.h>

#include "law.h"

#define STEPS 8
#define ROWS 200
#define THREADS 2

typedef struct {
    rm_real workspace[ROD_WORKSPACE_SIZE(STEPS, 1)];
    rm_solution solutions[ROWS];
    rm_jacobian jacobians[ROWS];
    rm_inverse_result found;
} task;

static task tasks[1 + THREADS];

static void *work(void *of)
{
    task *mine = of;
    rm_options options;
    rm_target target = {{(rm_real)-0.01, (rm_real)0.002, (rm_real)0.064}, 0, 0};
    rm_input input;
    rm_default_options(&options);
    options.ask = RM_VOLUMES;
    memset(&input, 0, sizeof input);
    input.given = RM_LOADS | RM_FOLLOWER_FORCE;
    for (int row = 0; row < ROWS; row++) {
        input.pressure[row % 3] = (rm_real)(100 * row);
        input.tip_force[0] = (rm_real)(1e-5 * row);
        input.follower_force[1] = (rm_real)(-1e-5 * row);
        rm_solve_with_jacobian(&rod, &input, &options, row ? mine->solutions[row - 1].unknown : NULL, mine->workspace,
                               NULL, mine->solutions + row, mine->jacobians + row, 0, NULL, NULL, NULL);
    }
    rm_inverse(&rod, &target, &input, &options, mine->workspace, &mine->found);
    return NULL;
}

int main(void)
{
    pthread_t threads[THREADS];
    int differ = 0, good = 0;
    work(tasks);
    for (int k = 0; k < THREADS; k++) {
        if (pthread_create(threads + k, NULL, work, tasks + 1 + k) != 0) {
            return 2;
        }
    }
    for (int k = 0; k < THREADS; k++) {
        pthread_join(threads[k], NULL);
        differ += memcmp(tasks->solutions, tasks[1 + k].solutions, sizeof tasks->solutions) != 0;
        differ += memcmp(tasks->jacobians, tasks[1 + k].jacobians, sizeof tasks->jacobians) != 0;
        differ += memcmp(&tasks->found, &tasks[1 + k].found, sizeof tasks->found) != 0;
    }
    for (int row = 0; row < ROWS; row++) {
        good += tasks->solutions[row].result == RM_SUCCESSFUL;
    }
    printf("good %d\ndiffer %d\n", good, differ);
    return differ != 0;
}
