/* Derivatives of the present outputs with respect to the inputs that the last communication step
 * took in: how much the outputs at its end move with inputs that were held in this step (ramps:
 * reached at its end), all that was before it staying as it was. Before the first step, and after
 * it, inputs count as held for ever, unless the prehistory is known.
 *
 * Forward mode: the last step is done once more, with derivatives beside the values. */
#ifndef SLIDE_DERIVATIVE_H
#define SLIDE_DERIVATIVE_H

#include "stream.h"

/* Derivative in one direction, in physical units: d_inputs [n_inputs] to d_outputs [n_outputs]. The
 * outputs must be those of the present state: after a step or slide_stream_hold. */
void slide_directional_derivative(const SlideModel *model, const SlideState *state,
                                  const double *d_inputs, double *d_outputs);

#endif
