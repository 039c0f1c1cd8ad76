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

typedef struct {
    uint32_t n_layers;
    SlideLayer *layers;
    SlideLayer skip; /* no panels when there is no linear path */
    size_t widest; /* panels of the widest layer */
    float *scratch[2];
    size_t n_older, n_kept;        /* values before those that are kept, where they are wanted */
    SlideLayer older, older_skip;  /* what gives them, in place of the last layer and the skip */
    float *block;                  /* scratch, all values */
} SlideFeedForward;

/* Place a network in the arena; of the values it gives, only the last n_kept are kept (the newest
 * sample of a block). While the arena measures, the network is not usable. */
void slide_feed_forward_place(SlideFeedForward *network, const SlideLayersView *view,
                              uint32_t n_kept, SlideArena *arena);

/* Place what slide_feed_forward_block needs, after the network; with the same arguments. */
void slide_feed_forward_place_block(SlideFeedForward *network, const SlideLayersView *view,
                                    uint32_t n_kept, SlideArena *arena);

/* y = start plus the layer's weights times x; start may be y. */
void slide_layer_affine(const SlideLayer *layer, const SlideKernel *kernel, const float *start,
                        const float *x, float *y);

/* Evaluate on the features of n_samples samples, oldest first; the n_kept values stay valid until
 * the next evaluation. */
const float *slide_feed_forward_evaluate(const SlideFeedForward *network,
                                         const SlideKernel *kernel, const float *window);

/* The same, with the values before those that are kept. */
const float *slide_feed_forward_block(const SlideFeedForward *network, const SlideKernel *kernel,
                                      const float *window);

#endif
