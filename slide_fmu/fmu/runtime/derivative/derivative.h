/* Derivatives of the present outputs with respect to the inputs that the last communication step
 * took in: how much the outputs at its end move with inputs that were held in this step
 * (first-order hold: reached at its end), all that was before it staying as it was. Before the
 * first step, and after it, inputs count as held for ever, unless the prehistory is known.
 *
 * The last step is done twice more, in double precision, with inputs a little to either side. */
#ifndef SLIDE_DERIVATIVE_H
#define SLIDE_DERIVATIVE_H

#include "stream.h"

/* Derivatives [n_outputs] each, in physical units, one after the other in one array. */
typedef enum {
    SLIDE_OF_OUTPUTS,
    SLIDE_OF_TRUNCATION_ERRORS, /* 0 without cells */
    SLIDE_OF_ESTIMATES          /* 0 without an estimator, or where they are not wanted */
} SlideDerivatives;

/* Room to do a step once more; part of an instance, nothing of it is kept. */
typedef struct {
    SlideExact predictor, estimator;
    double *inputs;     /* [n_inputs], as they are set now */
    double *given;      /* [n_inputs], as they were for the last step */
    double *results[2]; /* [3][n_outputs] on either side: SlideDerivatives, scaled */
    double *direction;  /* [n_inputs], one at a time */
    double *slopes;     /* [3][n_outputs], the derivatives in that direction */
} SlideDerivativeScratch;

void slide_derivative_place(SlideDerivativeScratch *scratch, const SlideModel *model,
                            SlideArena *arena);

/* Derivative in the direction that the scratch holds, into its slopes, in physical units. The
 * outputs must be those of the present state: after a step or slide_stream_hold; if estimates are
 * wanted, these too: after slide_stream_estimate. Changes nothing that later steps give. */
void slide_directional_derivative(const SlideModel *model, SlideState *state,
                                  const SlideDerivativeScratch *scratch, bool estimates);

#endif
