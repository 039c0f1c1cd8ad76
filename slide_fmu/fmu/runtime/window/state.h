/* All that changes while an FMU instance runs, and what its parts mean. */
#ifndef SLIDE_STATE_H
#define SLIDE_STATE_H

#include "clock.h"
#include "model.h"
#include "phase.h"

/* What is known of the inputs before the start; the values of the parameter prehistory_known. */
typedef enum {
    SLIDE_FIRST_HELD,   /* nothing: the first counts as held for ever */
    SLIDE_INITIAL_HELD, /* SlideState.initial, for ever */
    SLIDE_INITIAL_WINDOW_KNOWN, /* SlideState.window; its oldest for ever before */
    SLIDE_OUTPUTS_KNOWN /* the same, from the first sample on of which SlideState.window_outputs has an
                           output: they show the state there */
} SlidePrehistory;

/* Fixed-size head of the state; the arrays follow it in the same block. */
typedef struct {
    SlideClock clock; /* the importer's time */
    SlideClock inner; /* the same from 0 on, in steps that the importer means */
    uint64_t n_steps; /* communication steps so far */
    double prehistory;  /* SlidePrehistory, a variable */
    double known; /* a variable, 0 or 1: is what is set all that the inputs do in a step? Those that
                     move are then set to what they reach by its end, others are held. Else they are
                     set to what they are at its start, and a forecast tells the rest */
    double last_length; /* s, of the last step; 0 before the first */
    double length_before; /* s, of the step before it; 0 before the second */
    double confidence;  /* of error bounds, a variable */
    uint64_t n_phases;  /* phases that steps of the last length come through; 0: too many */
    double credit;      /* times that a phase may take in all its samples anew, where its outputs can
                           be interpolated instead */
    uint64_t concluded; /* number of the step whose bound SlideState.ahead has; or 0 */
    uint64_t estimated; /* the same of its estimate */
    uint64_t now;       /* place of SlideState.phases behind the outputs */
    uint64_t before;    /* place in SlideState.before.predictor */
    uint64_t forecast;  /* place in SlideState.before.forecast */
    uint64_t n_looked;  /* samples that the predictor looked at, if it saw all of them anew; else 0 */
    uint64_t n_since;   /* samples that this took in since what SlideState.before has; 0: all are
                           others */
    double outside;     /* s of the inner time, when the newest sample, taken between phases, was out
                           of range last; or -infinity */
    double doubt;       /* s of the inner time, until when inputs did what samples do not show: they
                           jumped where they move in the training; or -infinity */
    uint32_t mode;      /* SlideMode of instance.h */
    uint32_t current;   /* outputs belong to the present state */
    uint32_t moving;    /* the inputs of the next step have derivatives that count: not all zero, or
                           in the place of a forecast */
    uint32_t moved;     /* those of the last step had */
    uint32_t between;   /* are the outputs interpolated between phases? */
} SlideHead;

/* Most of SlideHead.credit: enough for an importer that changes to another step. */
#define SLIDE_MOST_CREDIT 16.0

/* What the last step began with: by it and by the history, derivatives do it again. */
typedef struct {
    double *given; /* [n_inputs], the inputs that were set for it */
    unsigned char *moved; /* [n_inputs], SlideMove of the step before it, when it began */
    SlideForecastState forecast[2]; /* when it began, in place head->forecast; in the other one that
                                       of the step before */
    double *rates; /* [n_inputs], of a step whose inputs moved, their derivatives */
    bool *told;    /* [n_inputs], of such a step: whose derivatives tell how they go on */
    SlideNetworkState predictor[2]; /* of recurrent networks, before head->n_since samples, in place
                                       head->before; in the other one that of the step before */
} SlideBeforeStep;

/* What follows after the open samples, as far as it was found; of the sample after them. */
typedef struct {
    SlideEstimate estimate;
    SlideBoundState bound;
    double *forecast; /* [n_outputs], mean squares of what forecasts of the inputs changed in the
                         outputs lately, relative to their scales; of held inputs SlidePhase.revised */
} SlideAhead;

/* What was before a step; scratch. */
typedef struct {
    void *front;              /* the front of the state's block */
    SlideHistoryUndo history;
    uint64_t n_went_on; /* how often a phase went on in the step. Of the last one: */
    size_t place;       /* in SlideState.phases */
    bool resumed;       /* did it go on by what it had seen before the step? Else this is lost */
    uint64_t n_samples; /* that it had seen */
    double *revised, *kept; /* SlidePhase.revised and kept */
    double *open, *others;  /* [most_open][n_inputs], its open samples, scaled, oldest first, and as
                               the companion sees them */
} SlideUndo;

