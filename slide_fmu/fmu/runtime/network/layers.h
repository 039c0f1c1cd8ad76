/* A feed-forward network with what it sees: features of samples in a window. */
#ifndef SLIDE_LAYERS_H
#define SLIDE_LAYERS_H

#include "feature_set.h"
#include "feed_forward.h"

typedef struct {
    uint32_t n_samples; /* of the window */
    SlideFeatures seen;
    float *features; /* scratch [seen.count] */
    float *replaced; /* scratch [seen.count], what slide_layers_see wrote over */
    uint32_t n_ages; /* 0: the whole window is looked at */
    uint32_t *ages;  /* [n_ages], samples that are looked at, 0 the newest, oldest first */
    float *picked;   /* scratch [n_ages][seen.count] */
    SlideFeedForward stack;
} SlideLayers;

/* All that changes; part of the flat state block. */
typedef struct {
    float *ring; /* [2 n_samples][seen.count]; the features of every sample are written twice,
                    n_samples slots apart, so that each window lies in one piece */
} SlideLayersState;

/* The family, whose functions see, evaluate and keep layers; see network.h. */
extern const struct SlideFamily slide_feed_forward_family;

/* Look at a sample when the evaluation goes on in any case: features that are not finite show as
 * values that are not numbers, whatever the layers do to them. */
void slide_layers_see_anyhow(const SlideLayers *layers, SlideLayersState *state, uint64_t sample,
                             const double *input, const double *before);

#endif
