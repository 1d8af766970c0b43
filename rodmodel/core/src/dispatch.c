/* Instruction sets of the machine, from the CPUID instruction: the compilers' builtins for this need a run-time library
 * that not every compiler has. */
#include "dispatch.h"

#if defined(__x86_64__)

#include <cpuid.h>

/* Registers that the operating system saves when it switches threads, one bit each (Intel SDM 1, 13.3). Others must not
 * be used. Valid only if bit_OSXSAVE is set. */
static unsigned int saved_registers(void)
{
    unsigned int low, high;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return low;
}

int rm_best_variant(void)
{
    const unsigned int ymm = 0x06;  /* lower and upper halves of 256-bit registers */
    const unsigned int zmm = 0xe6;  /* ymm, mask registers, and the rest of 32 512-bit registers */
    const unsigned int fma = bit_OSXSAVE | bit_AVX | bit_FMA;
    const unsigned int avx512 = bit_AVX512F | bit_AVX512DQ | bit_AVX512VL | bit_AVX512BW;
    unsigned int a, b, c, d, features;
    if (!__get_cpuid(1, &a, &b, &features, &d) || (features & fma) != fma) return RM_BASELINE;
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || !(b & bit_AVX2)) return RM_BASELINE;
    const unsigned int saved = saved_registers();
    if ((saved & ymm) != ymm) return RM_BASELINE;
    if ((saved & zmm) != zmm || (b & avx512) != avx512) return RM_AVX2;
    return RM_AVX512;
}

#else

int rm_best_variant(void)
{
    return RM_BASELINE;
}

#endif
