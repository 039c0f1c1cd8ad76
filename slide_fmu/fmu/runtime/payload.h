/* Reader of a surrogate file. The byte contract and the writer are slide_fmu/payload.py; both
 * readers reject the same files, except that this one skips the metadata. */
#ifndef SLIDE_PAYLOAD_H
#define SLIDE_PAYLOAD_H

#include "bytes.h"

/* All pointers point into the bytes that were read; their extent has been checked. */
typedef struct {
    uint32_t n_in, n_out, activation;
    const unsigned char *weights; /* f32 [n_out][n_in] */
    const unsigned char *bias;    /* f32 [n_out] */
} SlideLayerView;

typedef struct {
    uint32_t n_samples, n_layers, n_values;
    uint32_t n_first;            /* n_samples * n_inputs */
    const unsigned char *layers; /* the first layer; the others follow */
    const unsigned char *skip;   /* f32 [n_values][n_first], or NULL */
} SlideNetworkView;

typedef struct {
    double step; /* s */
    uint32_t n_in, n_out, n_inputs, n_outputs;
    const unsigned char *input_scaling;  /* f64 [n_inputs][offset, scale] */
    const unsigned char *output_scaling; /* f64 [n_outputs][offset, scale] */
    SlideNetworkView predictor;
    bool has_estimator;
    double low, high; /* decimal exponents of the log error map */
    uint32_t positions;
    SlideNetworkView estimator;
    char guid[48]; /* derived from the bytes, as in slide_fmu/fmu/model_description.py */
} SlidePayload;

/* Check all bytes and describe them. False, with a message, when the file must not be used. */
bool slide_payload_read(SlidePayload *payload, const unsigned char *data, size_t size,
                        SlideMessage *message);

/* Describe the layer at a place of a checked network; gives the place of the next one. */
const unsigned char *slide_layer_view(const unsigned char *at, SlideLayerView *layer);

#endif
