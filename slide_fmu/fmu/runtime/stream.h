/* The moving part: the window of past inputs and one evaluation per communication step. */
#ifndef SLIDE_STREAM_H
#define SLIDE_STREAM_H

#include "model.h"

/* Fixed-size head of the state; the arrays follow it in the same block. */
typedef struct {
    double start_time; /* s */
    uint64_t steps;    /* steps done; the newest input sits in slot (steps - 1) % capacity */
    uint32_t mode;     /* SlideMode of instance.h */
    uint32_t current;  /* outputs belong to the present state */
} SlideHead;

/* All that changes lies in one flat block: saving and restoring are copies of it. */
typedef struct {
    SlideHead *head;
    double *inputs;  /* [n_inputs], as set last */
    double *outputs; /* [n_outputs] */
    double *errors;  /* [n_outputs], error estimates; none without estimator */
    double *squares; /* [positions][n_outputs], squared errors over scale, a ring over the steps */
    float *ring;     /* [2 capacity][n_inputs], scaled; every sample is written twice, capacity
                        slots apart, so that each window lies in one piece */
    size_t size;     /* bytes of the block, which starts at head */
} SlideState;

void slide_state_place(SlideState *state, const SlideModel *model, SlideArena *arena);

/* Back to the state after placing: no steps, inputs at their start values. These are as near to 0 as
 * offset -+ scale, the range of the input, allows; model_description.py counts them likewise. */
void slide_state_reset(const SlideModel *model, SlideState *state);

/* Is this a value that the network can take in: finite, also after scaling? */
bool slide_input_usable(const SlideModel *model, size_t input, double value);

/* Evaluate as if the present inputs had been held for ever. Before the first step only. */
bool slide_stream_hold(const SlideModel *model, SlideState *state);

/* One step: take in the present inputs, give the outputs one step later. False when the result is
 * not finite; then steps, outputs and errors are what they were. */
bool slide_stream_step(const SlideModel *model, SlideState *state);

#endif
