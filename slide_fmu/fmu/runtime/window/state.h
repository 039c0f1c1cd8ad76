/* All that changes while an FMU instance runs, and what its parts mean. */
#ifndef SLIDE_STATE_H
#define SLIDE_STATE_H

#include "clock.h"
#include "model.h"

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
    double given;     /* of these, how many came since a step was last no multiple of h, or, where
                         inputs are forecast, had another length than h */
    double prehistory;  /* SlidePrehistory, a variable */
    double at_step_end; /* a variable, 0 or 1: are inputs that move set to what they reach by the
                           step's end? Else they are set to what they are at its start, and a
                           forecast tells the rest */
    double last_length; /* s, of the last step; 0 before the first */
    double reached_length; /* s, of the step whose end the inputs set last are, where they are not
                              those of the step's end */
    double aside;       /* samples since the end of what SlideState.aside has seen; 0: nothing */
    double aside_since; /* what SlideState.since was there */
    double resumed;     /* samples that the last step took in, if it went on from there; or 0 */
    double confidence;  /* of error bounds, a variable */
    uint32_t mode;      /* SlideMode of instance.h */
    uint32_t current;   /* outputs belong to the present state */
    uint32_t moving;    /* the inputs of the next step have derivatives that count: not all zero, or
                           in the place of a forecast */
    uint32_t moved;     /* those of the last step had */
} SlideHead;

/* What the last step began with; where inputs are not those of the step's end, what the one before
 * it began with, whose true end came with this one. By it and by the history of before,
 * derivatives do it again. */
typedef struct {
    double *given, *rates;  /* [n_inputs], the inputs as they were set; of a step whose inputs
                               moved, their derivatives */
    double *samples; /* [SLIDE_BEFORE][n_inputs], the last ones before it, scaled, newest first */
    bool *told; /* [n_inputs], of such a step: whose derivatives take the place of a forecast */
    SlideNetworkState predictor; /* of recurrent networks */
} SlideBeforeStep;

/* All that changes lies in one flat block, which slide_state_copy saves and restores. */
typedef struct {
    SlideHead *head;
    double *inputs;  /* [n_inputs], as set last */
    double *rates;   /* [n_inputs], 1/s, derivatives of the inputs, of the next step only */
    bool *told;      /* [n_inputs], which of them take the place of a forecast */
    double *initial; /* [n_inputs], before the start, where they are known */
    double *outputs; /* [n_outputs] */
    double *goal;    /* [n_inputs], the forecast for the end of the last step */
    double *parameters; /* [model->parameters.count], as set last */
    double *acting;     /* [model->parameters.count], those behind the outputs */
    double *since;      /* [1 where there are parameters], samples since they changed */
    double *tolerances; /* [model->bound.n_outputs], of error bounds that are trusted, in the
                           outputs' units, as set last */
    uint64_t *strayed; /* number of the sample after the newest one that was out of range; or 0 */
    uint64_t *restarts; /* how often all samples were taken in anew */
    SlideSamples samples;
    SlideNetworkState predictor;
    SlideEstimate estimate;
    SlideBoundState bound;
    SlideBeforeStep before;
    SlideHistory history;
    double *window;      /* [memory_length][n_inputs], samples before the start, oldest first */
    void *aside;         /* what networks have seen, of another time. Where inputs are set to what
                            they are at the start of a step: as it was before what is only
                            forecast. Else as it was before a step that was no whole number of
                            samples: the step that ends a whole number of samples later goes on
                            from there */
    size_t size;         /* bytes of the block, which starts at head */
    size_t seen_size;    /* bytes of what networks have seen: from strayed to bound */
    size_t before_steps; /* bytes of it before the steps of the history, its largest part */
    void *backup;        /* room for these, and for what is aside, to undo a step; not part of the
                            block */
} SlideState;

void slide_state_place(SlideState *state, const SlideModel *model, SlideArena *arena);

/* Back to the state after placing: no steps, inputs at their start values. */
void slide_state_reset(const SlideModel *model, SlideState *state);

/* From one block of a state, or a copy of it at any alignment, to another, which then gives the
 * same results. Of the history, only the steps that these depend on: its room is mostly for many
 * short steps that were never taken. */
void slide_state_copy(const SlideModel *model, const SlideState *state, const void *from, void *to);

/* No communication step yet? */
static inline bool slide_stream_fresh(const SlideState *state) {
    return *state->history.count == 0;
}

/* The inputs until now: of the last step, or before the first one. */
const double *slide_stream_reached(const SlideModel *model, const SlideState *state);

/* Are inputs set to what they are at the start of a step? */
static inline bool slide_stream_forecasts(const SlideModel *model, const SlideState *state) {
    return model->history.first_order && state->head->at_step_end == 0;
}

/* The bound that judges this call. */
static inline const SlideBound *slide_stream_judge(const SlideModel *model,
                                                   const SlideState *state) {
    return slide_stream_forecasts(model, state) ? &model->plain_bound : &model->bound;
}

/* The inputs until the first step, before it. */
const double *slide_stream_prehistory(const SlideModel *model, const SlideState *state);

#endif
