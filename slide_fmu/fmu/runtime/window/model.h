/* What does not change while an FMU instance runs: sizes, scalings, start values, networks. */
#ifndef SLIDE_MODEL_H
#define SLIDE_MODEL_H

#include "bound.h"
#include "estimate.h"
#include "forecast.h"
#include "history.h"
#include "network.h"

typedef struct {
    double offset, scale, factor; /* factor: 1 / scale */
} SlideScaling;

typedef struct {
    double step; /* s */
    uint32_t n_inputs, n_outputs;
    uint32_t n_in;      /* samples of the window */
    bool *cosine;       /* [n_inputs]: is it of an angle, with its sine in the next input? */
    uint32_t memory_length; /* newest samples that any result depends on */
    uint32_t n_redone;      /* samples with which the last step can be done again; first-order
                               hold: with the one before it, whose true end may come with it */
    SlideScaling *input_scaling, *output_scaling;
    double *starts; /* [n_inputs], physical: inputs before the first is set */
    SlideNetwork predictor;
    SlideParameters parameters; /* that its weights follow */
    SlideEstimator estimator;
    SlideBound bound;
    SlideBound plain_bound; /* the one in the plain call; only numbers and head may be others */
    SlideSamplesShape samples;
    SlideHistoryShape history;
    SlideForecast forecast;
    bool at_step_end; /* start value of SlideHead.at_step_end */
    bool has_output_ranges;
    double *output_ranges; /* [n_outputs][low, high] in the training, physical */
    double *inputs;    /* scratch [n_inputs]: a sample, in physical units */
    double *taken;     /* scratch [n_redone][n_inputs]: samples that a step takes in and those
                          before, scaled, newest first */
    double *candidate; /* scratch [n_outputs]: a result before it is accepted */
    float *predicted;  /* scratch [n_outputs]: the same as the network gave it, scaled */
    const SlideKernel *kernel;
    char guid[48];
} SlideModel;

/* Place a checked payload in the arena. While the arena measures, the model is not usable. */
void slide_model_place(SlideModel *model, const SlidePayload *payload, SlideArena *arena);

/* Form the predictor's weights for values [parameters.count], if they are those of others. */
static inline void slide_model_form(const SlideModel *model, const double *values) {
    if (model->parameters.count > 0) {
        slide_parameters_form(&model->parameters, &model->predictor.of.cells.terms, values);
    }
}

/* An input as the networks see it. */
static inline double slide_scaled(const SlideModel *model, size_t input, double value) {
    const SlideScaling *scaling = &model->input_scaling[input];
    return (value - scaling->offset) * scaling->factor;
}

#endif
