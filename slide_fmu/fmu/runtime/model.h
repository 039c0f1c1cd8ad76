/* What does not change while an FMU instance runs: sizes, scalings, start values, networks. */
#ifndef SLIDE_MODEL_H
#define SLIDE_MODEL_H

#include "history.h"
#include "network.h"
#include "payload.h"

typedef struct {
    double offset, scale;
} SlideScaling;

typedef struct {
    double step; /* s */
    uint32_t n_inputs, n_outputs;
    uint32_t n_in;      /* samples of the window */
    uint32_t positions; /* positions of the error estimator; 0 without one */
    uint32_t n_means;   /* expected errors that the estimator gives before the exponents */
    double log_middle, log_half_range;
    SlideScaling *input_scaling, *output_scaling;
    double *starts; /* [n_inputs], physical: inputs before the first is set */
    SlideNetwork predictor, estimator;
    SlideHistoryShape history;
    double *inputs;    /* scratch [n_inputs]: a sample, in physical units */
    double *sample;    /* scratch [n_inputs]: the same, scaled */
    double *candidate; /* [outputs, squared errors]: a result before it is accepted */
    const SlideKernel *kernel;
    char guid[48];
} SlideModel;

/* Place a checked payload in the arena. While the arena measures, the model is not usable. */
void slide_model_place(SlideModel *model, const SlidePayload *payload, SlideArena *arena);

#endif
