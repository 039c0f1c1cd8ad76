/* Networks in double precision, written plainly, for differences of results that lie near each
 * other: in single precision their rounding would be most of the difference. Weights, features and
 * layout are those of the networks that run in steps. */
#ifndef SLIDE_EXACT_H
#define SLIDE_EXACT_H

#include "cells.h"
#include "layers.h"

/* Scratch for layers; enough for those of both networks. */
typedef struct {
    double *window;  /* [n_samples][seen.count], features of the samples that are looked at */
    double *back[2]; /* values of a layer and of the one before it */
} SlideExactLayers;

/* The states of cells (SlideCells) and what is measured of them; all scratch. */
typedef struct {
    uint64_t *taken;
    SlideCell cell;           /* if not gated, with scratch of its own */
    SlideGatedCell gated;     /* if gated */
    double *states, *next;    /* [2][states], older first; rests of panels are zero */
    double *rows;             /* [2][rows] */
    double *features;         /* [seen.count + 1]; the last is 1 */
    double *values;           /* [n_values], after the input taken last */
    double *errors, *largest; /* [n_values], as in SlideCellState */
} SlideExactCells;

typedef struct SlideExact {
    SlideExactLayers layers;
    SlideExactCells cells;
} SlideExact;

struct SlideNetwork;

/* A step that is done once more. */
typedef struct {
    const double *samples; /* scaled [][n_inputs], newest first: those of the step, and before */
    uint32_t n_taken;      /* samples that the step took in */
    bool anew;             /* it took in the whole window instead */
    bool settled;          /* the sample before counts as held for ever */
    const SlideCellsBefore *before; /* else: what was before the step */
} SlideExactRun;

void slide_exact_layers_place(SlideExact *exact, const struct SlideNetwork *network,
                              SlideArena *arena);
void slide_exact_cells_place(SlideExact *exact, const struct SlideNetwork *network,
                             SlideArena *arena);

/* The values after a step, scaled; they stay valid until the next evaluation. */
const double *slide_exact_layers_run(const struct SlideNetwork *network, const SlideExact *exact,
                                     const SlideExactRun *run);

/* The same; exact->cells.errors are the truncation errors, scaled. */
const double *slide_exact_cells_run(const struct SlideNetwork *network, const SlideExact *exact,
                                    const SlideExactRun *run);

#endif
