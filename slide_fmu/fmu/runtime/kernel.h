/* The arithmetic of the layers. kernel.c is compiled once per instruction set; SLIDE_KERNEL is the
 * name of the table it defines. kernel_choice.c picks one for the processor it runs on. */
#ifndef SLIDE_KERNEL_H
#define SLIDE_KERNEL_H

#include <stddef.h>
#include <stdint.h>

enum {
    SLIDE_PANEL = 32, /* outputs of a layer that are computed together */
    SLIDE_LANES = 8   /* the same in a cell, whose matrices are small */
};

/* A cell of a state-space network (slide_fmu/state_space.py) in the layout of the kernel. Matrices
 * lie in panels, [panel][column][SLIDE_LANES], zeros where no row is. */
typedef struct {
    size_t n_features, n_states;
    size_t unit_panels, state_panels, value_panels;
    uint32_t activation;
    const float *from_features; /* of [f, 1]: rows of W, then of B, then of D and d0 */
    const float *from_states;   /* of x: rows of W, then of A */
    const float *from_units;    /* E, its columns padded to whole panels */
    const float *to_values;     /* C */
    float *driven;              /* scratch: rows of from_features */
    float *units;               /* scratch: units of both states, in whole SLIDE_PANELs */
} SlideCell;

typedef struct {
    const char *name;
    /* y[p][j] = start[p][j] + sum over i of weights[p][i][j] x[i], for panels p of SLIDE_PANEL
     * outputs j; start may be y. */
    void (*affine)(const float *weights, const float *start, const float *x, size_t n_in,
                   size_t n_panels, float *y);
    /* Apply activation 0 identity, 1 relu, 2 elu, 3 tanh, 4 gelu, 5 cubic in place; count: a
     * multiple of SLIDE_PANEL. What is not a number stays so. */
    void (*activate)(uint32_t activation, float *values, size_t count);
    /* Advance two states of a cell at once, with the same features [f, 1]: next [2][state_panels]
     * [SLIDE_LANES] from states of that shape, and the values of both, [2][value_panels]
     * [SLIDE_LANES]. Weights are read once, and one state fills the waiting times of the other. */
    void (*advance)(const SlideCell *cell, const float *features, const float *states,
                    float *next, float *values);
} SlideKernel;

extern const SlideKernel slide_kernel_baseline; /* x86-64-v2 */
extern const SlideKernel slide_kernel_avx2;     /* with AVX2 and FMA */

/* The fastest kernel that processor and operating system support. */
const SlideKernel *slide_kernel_choose(void);

#endif
