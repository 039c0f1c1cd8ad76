/* The derivative of a state-space network in one direction: the two states of cells.h run once
 * more as dual numbers, in double precision. */
#ifndef SLIDE_CELLS_DERIVATIVE_H
#define SLIDE_CELLS_DERIVATIVE_H

#include "cells.h"
#include "dual.h"

/* All scratch; matrices of duals lie as those of cells.h. */
typedef struct {
    uint64_t *taken;    /* inputs since both states were zero */
    SlideDual *states;  /* [2][states], older first; rests of panels are zero */
    SlideDual *next;    /* the same after an input */
    SlideDual *seen;    /* [states], a state as gated units see it */
    SlideDual *pushed;  /* [states], what gated units add to it */
    SlideDual *units;   /* [units] */
    SlideDual *shared;  /* [units + states + rows], what both states take of the features; of gated
                           units, what is offered to them comes first */
    SlideDual *gates;   /* [units] */
    SlideDual *rows;    /* [2][rows] */
    SlideDual *features; /* [seen.count + 1], the last is 1 */
    double *slopes;     /* [seen.count], of the features */
    double *values;     /* [n_values], slopes of the values */
} SlideCellsDerivative;

void slide_cells_derivative_place(SlideCellsDerivative *derivative, const SlideCells *cells,
                                  SlideArena *arena);

/* From states that were kept (SlideCellState.states, taken), whose derivatives are zero; or, from
 * NULL and 0, from zero. */
void slide_cells_derivative_start(const SlideCells *cells, const SlideCellsDerivative *derivative,
                                  const float *states, uint64_t taken);

/* Take in an input, as slide_cells_see, slide_cells_advance and slide_cells_accept do, and its
 * derivative; scaled, with those before it. Gives the slopes of the values, [n_values]. */
const double *slide_cells_derivative_take(const SlideCells *cells,
                                          const SlideCellsDerivative *derivative,
                                          const double *input, const double *d_input);

#endif
