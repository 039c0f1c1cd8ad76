/* Layers in a surrogate file (byte contract: slide_fmu/network/feed_forward/bytes.py) and in the
 * layout of the kernels. */
#ifndef SLIDE_FEED_FORWARD_H
#define SLIDE_FEED_FORWARD_H

#include "arena.h"
#include "kernel.h"
#include "reading.h"

/* All pointers point into the bytes that were read; their extent has been checked. */
typedef struct {
    uint32_t n_samples, n_values, n_layers;
    SlideIndices ages;           /* samples that are looked at, 0 the newest; none: all */
    uint32_t n_first;            /* samples that are looked at, times n_features */
    const unsigned char *layers; /* the first layer; the others follow */
    const unsigned char *skip;   /* f32 [n_values][n_first], or NULL */
} SlideLayersView;

/* Check layers on so many features of a sample, and describe them. */
void slide_layers_read(SlideLayersView *layers, uint32_t n_features, SlideCursor *cursor);

typedef struct {
    size_t n_in, n_panels;
    uint32_t activation;
    float *weights; /* [panel][n_in][SLIDE_PANEL], zeros where no output is */
    float *bias;    /* [panel][SLIDE_PANEL] */
} SlideLayer;

/* The rows of the last layer and of the linear path come in another order than in the file: those
 * of the n_kept values of the newest sample first, so that they can be evaluated alone. */
typedef struct {
    uint32_t n_layers;
    SlideLayer *layers;
    SlideLayer skip; /* no panels when there is no linear path */
    size_t widest;   /* panels of the widest layer */
    size_t n_values, n_kept;
    float *scratch[2]; /* each of two rows of the widest layer */
    float *block; /* scratch [n_values] */
} SlideFeedForward;

/* Place a network in the arena. While the arena measures, the network is not usable. */
void slide_feed_forward_place(SlideFeedForward *network, const SlideLayersView *view,
                              uint32_t n_kept, SlideArena *arena);

/* Evaluate on the features of n_samples samples, oldest first; the n_kept values stay valid until
 * the next evaluation. */
const float *slide_feed_forward_evaluate(const SlideFeedForward *network,
                                         const SlideKernel *kernel, const float *window);

/* The same on two windows, to the bit as of each: weights are read once for both. */
void slide_feed_forward_evaluate_two(const SlideFeedForward *network, const SlideKernel *kernel,
                                     const float *const windows[2], const float *values[2]);

/* The same of all values, in the file's order. */
const float *slide_feed_forward_block(const SlideFeedForward *network, const SlideKernel *kernel,
                                      const float *window);

#endif
