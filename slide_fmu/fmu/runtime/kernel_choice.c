#include "kernel.h"

#if !defined(SLIDE_ONE_KERNEL)

#include <cpuid.h>
#include <stdbool.h>

/* Does the operating system keep the 256-bit registers (XCR0: SSE and AVX state)? */
static bool keeps_avx_registers(void) {
    unsigned low, high;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return (low & 6) == 6;
}

const SlideKernel *slide_kernel_choose(void) {
    const unsigned fma = 1u << 12, osxsave = 1u << 27, avx2 = 1u << 5;
    unsigned a, b, c, d;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & fma) || !(c & osxsave) ||
        !keeps_avx_registers()) {
        return &slide_kernel_baseline;
    }
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || !(b & avx2)) {
        return &slide_kernel_baseline;
    }
    return &slide_kernel_avx2;
}

#else /* aarch64, where NEON with FMA belongs to every processor, and source FMUs */

const SlideKernel *slide_kernel_choose(void) { return &slide_kernel_baseline; }

#endif