/* All that changes lies in one flat block, which slide_state_copy saves and restores. It begins with
 * a front of small parts that most steps change, so that one copy of this undoes them. */
typedef struct {
    SlideHead *head;
    double *inputs;  /* [n_inputs], as set last */
    double *rates;   /* [n_inputs], 1/s, derivatives of the inputs, of the next step only */
    bool *told;      /* [n_inputs], which of them count */
    double *initial; /* [n_inputs], before the start, where they are known */
    double *outputs; /* [n_outputs] */
    double *parameters; /* [model->parameters.count], as set last */
    double *acting;     /* [model->parameters.count], those behind the outputs */
    double *tolerances; /* [model->bound.n_outputs], of error bounds that are trusted, in the
                           outputs' units, as set last */
    SlideBeforeStep before;
    SlideForecastState forecast;
    SlideAhead ahead;
    double *window;      /* [memory_length][n_inputs], samples before the start, oldest first */
    double *window_outputs; /* [memory_length][n_outputs], outputs after them, NaN where they are not
                               known; where they show a state */
    SlidePhase phases[SLIDE_MOST_PHASES + 1]; /* [n_phases], and one more: what was before the first
                                              step, while all phases may begin with it */
    SlideHistory history;
    SlideUndo undo;      /* not in the block: what a step that fails takes back */
    size_t size;         /* bytes of the block, which starts at head */
    size_t front;        /* bytes of its front */
    size_t before_steps; /* bytes of it before the steps of the history, its largest part */
} SlideState;

void slide_state_place(SlideState *state, const SlideModel *model, SlideArena *arena);

/* Back to the state after placing: no steps, inputs at their start values. */
void slide_state_reset(const SlideModel *model, SlideState *state);

/* From one block of a state, or a copy of it at any alignment, to another, which then gives the
 * same results. Of the history, only the steps that are there: its room is mostly for many short
 * steps that were never taken. */
void slide_state_copy(const SlideModel *model, const SlideState *state, const void *from, void *to);

/* May the counters and places in a copy of a block, at any alignment, be those of a state? Rings take
 * numbers modulo their sizes, but loops end by counters, which must not be far off. */
bool slide_state_is_sound(const SlideModel *model, const SlideState *state, const void *block);

/* No communication step yet? */
static inline bool slide_stream_fresh(const SlideState *state) {
    return state->head->n_steps == 0;
}

/* Was there one step so far, whose inputs count for all before it? */
static inline bool slide_stream_first_held(const SlideState *state) {
    return state->head->n_steps == 1 && state->head->prehistory == SLIDE_FIRST_HELD;
}

/* What networks have seen for the outputs of now; and that of the time before the first step. */
static inline SlidePhase *slide_now(SlideState *state) { return &state->phases[state->head->now]; }
static inline SlidePhase *slide_start(const SlideModel *model, SlideState *state) {
    return &state->phases[model->n_phases];
}

/* A part of the front as it was before the step. */
static inline void *slide_before_step(const SlideState *state, const void *part) {
    return (unsigned char *)state->undo.front +
           ((const unsigned char *)part - (const unsigned char *)state->head);
}

/* The inputs until now: of the last step, or before the first one. */
const double *slide_stream_reached(const SlideModel *model, const SlideState *state);

/* Are inputs set to what they are at the start of a step? */
static inline bool slide_stream_forecasts(const SlideModel *model, const SlideState *state) {
    return model->history.first_order && state->head->known == 0;
}

/* Are samples before the start known? Of how many this tells slide_stream_n_before; 1 where they are
 * not. */
static inline bool slide_window_is_known(const SlideState *state) {
    return state->head->prehistory >= SLIDE_INITIAL_WINDOW_KNOWN;
}
uint64_t slide_stream_n_before(const SlideModel *model, const SlideState *state);

/* Is the state before the start found by outputs, of which there are none? */
bool slide_stream_lacks_outputs(const SlideModel *model, const SlideState *state);

/* The inputs until the first step, before it. */
const double *slide_stream_prehistory(const SlideModel *model, const SlideState *state);

#endif
