/* Choice among variants of the core. A build holds one for each instruction set of the processor's family; the names of
 * its functions end with the variant's: rm_solve_avx2. */
#ifndef RM_DISPATCH_H
#define RM_DISPATCH_H

/* cffi: begin */

/* A machine that runs one variant runs all those before it. */
enum rm_variant {
    RM_BASELINE = 0, /* common to all processors of the family: SSE2 on x86-64 */
    RM_AVX2 = 1,     /* 256-bit vectors with fused multiply-add */
    RM_AVX512 = 2    /* 512-bit vectors: F, DQ, VL and BW */
};

/* Return the last variant that processor and operating system support. Call it once: CPUID takes microseconds in a
 * virtual machine. */
int rm_best_variant(void);

/* cffi: end */

#endif
