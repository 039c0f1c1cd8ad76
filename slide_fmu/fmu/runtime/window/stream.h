/* The moving part: what is kept of past inputs, and the evaluation in each communication step. */
#ifndef SLIDE_STREAM_H
#define SLIDE_STREAM_H

#include "intake.h"

/* Evaluate as if they had been held for ever, or after the window that is known. Before the first
 * step only. */
bool slide_stream_hold(const SlideModel *model, SlideState *state);

/* One communication step of a length (s, positive) under the present inputs: outputs at its end.
 * Of a whole number of sample steps, up to n_in, each is taken in. Another one goes on from what
 * networks saw a whole number of samples before its end (aside.h), if that is kept; otherwise the
 * window is sampled anew from the remembered inputs and evaluated once. False when a result is not
 * finite; then nothing has changed. */
bool slide_stream_step(const SlideModel *model, SlideState *state, double length);

/* The last step, of a whole number of samples, becomes one sample longer, where inputs are
 * forecast and were not set since. Not undone when a result is not finite. */
bool slide_stream_go_on(const SlideModel *model, SlideState *state);

/* Do the inputs behind the outputs lie in their ranges? */
bool slide_stream_in_range(const SlideModel *model, const SlideState *state);

/* The outputs [n_block][n_outputs] of the newest samples as the network sees them now, oldest
 * first, scaled; after the first step or slide_stream_hold. Valid until the next call. */
const float *slide_stream_block(const SlideModel *model, const SlideState *state);

/* Bring the error estimates up to the present state; only with an estimator, after the first step
 * or slide_stream_hold. Changes nothing that later steps give. */
void slide_stream_estimate(const SlideModel *model, SlideState *state);

/* The same of the error bound; only with one. */
void slide_stream_bound(const SlideModel *model, SlideState *state);

#endif
