/* A feed-forward network with what it sees: features of samples in a window. */
#ifndef SLIDE_LAYERS_H
#define SLIDE_LAYERS_H

#include "feature_set.h"
#include "feed_forward.h"
#include "network_view.h"

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

/* Of the values that the network gives, only the last n_kept are kept. */
void slide_layers_place(SlideLayers *layers, const SlideNetworkView *view, uint32_t n_kept,
                        SlideArena *arena);
void slide_layers_state_place(SlideLayersState *state, const SlideLayers *layers,
                              SlideArena *arena);

/* Look at a sample by its number: a scaled input and those before it [SLIDE_BEFORE][n_inputs],
 * newest first. False when a feature is not finite; then nothing was written. The place written to
 * holds the oldest sample, which no later window needs. */
bool slide_layers_see(const SlideLayers *layers, SlideLayersState *state, uint64_t sample,
                      const double *input, const double *before);

/* The same when the evaluation goes on in any case: features that are not finite show as values
 * that are not numbers, whatever the layers do to them. */
void slide_layers_see_anyhow(const SlideLayers *layers, SlideLayersState *state, uint64_t sample,
                             const double *input, const double *before);

/* Put back what the last slide_layers_see wrote over, of the same sample. */
void slide_layers_unsee(const SlideLayers *layers, SlideLayersState *state, uint64_t sample);

/* Look at the same input for all samples of the window. */
void slide_layers_fill(const SlideLayers *layers, SlideLayersState *state, const double *input,
                       const double *before);

/* Of features of the whole window [n_samples][seen.count], those of the ages that the network looks
 * at: the window itself, or copies in picked. */
const float *slide_layers_pick(const SlideLayers *layers, const float *window, float *picked);

/* What the network looks at after a sample. */
const float *slide_layers_window(const SlideLayers *layers, const SlideLayersState *state,
                                 uint64_t sample);

/* The values after a sample; they stay valid until the next evaluation. */
const float *slide_layers_evaluate(const SlideLayers *layers, const SlideKernel *kernel,
                                   const SlideLayersState *state, uint64_t sample);

/* The same, all of them, after slide_feed_forward_place_block. */
const float *slide_layers_block(const SlideLayers *layers, const SlideKernel *kernel,
                                const SlideLayersState *state, uint64_t sample);

#endif
