/* The arithmetic of the layers. kernel.c is compiled once per instruction set; SLIDE_KERNEL is the
 * name of the table it defines. kernel_choice.c picks one for the processor it runs on. */
#ifndef SLIDE_KERNEL_H
#define SLIDE_KERNEL_H

#include "dialect.h"

#include <stddef.h>
#include <stdint.h>

enum {
    SLIDE_PANEL = 32, /* outputs of a layer that are computed together */
    SLIDE_LANES = 8,  /* the same in a cell, whose matrices are small */
    SLIDE_ROWS = 12   /* rows of a batch come in multiples of it */
};

/* Activations, and what else units of a cell may have. */
typedef enum { SLIDE_TANH = 3, SLIDE_CUBIC = 5, SLIDE_GATED = 6, SLIDE_MIXED = 7 } SlideUnits;

/* A matrix times some of the features, plus constants. */
typedef struct {
    size_t first, count;    /* the features: the first one, and how many follow each other */
    const float *weights;   /* in panels of count columns */
    const float *constants; /* in panels of one column */
} SlideFeaturePart;

/* The cell of a state-space network (slide_fmu/network/state_space/equations.py) in the layout of
 * the kernel. Matrices lie in panels, [panel][column][SLIDE_LANES], zeros where no row is. */
typedef struct {
    size_t n_states;
    size_t substeps; /* of a sample, at least 1: the states move so often by its features */
    size_t turned; /* pairs of states; their cosine and sine are then the first two features */
    size_t unit_panels, state_panels, row_panels;
    uint32_t activation; /* of the units; SLIDE_GATED: they are multiplied by their gates;
                            SLIDE_MIXED: they are clipped cubes and tanh in turns */
    SlideFeaturePart to_gates;   /* of gated units: W */
    SlideFeaturePart to_units;   /* of gated units the features' part of V, else of W */
    SlideFeaturePart to_states;  /* B */
    SlideFeaturePart to_rows;    /* D, d0 */
    const float *units_of_states; /* the states' part of V, or of W */
    const float *states_of_states, *states_of_units; /* A; E, its columns padded to whole panels */
    const float *rows_of_states;                     /* C */
    /* Scratch, numbers of the precision that is computed in. */
    void *open, *offered, *driven, *rows; /* what the four parts of the features give */
    void *cubes;         /* of both states, those of mixed units: half of them */
    void *seen, *pushed; /* of both states: turned back; E h */
    void *between;       /* both states between sub-steps; NULL where there is one step */
    void *units;         /* of both states, in whole SLIDE_PANELs */
    const void *zeros;   /* as long as a state */
} SlideCell;

/* Rows of a batch: y[row] = start + row * start_stride, plus weights times x[row]. */
typedef struct {
    size_t count;          /* a multiple of SLIDE_ROWS */
    const float *const *x; /* [count] rows of n_in values; they may overlap */
    const float *start;
    size_t start_stride;
    float *y; /* [count][n_panels][SLIDE_PANEL]; may be start */
} SlideRows;

typedef struct {
    const char *name;
    /* y[p][j] = start[p][j] + sum over i of weights[p][i][j] x[i], for panels p of SLIDE_PANEL
     * outputs j; start may be y. */
    void (*affine)(const float *weights, const float *start, const float *x, size_t n_in,
                   size_t n_panels, float *y);
    /* The same for two x, to the bit: weights are read once for both. */
    void (*affine_two)(const float *weights, const float *const start[2], const float *const x[2],
                       size_t n_in, size_t n_panels, float *const y[2]);
    /* The same for many rows: weights are read once for several. */
    void (*affine_rows)(const float *weights, size_t n_in, size_t n_panels, const SlideRows *rows);
    /* Apply activation 0 identity, 1 relu, 2 elu, 3 tanh, 4 gelu, 5 cubic in place; count: a
     * multiple of SLIDE_PANEL. What is not a number stays so. */
    void (*activate)(uint32_t activation, float *values, size_t count);
    /* Advance two states of a cell at once, with the same features: next [2][state_panels]
     * [SLIDE_LANES] from states of that shape, and the rows of both, [2][row_panels]
     * [SLIDE_LANES]. Weights are read once, and one state fills the waiting times of the other. */
    void (*advance)(const SlideCell *cell, const float *features, const float *states,
                    float *next, float *rows);
} SlideKernel;

extern const SlideKernel slide_kernel_baseline; /* x86-64-v2; NEON on aarch64 */
extern const SlideKernel slide_kernel_avx2;     /* x86-64-v3: with AVX2 and FMA */
extern const SlideKernel slide_kernel_avx512;   /* x86-64-v4: with AVX-512 F, DQ, BW and VL too */

/* The kernels that processor and operating system support, the fastest first; then NULL. */
const SlideKernel *slide_kernel(size_t index);

#endif
