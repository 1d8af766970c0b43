/* The workspace's size as law.h's constant and as the function says it: steps, with a Jacobian, one, the other. */
#include <stdio.h>

#include "law.h"

/* A constant that is none would not compile. */
static rm_real workspace[ROD_WORKSPACE_SIZE(8, 1)];

int main(void)
{
    for (int steps = 1; steps <= 33; steps++) {
        for (int jacobian = 0; jacobian < 2; jacobian++) {
            printf("size %d %d %lu %lu\n", steps, jacobian, (unsigned long)ROD_WORKSPACE_SIZE((size_t)steps, jacobian),
                   (unsigned long)rm_workspace_size(&rod, steps, jacobian));
        }
    }
    printf("size 8 1 %lu %lu\n", (unsigned long)(sizeof workspace / sizeof *workspace),
           (unsigned long)rm_workspace_size(&rod, 8, 1));
    return 0;
}
