/* Reader of one network in a surrogate file; byte contract: slide_fmu/payload.py. */
#ifndef SLIDE_NETWORK_VIEW_H
#define SLIDE_NETWORK_VIEW_H

#include "bytes.h"

typedef enum { SLIDE_FEED_FORWARD = 1, SLIDE_STATE_SPACE = 2 } SlideKind;

/* All pointers point into the bytes that were read; their extent has been checked. */
typedef struct {
    uint32_t n_in, n_out, activation;
    const unsigned char *weights; /* f32 [n_out][n_in] */
    const unsigned char *bias;    /* f32 [n_out] */
} SlideLayerView;

typedef struct {
    uint32_t n_layers, n_first;  /* n_first = n_samples * n_inputs */
    const unsigned char *layers; /* the first layer; the others follow */
    const unsigned char *skip;   /* f32 [n_values][n_first], or NULL */
} SlideLayersView;

typedef struct {
    uint32_t n_out, n_states, n_units, n_features, activation, differences;
    const unsigned char *feature_scale; /* f32 [n_features] */
    const unsigned char *a, *b, *e;     /* f32 [n_states][n_states], [n_features], [n_units] */
    const unsigned char *w;             /* f32 [n_units][n_states + n_features + 1] */
    const unsigned char *c, *d, *d0;    /* f32 [n_values][n_states], [n_features], [] */
} SlideCellView;

typedef struct {
    uint32_t kind, n_samples, n_values;
    SlideLayersView layers; /* of kind SLIDE_FEED_FORWARD */
    SlideCellView cell;     /* of kind SLIDE_STATE_SPACE */
} SlideNetworkView;

/* Check a network and describe it. False, with a message, when it must not be used. */
bool slide_network_read(SlideNetworkView *network, uint32_t n_inputs, SlideCursor *section,
                        SlideMessage *message);

/* Describe the layer at a place of a checked network; gives the place of the next one. */
const unsigned char *slide_layer_view(const unsigned char *at, SlideLayerView *layer);

#endif
