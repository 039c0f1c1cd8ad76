/* What derivative.c needs to do a step once more; part of the model, nothing of it is kept. */
#ifndef SLIDE_DERIVATIVE_SCRATCH_H
#define SLIDE_DERIVATIVE_SCRATCH_H

#include "cells_derivative.h"
#include "layers_derivative.h"
#include "network.h"

typedef struct {
    SlideLayersDerivative layers; /* of a network of layers */
    SlideCellsDerivative cells;   /* of cells */
    double *sample, *d_sample;    /* [n_inputs]: a sample, in physical units */
    double *inputs, *d_inputs;    /* [1 + SLIDE_BEFORE][n_inputs]: it and those before it, scaled,
                                     newest first */
    double *d_values;             /* [n_outputs], scaled */
    double *zeros;                /* [n_inputs], of inputs that stay */
    double *direction;            /* [n_inputs], one at a time */
    double *column;               /* [n_outputs], the derivatives in that direction */
} SlideDerivativeScratch;

void slide_derivative_scratch_place(SlideDerivativeScratch *scratch, const SlideNetwork *network,
                                    size_t n_inputs, size_t n_outputs, SlideArena *arena);

#endif
