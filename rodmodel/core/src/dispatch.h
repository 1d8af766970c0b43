/* Which copy of the core this machine can run. A build holds one for each of these instruction sets, as far as the
 * processor's family has them; the names of a copy's functions end with its own: rm_solve_avx2. */
#ifndef RM_DISPATCH_H
#define RM_DISPATCH_H

/* cffi: begin */

/* In this order: a machine that runs one runs those before it. */
enum rm_variant {
    RM_BASELINE = 0, /* what every processor of the family has: SSE2 on x86-64 */
    RM_AVX2 = 1,     /* 256-bit vectors with fused multiply-add */
    RM_AVX512 = 2    /* 512-bit vectors: F, DQ, VL and BW */
};

/* The last variant that processor and operating system both support. The processor is asked anew, which takes
 * microseconds in a virtual machine: call it once and keep the answer. */
int rm_best_variant(void);

/* cffi: end */

#endif
