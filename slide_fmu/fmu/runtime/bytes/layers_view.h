/* Reader of a feed-forward network in a surrogate file; byte contract:
 * slide_fmu/network/bytes.py. */
#ifndef SLIDE_LAYERS_VIEW_H
#define SLIDE_LAYERS_VIEW_H

#include "reading.h"

/* All pointers point into the bytes that were read; their extent has been checked. */
typedef struct {
    uint32_t n_in, n_out, activation;
    const unsigned char *weights; /* f32 [n_out][n_in] */
    const unsigned char *bias;    /* f32 [n_out] */
} SlideLayerView;

typedef struct {
    uint32_t n_samples, n_values, n_layers;
    SlideIndices ages;           /* samples that are looked at, 0 the newest; none: all */
    uint32_t n_first;            /* samples that are looked at, times n_features */
    const unsigned char *layers; /* the first layer; the others follow */
    const unsigned char *skip;   /* f32 [n_values][n_first], or NULL */
} SlideLayersView;

void slide_layers_read(SlideLayersView *layers, uint32_t n_features, SlideCursor *cursor);

/* Describe the layer at a place of a checked network; gives the place of the next one. */
const unsigned char *slide_layer_view(const unsigned char *at, SlideLayerView *layer);

#endif
