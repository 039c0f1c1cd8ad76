/* A state-space network in the layout of the kernels, and its two states (ping-pong): the older
 * has seen n_samples to 2 n_samples inputs; when the younger has seen n_samples, it becomes the
 * older and a new one starts from zero. See slide_fmu/state_space.py. */
#ifndef SLIDE_CELLS_H
#define SLIDE_CELLS_H

#include "arena.h"
#include "kernel.h"
#include "network_view.h"

typedef struct {
    SlideCell cell;
    uint32_t n_samples, n_out, n_values, n_inputs;
    uint32_t n_blocks;     /* of features: inputs, differences, second differences */
    double *feature_scale; /* [n_features] */
    float *features;       /* scratch [n_features + 1]; the last is 1 */
    float *next;           /* scratch: the states after an input, before they are accepted */
    float *both;           /* scratch: values of both states */
    float *newest;         /* scratch [n_values]: the values of the network */
    float *faded;          /* scratch [n_values]: what the younger state changes in them */
} SlideCells;

/* All that changes; part of the flat state block. */
typedef struct {
    uint64_t *taken;  /* inputs since both states were zero; the younger's age is its rest by
                         n_samples */
    float *states;    /* [2][state panels][SLIDE_LANES], older first */
    float *errors;    /* [n_values], scaled: the truncation error, up to the last hand-over */
    float *largest;   /* [n_values], scaled: the same since then, not known before the next */
} SlideCellState;

void slide_cells_place(SlideCells *cells, const SlideNetworkView *view, uint32_t n_inputs,
                       SlideArena *arena);
void slide_cell_state_place(SlideCellState *state, const SlideCells *cells, SlideArena *arena);

/* Both states to zero; the truncation error stays. n_samples inputs later the exact window is
 * evaluated, 2 n_samples inputs later the truncation error is measured. */
void slide_cells_restart(const SlideCells *cells, SlideCellState *state);

/* Try the next input: scaled [n_inputs], with the two inputs before it [2][n_inputs], newest first.
 * Gives the values; each has a term of every state, so states that are not finite show there. The
 * state stays as it was until slide_cells_accept. */
const float *slide_cells_advance(const SlideCells *cells, const SlideKernel *kernel,
                                 const SlideCellState *state, const double *input,
                                 const double *before);
void slide_cells_accept(const SlideCells *cells, SlideCellState *state);

#endif
