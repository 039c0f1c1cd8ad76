/* Derivatives of the present outputs with respect to physical parameters: how much the response to
 * the inputs of the whole window moves with parameters that had other values all along. So they
 * are those of a settled response, for calibration. */
#ifndef SLIDE_PARAMETER_SLOPES_H
#define SLIDE_PARAMETER_SLOPES_H

#include "stream.h"

/* Room for them; part of an instance, nothing of it is kept. */
typedef struct {
    SlideExact exact;
    double *direction; /* [parameters.count], one at a time, in their units */
    double *scaled;    /* [parameters.count], the same of their scaled transforms */
    double *slopes;    /* [n_outputs], the derivatives in that direction, in physical units */
} SlideParameterScratch;

void slide_parameter_slopes_place(SlideParameterScratch *scratch, const SlideModel *model,
                                  SlideArena *arena);

/* Derivative in the direction that the scratch holds, into its slopes. The outputs must be those of
 * the present state. Changes nothing that later steps give. */
void slide_parameter_slopes(const SlideModel *model, SlideState *state,
                            const SlideParameterScratch *scratch);

#endif
