/* A state-space network in the layout of the kernels, and its two states (ping-pong): the older
 * has seen n_samples to 2 n_samples inputs; when the younger has seen n_samples, it becomes the
 * older and a new one starts from zero. See slide_fmu/network/state_space.py. */
#ifndef SLIDE_CELLS_H
#define SLIDE_CELLS_H

#include "arena.h"
#include "cell_layout.h"
#include "feature_set.h"

typedef struct {
    bool is_gated;
    SlideCell cell;        /* if not gated */
    SlideGatedCell gated;  /* if gated */
    uint32_t n_samples, n_out, n_values;
    size_t state_panels, row_panels;
    size_t n_factors;      /* of the values, beside the constant one */
    SlideFeatures seen;    /* in the order [r, turn, g, s, f, w]; w only where it is not f */
    float *features;       /* scratch [seen.count + 1]; the last is 1 */
    float *next;           /* scratch: the states after an input, before they are accepted */
    float *both;           /* scratch: rows of both states, those of a value together */
    float *newest;         /* scratch [n_values]: the values of the network */
    float *faded;          /* scratch [n_values]: what the younger state changes in them */
    uint64_t n_recent;     /* places for n_out samples, a power of two */
    float *block;          /* scratch [n_out][n_values] */
} SlideCells;

/* All that changes; part of the flat state block. */
typedef struct {
    uint64_t *taken;  /* inputs since both states were zero; the younger's age is its rest by
                         n_samples */
    float *states;    /* [2][state panels][SLIDE_LANES], older first */
    float *errors;    /* [n_values], scaled: the truncation error, up to the last hand-over */
    float *largest;   /* [n_values], scaled: the same since then, not known before the next */
    float *recent;    /* [n_recent][n_values], the values after the inputs taken in last; those after
                         input k in place k % n_recent */
} SlideCellState;

/* The same before a step, for its derivatives; part of the flat state block. */
typedef struct {
    uint64_t *taken;
    float *states, *errors, *largest;
} SlideCellsBefore;

/* The family, whose functions take in inputs; see network.h. */
extern const struct SlideFamily slide_state_space_family;

void slide_cells_before_place(SlideCellsBefore *before, const SlideCells *cells,
                              SlideArena *arena);
void slide_cells_keep(const SlideCells *cells, const SlideCellState *state,
                      SlideCellsBefore *before);

/* The age of the younger state after the next input, when so many were taken in. */
uint32_t slide_cells_age(const SlideCells *cells, uint64_t taken);

/* The weight of the younger state in the values, at its age. */
float slide_cells_weight(const SlideCells *cells, uint32_t age);

#endif
