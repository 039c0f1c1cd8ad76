/* In place of kernel_choice.c in source FMUs: one kernel, for the processor that it is compiled
 * for. */
#include "kernel.h"

const SlideKernel *slide_kernel_choose(void) { return &slide_kernel_baseline; }
