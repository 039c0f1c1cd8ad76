/* What does not change while an FMU instance runs: sizes, scalings, start values, networks. */
#ifndef SLIDE_MODEL_H
#define SLIDE_MODEL_H

#include "bound.h"
#include "estimate.h"
#include "first_state.h"
#include "forecast.h"
#include "history.h"
#include "network.h"

/* So many communication steps are told apart in each sample of the past, and as many phases of time,
 * but at most SLIDE_USUAL_PHASES; or as many as there are milliseconds in a sample, up to
 * SLIDE_MOST_PHASES. Scalar sources may be compiled with fewer, at least 2, to need less memory. */
#if !defined(SLIDE_STEPS_PER_SAMPLE)
#define SLIDE_STEPS_PER_SAMPLE 32
#endif
enum { SLIDE_USUAL_PHASES = 10, SLIDE_MOST_PHASES = 20 };

/* Of what networks have seen in a phase of time (phase.h); the arrays are in the state. */
typedef struct {
    double end;       /* s of the inner time, the end of the newest sample */
    double since;     /* samples since the parameters changed; infinite: all have the present ones */
    uint64_t used;    /* number of the communication step that needed it last; 0: it is empty */
    uint64_t strayed; /* number of the sample after the newest one that was out of range; or 0 */
    uint64_t strayed_known; /* the same before the open samples */
    uint64_t strayed_later[SLIDE_SPREAD]; /* before a sample of a number, in place number % SLIDE_SPREAD */
    uint64_t n_open;  /* newest samples of which not all is known yet, so that they are taken back: they
                         end after the last communication point, or what follows changes them */
    uint64_t expected; /* 1: some inputs were expected to move until its end, else they were held */
    uint64_t kept; /* number of the sample after the newest one, if what acts in some samples is kept for
                      when the phase goes on from it; or 0 */
} SlidePhaseHead;

typedef struct {
    double offset, scale, factor; /* factor: 1 / scale */
} SlideScaling;

/* Numbers of what acts in the oldest open samples and in the one before them. */
#define SLIDE_KEPT_SIZE(n_inputs) ((size_t)(SLIDE_SPREAD + 1) * SLIDE_ACTING * (n_inputs))

typedef struct {
    double step; /* s */
    uint32_t n_inputs, n_outputs;
    uint32_t n_in;      /* samples of the window */
    bool *cosine;       /* [n_inputs]: is it of an angle, with its sine in the next input? */
    uint32_t memory_length; /* newest samples that any result depends on */
    uint32_t n_unsettled;   /* newest samples that following ones may change: of held inputs */
    size_t n_kept;      /* numbers in SlidePhase.kept */
    uint32_t most_open;     /* samples that are taken back */
    uint32_t n_redone;      /* samples that a step may take in, and those that results depend on
                               before these */
    uint32_t n_phases;      /* phases of time of which it is kept what networks have seen */
    SlideScaling *input_scaling, *output_scaling;
    double *starts; /* [n_inputs], physical: inputs before the first is set */
    SlideNetwork predictor;
    SlideParameters parameters; /* that its weights follow */
    SlideEstimator estimator;
    SlideBound bound;
    SlideSamplesShape samples;
    SlideSamplesShape others; /* of samples that the companion of the bound sees in their place, where
                                 inputs are held or may jump; or none */
    SlideHistoryShape history;
    SlideForecast forecast;
    bool at_step_end; /* start value of SlideHead.known, of inputs that move */
    bool has_output_ranges;
    double *output_ranges; /* [n_outputs][low, high] in the training, physical */
    double *inputs;    /* scratch [n_inputs]: a sample, in physical units */
    double *end;       /* scratch [n_inputs]: what inputs are at the end of the newest step */
    double *missed;    /* scratch [n_inputs]: how much more was expected of the inputs now set */
    double *corrected; /* scratch [n_inputs], of a sample, see SlideActing */
    double *moments;   /* scratch [n_redone + 1][SLIDE_MOMENTS][n_inputs], the same, newest
                          first */
    double *edges;     /* scratch [n_redone + 1][2][n_inputs], the same */
    bool *strays;      /* scratch [n_redone], does a sample in taken stray from the training? */
    double *others_taken; /* scratch as taken, where there are others: what the companion sees */
    double *taken;     /* scratch [n_redone + 1][n_inputs]: samples that a step takes in and those
                          before, scaled, newest first */
    float *given;      /* scratch [n_outputs]: what a network gave before, scaled */
    double *missing;   /* scratch [n_outputs]: outputs if a forecast misses as much as the last one, scaled */
    double *candidate; /* scratch [n_outputs]: outputs at the present, scaled */
    SlideNetworkState between; /* scratch: a state between phases, of recurrent families */
    SlideFirstState first; /* scratch, where outputs show a state */
    double *known_values;  /* scratch [memory_length][n_outputs], the same: outputs that are known, scaled,
                              oldest first */
    const SlideKernel *kernel;
    char guid[48];
} SlideModel;

/* Place a checked payload in the arena. While the arena measures, the model is not usable.
 * steps_per_sample: as SLIDE_STEPS_PER_SAMPLE. */
void slide_model_place(SlideModel *model, const SlidePayload *payload, uint32_t steps_per_sample,
                       SlideArena *arena);

/* Form the predictor's weights for values [parameters.count], if they are those of others. */
static inline void slide_model_form(const SlideModel *model, const double *values) {
    if (model->parameters.count > 0) {
        slide_parameters_form(&model->parameters, &model->predictor.of.cells.terms, values);
    }
}

/* May outputs before the start show the state there? With parameters it would follow them, too. */
static inline bool slide_shows_state(const SlideModel *model) {
    return slide_is_recurrent(model->predictor.family) && model->parameters.count == 0;
}

/* An input as the networks see it. */
static inline double slide_scaled(const SlideModel *model, size_t input, double value) {
    const SlideScaling *scaling = &model->input_scaling[input];
    return (value - scaling->offset) * scaling->factor;
}

#endif
