/* Minima of quadratics over polytopes: a case a line from standard input, its minimum to standard output. A case is the
 * domain (six numbers), the matrix (six), gradient and point (three each), and the chamber without pressure or -1. */
#include <stdio.h>

#include "polytope.h"

int main(void)
{
    double x[18];
    int without;
    for (;;) {
        rm_real r[18];
        for (int k = 0; k < 18; k++) {
            if (scanf("%lf", x + k) != 1) {
                return 0;
            }
            r[k] = (rm_real)x[k];
        }
        if (scanf("%d", &without) != 1) {
            return 1;
        }
        const rm_domain domain = {.pressure_max = {r[0], r[1], r[2]}, .pressure_sum_max = r[3], .beside_share = r[4],
                                  .beside_max = r[5]};
        const sym h = {r[6], r[7], r[8], r[9], r[10], r[11]};
        polytope box;
        set_polytope(&domain, R(1.0), &box);
        const vec found = minimum_over(h, vec_of(r + 12), vec_of(r + 15), &box, without);
        printf("%.17g %.17g %.17g\n", (double)found.x, (double)found.y, (double)found.z);
    }
}
