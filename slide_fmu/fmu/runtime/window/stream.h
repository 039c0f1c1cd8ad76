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
    double prehistory;  /* SlidePrehistory, a variable */
    double at_step_end; /* a variable, 0 or 1: are inputs that move set to what they reach by the
                           step's end? Else they are set to what they are at its begin, and a
                           forecast tells the rest */
    double last_length; /* s, of the last step; 0 before the first */
    double reached_length; /* s, of the step whose end the inputs set last are, where they are not
                              those of the step's end */
    uint32_t mode;      /* SlideMode of instance.h */
    uint32_t current;   /* outputs belong to the present state */
    uint32_t moving;    /* the inputs of the next step have derivatives that count: not all zero, or
                           in the place of a forecast */
    uint32_t moved;     /* those of the last step had */
} SlideHead;

/* What the last step began with, or, where inputs are not those of the step's end, the one before
 * it, whose true end came with this one: by it and by the history of before, derivatives do it again. */
typedef struct {
    double *given, *rates;  /* [n_inputs], the inputs as they were set; of a step whose inputs
                               moved, their derivatives */
    bool *told; /* [n_inputs], of such a step: whose derivatives the importer told */
    SlideNetworkState predictor; /* of recurrent networks */
} SlideBeforeStep;

/* All that changes lies in one flat block: saving and restoring are copies of it. */
typedef struct {
    SlideHead *head;
    double *inputs;  /* [n_inputs], as set last */
    double *rates;   /* [n_inputs], 1/s, derivatives of the inputs, of the next step only */
    bool *told;      /* [n_inputs], which of them the importer told */
    double *initial; /* [n_inputs], before the start, where they are known */
    double *outputs; /* [n_outputs] */
    double *goal;    /* [n_inputs], the forecast for the end of the last step */
    uint64_t *strayed; /* number of the sample after the newest one that was out of range; or 0 */
    SlideSamples samples;
    SlideNetworkState predictor;
    SlideEstimate estimate;
    SlideBeforeStep before;
    SlideHistory history;
    double *window;      /* [memory_length][n_inputs], samples before the start, oldest first */
    void *known;         /* what networks have seen, as it was before what is only forecast */
    size_t size;         /* bytes of the block, which starts at head */
    size_t seen_size;    /* bytes of what networks have seen: from strayed to estimate */
    size_t before_steps; /* bytes of it before the steps of the history, its largest part */
    void *backup;        /* room for these, to undo a step; not part of the block */
} SlideState;

void slide_state_place(SlideState *state, const SlideModel *model, SlideArena *arena);

/* Back to the state after placing: no steps, inputs at their start values. */
void slide_state_reset(const SlideModel *model, SlideState *state);

/* No communication step yet? */
bool slide_stream_fresh(const SlideState *state);

/* The inputs until now: of the last step, or before the first one. */
const double *slide_stream_reached(const SlideModel *model, const SlideState *state);

/* Evaluate as if they had been held for ever, or after the window that is known. Before the first
 * step only. */
bool slide_stream_hold(const SlideModel *model, SlideState *state);

/* What a step takes in: samples one h apart, or all that the networks see anew. */
typedef struct {
    uint32_t count; /* the newest so many of model->taken */
    bool anew;
    bool settled; /* what was before are its inputs, held for ever */
} SlideIntake;

/* Are inputs set to what they are at the begin of a step? */
bool slide_stream_forecasts(const SlideModel *model, const SlideState *state);

/* The step that begins now, of state->head->last_length under state->inputs, becomes the newest of
 * the history, and the samples that it takes in come into model->taken; with those that the true
 * end of the step before takes in, where inputs are set to what they are at the begin. */
SlideIntake slide_stream_take_in(const SlideModel *model, SlideState *state);

/* One communication step of a length (s, positive) under the present inputs: outputs at its end.
 * Of a whole number of sample steps, up to n_in, each is taken in; otherwise the window is sampled
 * anew from the remembered inputs and evaluated once. False when a result is not finite; then
 * nothing has changed. */
bool slide_stream_step(const SlideModel *model, SlideState *state, double length);

/* The last step, of a whole number of samples, becomes one sample longer, where inputs are
 * forecast and were not set since. Not undone when a result is not finite. */
bool slide_stream_go_on(const SlideModel *model, SlideState *state);

/* Do the inputs behind the outputs lie in their ranges, and what the estimator sees, where there
 * is one, in those of its training? Brings the error estimates up to the present state. */
bool slide_stream_in_range(const SlideModel *model, SlideState *state);

/* The outputs [n_block][n_outputs] of the newest samples as the network sees them now, oldest
 * first, scaled; after the first step or slide_stream_hold. Valid until the next call. */
const float *slide_stream_block(const SlideModel *model, const SlideState *state);

/* Bring the error estimates up to the present state; only with an estimator, after the first step
 * or slide_stream_hold. Changes nothing that later steps give. */
void slide_stream_estimate(const SlideModel *model, SlideState *state);

#endif
