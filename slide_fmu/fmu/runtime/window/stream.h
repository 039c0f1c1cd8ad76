/* The moving part: what is kept of past inputs, and the evaluation in each communication step. */
#ifndef SLIDE_STREAM_H
#define SLIDE_STREAM_H

#include "state.h"

/* Evaluate as if the inputs had been held for ever, or after the window that is known. Before the
 * first step only. */
bool slide_stream_hold(const SlideModel *model, SlideState *state);

/* One communication step of a length (s, positive) under the present inputs: outputs at its end.
 * False when a result is not finite; then nothing has changed but what is found again. */
bool slide_stream_step(const SlideModel *model, SlideState *state, double length);

/* The last step becomes one sample longer, where inputs are forecast and were not set since. */
bool slide_stream_go_on(const SlideModel *model, SlideState *state);

/* The last step has these inputs [n_inputs] in the place of those that were set, and what is expected
 * of them: for samples from the history. */
void slide_stream_set_again(const SlideModel *model, SlideState *state, const double *inputs);

/* Samples of the inputs that were set in this run. */
double slide_stream_filled(const SlideModel *model, const SlideState *state);

/* Do the inputs behind the outputs lie in their ranges? */
bool slide_stream_in_range(const SlideModel *model, SlideState *state);

/* Did inputs do what samples do not show, so lately that it counts? */
bool slide_stream_doubtful(const SlideModel *model, const SlideState *state);

/* The outputs [n_block][n_outputs] of the newest samples as the network sees them now, oldest
 * first, scaled; after the first step or slide_stream_hold. Valid until the next call. */
const float *slide_stream_block(const SlideModel *model, SlideState *state);

/* Error estimates at the present state; only with an estimator, after the first step or
 * slide_stream_hold. Changes nothing that later steps give. */
const SlideEstimate *slide_stream_estimate(const SlideModel *model, SlideState *state);

/* The same of the error bound; only with one. */
const SlideBoundState *slide_stream_bound(const SlideModel *model, SlideState *state);

/* The novelty; between phases, the largest of all that the outputs are made of. */
double slide_stream_novelty(const SlideModel *model, SlideState *state);

#endif
