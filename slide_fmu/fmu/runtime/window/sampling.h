/* Samples of the inputs, one sample step apart, from the communication steps that are remembered. */
#ifndef SLIDE_SAMPLING_H
#define SLIDE_SAMPLING_H

#include "state.h"

/* So many samples, the newest of which ends some time (s) before the present, come into
 * model->taken, scaled, newest first.
 *
 * What acts on a system counts by its effect f(t) at the newest end, and a sample by the mean of f in
 * it. So of held inputs that change within a sample the mean alone comes at the wrong time. With the
 * moments (SlideActing), f is taken from the polynomial whose means are those of f in the sample, in the
 * one after it and in three before it, up to its third order; of the newest, in itself and in four
 * before it. So these samples get shares of the moments. */
void slide_sample(const SlideModel *model, const SlideState *state, uint64_t count, double before);

/* The same for a phase that goes on: of samples that are open in it and of new ones. Where
 * phase->head->kept tells so, what acts in the oldest of them is kept, since it stays. What acts in the
 * oldest of those that are open then is kept in turn; false when it is not among them. */
bool slide_sample_phase(const SlideModel *model, const SlideState *state, SlidePhase *phase,
                        uint64_t count, uint64_t n_open, double before);

/* The newest sample and those that features see before it, with the means of the newest one only. */
void slide_sample_newest(const SlideModel *model, const SlideState *state);

/* What is known of the inputs before the first step becomes the history. */
void slide_sampling_recall(const SlideModel *model, SlideState *state);

/* Of these, the sample of an age, 0 the newest. */
static inline SlideSample slide_sample_taken(const SlideModel *model, uint64_t age) {
    const double *inputs = model->taken + age * model->n_inputs;
    return (SlideSample){inputs,
                         model->others.capacity > 0 ? model->others_taken + age * model->n_inputs
                                                    : inputs,
                         model->strays[age]};
}

/* A sample as the networks see it. */
static inline void slide_sampling_scale(const SlideModel *model, const double *inputs,
                                        double *sample) {
    for (size_t i = 0; i < model->n_inputs; ++i) {
        sample[i] = slide_scaled(model, i, inputs[i]);
    }
}

#endif
