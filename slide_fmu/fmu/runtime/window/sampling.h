/* Samples of the inputs, one sample step apart, from the communication steps that are remembered. */
#ifndef SLIDE_SAMPLING_H
#define SLIDE_SAMPLING_H

#include "state.h"

/* So many samples, the newest of which ends some time (s) before the present, come into
 * model->taken, scaled, newest first. */
void slide_sample(const SlideModel *model, const SlideState *state, uint64_t count, double before);

/* What is known of the inputs before the first step becomes the history. */
void slide_sampling_recall(const SlideModel *model, SlideState *state);

/* Of these, the sample of an age, 0 the newest. */
static inline SlideSample slide_sample_taken(const SlideModel *model, uint64_t age) {
    const double *inputs = model->taken + age * model->n_inputs;
    return (SlideSample){inputs, model->others.capacity > 0
                                     ? model->others_taken + age * model->n_inputs
                                     : inputs};
}

/* A sample as the networks see it. */
static inline void slide_sampling_scale(const SlideModel *model, const double *inputs,
                                        double *sample) {
    for (size_t i = 0; i < model->n_inputs; ++i) {
        sample[i] = slide_scaled(model, i, inputs[i]);
    }
}

#endif
