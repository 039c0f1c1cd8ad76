/* The arithmetic of the layers. kernel.c is compiled once per instruction set; SLIDE_KERNEL is the
 * name of the table it defines. kernel_choice.c picks one for the processor it runs on. */
#ifndef SLIDE_KERNEL_H
#define SLIDE_KERNEL_H

#include <stddef.h>
#include <stdint.h>

enum { SLIDE_PANEL = 32 }; /* outputs that are computed together */

typedef struct {
    const char *name;
    /* y[p][j] = start[p][j] + sum over i of weights[p][i][j] x[i], for panels p of SLIDE_PANEL
     * outputs j; start may be y. */
    void (*affine)(const float *weights, const float *start, const float *x, size_t n_in,
                   size_t n_panels, float *y);
    /* Apply activation 0 identity, 1 relu, 2 elu, 3 tanh, 4 gelu in place; count: a multiple of
     * SLIDE_PANEL. What is not a number stays so. */
    void (*activate)(uint32_t activation, float *values, size_t count);
} SlideKernel;

extern const SlideKernel slide_kernel_baseline; /* x86-64-v2 */
extern const SlideKernel slide_kernel_avx2;     /* with AVX2 and FMA */

/* The fastest kernel that processor and operating system support. */
const SlideKernel *slide_kernel_choose(void);

#endif
