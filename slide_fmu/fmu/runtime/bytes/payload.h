/* Reader of a surrogate file. The byte contract and the writer are slide_fmu/surrogate/payload.py; both
 * readers reject the same files, except that this one skips the metadata. */
#ifndef SLIDE_PAYLOAD_H
#define SLIDE_PAYLOAD_H

#include "network_view.h"

/* Bytes of a channel's numbers. */
enum { SLIDE_INPUT_ROW = 24, SLIDE_OUTPUT_ROW = 16 };

/* All pointers point into the bytes that were read; their extent has been checked. */
typedef struct {
    double step; /* s */
    uint32_t n_in, n_out, n_inputs, n_outputs;
    bool ramp; /* inputs move linearly to their new value, else they are held */
    const unsigned char *input_scaling;  /* f64 [n_inputs][offset, scale, start] */
    const unsigned char *output_scaling; /* f64 [n_outputs][offset, scale] */
    SlideNetworkView predictor;
    bool has_estimator;
    double low, high; /* decimal exponents of the log error map */
    uint32_t positions;         /* squared errors that are averaged, as far apart as samples */
    SlideNetworkView estimator; /* feed-forward */
    const unsigned char *ranges; /* f32 [2][its features], least and largest values */
    char guid[48]; /* derived from the bytes, as in slide_fmu/fmu/description/fmi2.py */
} SlidePayload;

/* Check all bytes and describe them. False, with a message, when the file must not be used. */
bool slide_payload_read(SlidePayload *payload, const unsigned char *data, size_t size,
                        SlideMessage *message);

#endif
