/* The moving part: what is kept of past inputs, and the evaluation in each communication step. */
#ifndef SLIDE_STREAM_H
#define SLIDE_STREAM_H

#include "clock.h"
#include "model.h"
#include "moving.h"

/* What is known of the inputs before the start; the values of the parameter prehistory_known. */
typedef enum {
    SLIDE_FIRST_HELD,   /* nothing: the first counts as held for ever */
    SLIDE_INITIAL_HELD, /* SlideState.initial, for ever */
    SLIDE_INITIAL_WINDOW_KNOWN /* SlideState.window; its oldest for ever before */
} SlidePrehistory;

/* Fixed-size head of the state; the arrays follow it in the same block. */
typedef struct {
    SlideClock clock;
    double filled;    /* samples of the inputs that were set in this run; whole unless steps were
                         no multiples of h */
    uint64_t strayed; /* number of the sample after the newest one that was out of range; or 0 */
    uint32_t mode;    /* SlideMode of instance.h */
    uint32_t current; /* outputs belong to the present state */
    uint32_t prehistory; /* SlidePrehistory */
    uint32_t moving;  /* the inputs of the next step have derivatives that are not all zero */
} SlideHead;

/* The last step, for its derivatives. */
typedef struct {
    double length;    /* s */
    uint32_t n_taken; /* samples one h apart that it took in; 0: it took all anew */
    uint32_t moved;   /* its inputs had derivatives */
    uint32_t began;   /* it was the first one: what was before were its inputs */
    uint32_t unused;
} SlideLastStep;

/* What was before the last step, for its derivatives, and what it began with. */
typedef struct {
    double *inputs;         /* [n_inputs], physical; of a step of several samples with a
                               first-order hold */
    double *given, *rates;  /* [n_inputs], of a step whose inputs moved: the inputs and their
                               derivatives as they were set */
    SlideNetworkState predictor; /* of recurrent networks */
} SlideBeforeStep;

/* All that changes lies in one flat block: saving and restoring are copies of it. */
typedef struct {
    SlideHead *head;
    double *inputs;  /* [n_inputs], as set last */
    double *rates;   /* [n_inputs], 1/s, derivatives of the inputs, of the next step only */
    double *initial; /* [n_inputs], before the start, where they are known */
    double *outputs; /* [n_outputs] */
    SlideLastStep *last;
    SlideSamples samples;
    SlideNetworkState predictor;
    SlideBeforeStep before;
    SlideEstimate estimate;
    SlideHistory history;
    double *window;      /* [memory_length][n_inputs], samples before the start, oldest first */
    size_t size;         /* bytes of the block, which starts at head */
    size_t before_steps; /* bytes of it before the steps of the history, its largest part */
    /* Room to undo a step; not part of the block. */
    void *backup;  /* of what comes before the steps */
    double *steps; /* of those that the step may change */
} SlideState;

void slide_state_place(SlideState *state, const SlideModel *model, SlideArena *arena);

/* Back to the state after placing: no steps, inputs at their start values. */
void slide_state_reset(const SlideModel *model, SlideState *state);

/* Is this a value that the network can take in: finite, also after scaling? */
bool slide_input_usable(const SlideModel *model, size_t input, double value);

/* The first input that is the cosine of an angle and, with its sine, shorter than that: it gives no
 * direction. n_inputs where there is none. */
size_t slide_without_direction(const SlideModel *model, const double *inputs, double shortest);

/* No communication step yet? */
bool slide_stream_fresh(const SlideState *state);

/* Before the first step: the inputs until then. */
const double *slide_stream_prehistory(const SlideModel *model, const SlideState *state);

/* Evaluate as if they had been held for ever, or after the window that is known. Before the first
 * step only. */
bool slide_stream_hold(const SlideModel *model, SlideState *state);

/* The parts of a step whose inputs move. */
SlideParts slide_stream_parts(const SlideModel *model, double length);

/* One communication step of a length (s, positive) under the present inputs: outputs at its end.
 * Of a whole number of sample steps, up to n_in, each is taken in; otherwise the window is sampled
 * anew from the remembered inputs and evaluated once. False when a result is not finite; then
 * nothing has changed. */
bool slide_stream_step(const SlideModel *model, SlideState *state, double length);

/* Do the inputs behind the outputs lie in their ranges, and what the estimator sees, where there is
 * one, in those of its training? Brings the error estimates up to the present state. */
bool slide_stream_in_range(const SlideModel *model, SlideState *state);

/* The outputs [n_block][n_outputs] of the newest samples as the network sees them now, oldest first,
 * scaled; after the first step or slide_stream_hold. They stay valid until the next call. */
const float *slide_stream_block(const SlideModel *model, const SlideState *state);

/* Bring the error estimates up to the present state; only with an estimator, after the first step
 * or slide_stream_hold. Changes nothing that later steps give. */
void slide_stream_estimate(const SlideModel *model, SlideState *state);

#endif
