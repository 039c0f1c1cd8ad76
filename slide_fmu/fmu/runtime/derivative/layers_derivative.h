/* The derivative of a feed-forward network in one direction (forward mode), at the window that the
 * state holds. */
#ifndef SLIDE_LAYERS_DERIVATIVE_H
#define SLIDE_LAYERS_DERIVATIVE_H

#include "layers.h"

/* All scratch. */
typedef struct {
    float *window;    /* [n_samples][seen.count], slopes of the features, oldest first */
    float *picked;    /* [n_ages][seen.count], of those that are looked at */
    double *slopes;   /* [seen.count], of one sample */
    float *values[2]; /* slopes of what a layer gives, as SlideFeedForward.scratch */
    float *zeros;     /* of the same size */
} SlideLayersDerivative;

void slide_layers_derivative_place(SlideLayersDerivative *derivative, const SlideLayers *layers,
                                   SlideArena *arena);

/* No feature of the window depends on anything yet. */
void slide_layers_derivative_start(const SlideLayers *layers,
                                   const SlideLayersDerivative *derivative);

/* An input of some age (0: the newest) and its derivative; scaled, with those before it. */
void slide_layers_derivative_see(const SlideLayers *layers,
                                 const SlideLayersDerivative *derivative, uint64_t age,
                                 const double *input, const double *d_input);

/* Slopes of the values after a sample, whose window the state holds. */
const float *slide_layers_derivative_evaluate(const SlideLayers *layers,
                                              const SlideLayersDerivative *derivative,
                                              const SlideKernel *kernel,
                                              const SlideLayersState *state, uint64_t sample);

#endif
