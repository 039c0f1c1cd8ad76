#include "kernel.h"

#if !defined(SLIDE_ONE_KERNEL)
#include <cpuid.h>
#include <stdbool.h>

enum { HAS_AVX2 = 1, HAS_AVX512 = 2 };

/* What the operating system keeps of the wide registers (XCR0). */
static unsigned kept_registers(void) {
    unsigned low, high;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return low;
}

static unsigned found_sets(void) {
    const unsigned fma = 1u << 12, osxsave = 1u << 27, avx2 = 1u << 5;
    const unsigned avx512 = 1u << 16 | 1u << 17 | 1u << 30 | 1u << 31; /* F, DQ, BW, VL */
    const unsigned avx_registers = 0x06, avx512_registers = 0xE6;
    const unsigned needed = fma | osxsave;
    unsigned a, b, c, d;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & needed) != needed ||
        !__get_cpuid_count(7, 0, &a, &b, &c, &d)) {
        return 0;
    }
    const unsigned kept = kept_registers();
    const bool wide = (kept & avx_registers) == avx_registers && (b & avx2) != 0;
    const bool widest = (kept & avx512_registers) == avx512_registers && (b & avx512) == avx512;
    return (wide ? HAS_AVX2 : 0) | (wide && widest ? HAS_AVX512 : 0);
}

size_t slide_kernels(const SlideKernel *kernels[SLIDE_KERNELS]) {
    const unsigned sets = found_sets();
    size_t count = 0;
    if (sets & HAS_AVX512) {
        kernels[count++] = &slide_kernel_avx512;
    }
    if (sets & HAS_AVX2) {
        kernels[count++] = &slide_kernel_avx2;
    }
    kernels[count++] = &slide_kernel_baseline;
    return count;
}
#else /* aarch64, where NEON with FMA belongs to every processor, and source FMUs */
size_t slide_kernels(const SlideKernel *kernels[SLIDE_KERNELS]) {
    kernels[0] = &slide_kernel_baseline;
    return 1;
}
#endif

const SlideKernel *slide_kernel_choose(void) {
    const SlideKernel *kernels[SLIDE_KERNELS];
    slide_kernels(kernels);
    return kernels[0];
}
