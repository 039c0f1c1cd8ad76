#include "kernel.h"

#if !defined(SLIDE_ONE_KERNEL)
#include <cpuid.h>
#include <stdbool.h>

enum { AVX512, AVX2, BASELINE };

/* What the operating system keeps of the wide registers (XCR0). */
static unsigned kept_registers(void) {
    unsigned low, high;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return low;
}

/* The first kernel that processor and operating system support. */
static size_t first_supported(void) {
    const unsigned fma = 1u << 12, osxsave = 1u << 27, avx2 = 1u << 5;
    const unsigned avx512 = 1u << 16 | 1u << 17 | 1u << 30 | 1u << 31; /* F, DQ, BW, VL */
    const unsigned avx_registers = 0x06, avx512_registers = 0xE6;
    const unsigned needed = fma | osxsave;
    unsigned a, b, c, d;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & needed) != needed ||
        !__get_cpuid_count(7, 0, &a, &b, &c, &d)) {
        return BASELINE;
    }
    const unsigned kept = kept_registers();
    const bool wide = (kept & avx_registers) == avx_registers && (b & avx2) != 0;
    const bool widest = (kept & avx512_registers) == avx512_registers && (b & avx512) == avx512;
    return !wide ? BASELINE : widest ? AVX512 : AVX2;
}

const SlideKernel *slide_kernel(size_t index) {
    static const SlideKernel *const all[] = {[AVX512] = &slide_kernel_avx512,
                                             [AVX2] = &slide_kernel_avx2,
                                             [BASELINE] = &slide_kernel_baseline};
    const size_t first = first_supported();
    return index <= BASELINE - first ? all[first + index] : NULL;
}
#else /* aarch64, where NEON with FMA belongs to every processor, and source FMUs */
const SlideKernel *slide_kernel(size_t index) {
    return index == 0 ? &slide_kernel_baseline : NULL;
}
#endif
