/* What a communication step takes in of the inputs: the steps of the history, and samples of it. */
#ifndef SLIDE_INTAKE_H
#define SLIDE_INTAKE_H

#include "state.h"

/* What a step takes in: samples one h apart, or all that the networks see anew. */
typedef struct {
    uint32_t count; /* the newest so many of model->taken */
    bool anew; /* all, but for the newest n_after, which came one by one */
    bool settled; /* what was before are its inputs, held for ever */
    uint32_t n_after;
} SlideIntake;

/* The step that begins now, of state->head->last_length under state->inputs, becomes the newest of
 * the history, and the samples that it takes in come into model->taken; with those that the true
 * end of the step before takes in, where inputs are set to what they are at the start. */
SlideIntake slide_stream_take_in(const SlideModel *model, SlideState *state);

/* Its parts. What is known of the inputs before the first step becomes the history. */
void slide_intake_recall(const SlideModel *model, SlideState *state);

/* So many newest samples up to the end of the newest step of the history come into model->taken;
 * from: NULL, or the inputs that move evenly over these samples to those of this step. */
void slide_intake_sample(const SlideModel *model, const SlideState *state, uint32_t count,
                         const double *from);

/* Samples one h apart in a step of a length in s; 0: it has no whole number of them. */
uint32_t slide_intake_whole(const SlideModel *model, double length);

/* A step under inputs that are those of all of it, or that it reaches by its end. */
SlideIntake slide_intake_step(const SlideModel *model, SlideState *state);

/* Where inputs are set to what they are at the start: they are the true end of the step before, of
 * state->head->reached_length. Before the first one, they count as held for ever, or come a sample
 * step after what is known of those until then. */
SlideIntake slide_intake_end(const SlideModel *model, SlideState *state);

/* Then they move to where they are expected at the end of this step, which is kept in
 * state->goal. */
SlideIntake slide_intake_forecast(const SlideModel *model, SlideState *state);

/* A sample as the networks see it. */
static inline void slide_intake_scale(const SlideModel *model, const double *inputs,
                                      double *sample) {
    for (size_t i = 0; i < model->n_inputs; ++i) {
        sample[i] = slide_scaled(model, i, inputs[i]);
    }
}

#endif
