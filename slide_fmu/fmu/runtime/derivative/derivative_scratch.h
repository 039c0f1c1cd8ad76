/* What derivative.c needs to do a step once more; part of an instance, nothing of it is kept. */
#ifndef SLIDE_DERIVATIVE_SCRATCH_H
#define SLIDE_DERIVATIVE_SCRATCH_H

#include "estimate.h"

typedef struct {
    SlideExact predictor, estimator;
    double *inputs;             /* [n_inputs], as they are set now */
    double *results[2];         /* [3][n_outputs] on either side: SlideDerivatives, scaled */
    double *direction;          /* [n_inputs], one at a time */
    double *slopes;             /* [3][n_outputs], the derivatives in that direction */
} SlideDerivativeScratch;

#endif
