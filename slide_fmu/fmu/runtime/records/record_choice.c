#include "record_kernel.h"

#define ENTRY(kernel, result, name, arguments) kernel##_##name,
#define TABLE(kernel) {SLIDE_RECORD_FUNCTIONS(ENTRY, kernel)}

const SlideRecordKernel *slide_record_kernel(const SlideKernel *kernel) {
    static const SlideRecordKernel baseline = TABLE(slide_kernel_baseline);
#if !defined(SLIDE_ONE_KERNEL)
    static const SlideRecordKernel avx2 = TABLE(slide_kernel_avx2);
    static const SlideRecordKernel avx512 = TABLE(slide_kernel_avx512);
    if (kernel == &slide_kernel_avx512) {
        return &avx512;
    }
    if (kernel == &slide_kernel_avx2) {
        return &avx2;
    }
#endif
    (void)kernel;
    return &baseline;
}
