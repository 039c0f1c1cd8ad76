/* Networks in double precision, written plainly, for differences of results that lie near each
 * other: in single precision their rounding would be most of the difference. Weights, features and
 * layout are those of the networks that run in steps. */
#ifndef SLIDE_EXACT_H
#define SLIDE_EXACT_H

#include "network.h"

/* Scratch for layers; enough for those of both networks. */
typedef struct {
    double *window;  /* [n_samples][seen.count], features of the samples that are looked at */
    double *back[2]; /* values of a layer and of the one before it */
} SlideExactLayers;

/* The states of cells (SlideCells) and what is measured of them; all scratch. */
typedef struct {
    uint64_t *taken;
    double *states;           /* [2][states], older first; rests of panels are zero */
    double *results;          /* [2][units + states + rows], of both states after an input */
    double *gates, *seen;     /* [units], [states]; of gated units */
    double *features;         /* [seen.count + 1]; the last is 1 */
    double *values;           /* [n_values], after the input taken last */
    double *errors, *largest; /* [n_values], as in SlideCellState */
} SlideExactCells;

void slide_exact_layers_place(SlideExactLayers *exact, const SlideLayers *layers,
                              SlideArena *arena);

/* The values after a sample: scaled, with those before it, newest first. They stay valid until the
 * next evaluation. */
const double *slide_exact_layers(const SlideLayers *layers, const SlideExactLayers *exact,
                                 const double *sample);

void slide_exact_cells_place(SlideExactCells *exact, const SlideCells *cells, SlideArena *arena);

/* From what was kept before a step, or from zero where before is NULL. */
void slide_exact_cells_start(const SlideCells *cells, const SlideExactCells *exact,
                             const SlideCellsBefore *before);

/* Take in an input as slide_cells_see, slide_cells_advance and slide_cells_accept do; scaled, with
 * those before it, newest first. */
void slide_exact_cells_take(const SlideCells *cells, const SlideExactCells *exact,
                            const double *sample);

#endif
