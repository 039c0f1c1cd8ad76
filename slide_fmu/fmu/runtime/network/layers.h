/* A feed-forward network with what it sees: features of samples in a window. */
#ifndef SLIDE_LAYERS_H
#define SLIDE_LAYERS_H

#include "feed_forward.h"

typedef struct {
    size_t n_slots;  /* of the ring: one more than the window has samples, so that seeing a sample
                        leaves the window before it as it was */
    uint32_t n_ages; /* 0: the whole window is looked at */
    uint32_t *ages;  /* [n_ages], samples that are looked at, 0 the newest, oldest first */
    float *picked;   /* scratch [2][n_ages][seen.count] */
    SlideFeedForward stack;
} SlideLayers;

/* All that changes; part of the flat state block. */
typedef struct {
    float *ring; /* [2 n_slots][seen.count]; the features of every sample are written twice, n_slots
                    slots apart, so that each window lies in one piece */
} SlideLayersState;

/* Scratch in double precision. */
typedef struct {
    double *window;  /* [n_samples][seen.count], features of the samples that are looked at */
    double *back[2]; /* values of a layer and of the one before it */
    double *values;  /* [2][n_values]: values, and truncation errors, which are zero */
} SlideExactLayers;

/* The family, the only one of error estimators; see network.h. */
extern const struct SlideFamily slide_feed_forward_family;

/* The values after two samples that were seen, by their numbers, as evaluate of the family gives
 * each. */
struct SlideNetwork;
void slide_layers_evaluate_two(const struct SlideNetwork *network, const SlideKernel *kernel,
                               const SlideLayersState *state, uint64_t first, uint64_t second,
                               const float *values[2]);

#endif
