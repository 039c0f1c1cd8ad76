/* Many windows at once, over the same kernels as single steps: for predictions outside of FMI. */
#ifndef SLIDE_BATCH_H
#define SLIDE_BATCH_H

#include "network.h"

/* Layers on rows of features, [count] of them, each as wide as the first layer; they may overlap.
 * values: [count][n_values], all that the network gives. False when there is no memory for it;
 * nothing but values is changed, so that threads may share the network. */
bool slide_batch_layers(const SlideFeedForward *network, const SlideKernel *kernel,
                        const float *const *rows, size_t count, size_t n_values, float *values);

#endif
