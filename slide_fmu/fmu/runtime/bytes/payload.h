/* Reader of a surrogate file. The byte contract and the writer are slide_fmu/surrogate/payload.py;
 * both readers reject the same files, except that this one skips the metadata. */
#ifndef SLIDE_PAYLOAD_H
#define SLIDE_PAYLOAD_H

#include "network.h"

/* Bytes of a channel's numbers; what an input is of an angle, the sine next to its cosine. */
enum { SLIDE_INPUT_ROW = 32, SLIDE_OUTPUT_ROW = 16 };
typedef enum { SLIDE_NO_ANGLE, SLIDE_COSINE, SLIDE_SINE } SlideAngle;

/* How inputs that move go on (window/forecast.h); without candidates they are held. */
typedef struct {
    bool at_step_end; /* does a value that is set count as reached by the end of the step? */
    bool jumps;       /* did inputs of the training jump between samples? */
    uint32_t n_candidates, n_past, n_scored;
    const unsigned char *rows; /* f64 [n_inputs][1 + n_candidates * n_past] */
} SlideForecastView;

/* Of an error bound (network/bound.h). Means are over so many whole blocks of samples, and over the
 * block that has begun; factors are calibrated for so many confidences. */
enum { SLIDE_BLOCKS = 8, SLIDE_CONFIDENCES = 3 };

typedef struct {
    uint32_t blocks[2]; /* samples in a short and in a long block */
    uint32_t n_seen;    /* states of the companion and features that drive it */
    const unsigned char *factors;    /* f64 [SLIDE_CONFIDENCES][n_outputs] */
    const unsigned char *limits;     /* f64 [2 * n_outputs + n_seen] */
    const unsigned char *tolerances; /* f64 [n_outputs], of bounds that are trusted */
    const unsigned char *floors;     /* f64 [n_outputs], of bounds */
    const unsigned char *shares;     /* f64 [n_outputs], of the disagreement */
    const unsigned char *doubt;      /* f64, of what held inputs do between samples */
    SlideNetworkView companion;      /* state space */
    SlideNetworkView head;           /* feed-forward, of [2 * n_seen + 3 * n_outputs] statistics,
                                        and [n_outputs] more with an error estimator */
    const unsigned char *quietest;   /* f64 of every logarithm that the head gets */
    uint32_t span_block;             /* samples in a block of its error estimate; 0 without one */
    const unsigned char *span_factors; /* f64 [n_outputs] */
} SlideBoundView;

/* Samples in the longest window. */
enum { SLIDE_MAX_WINDOW = 1 << 20 };

/* All pointers point into the bytes that were read; their extent has been checked. */
typedef struct {
    double step; /* s */
    uint32_t n_in, n_out, n_inputs, n_outputs;
    bool first_order; /* first-order hold: inputs move linearly to their new value; else they are
                         held */
    const unsigned char *input_scaling;  /* [n_inputs]: f64 offset, scale, start, u32 hold, angle */
    const unsigned char *output_scaling; /* f64 [n_outputs][offset, scale] */
    SlideNetworkView predictor;
    SlideParametersView parameters; /* that its weights follow; count is 0 without any */
    bool has_estimator;
    double low, high; /* decimal exponents of the log error map */
    uint32_t positions;         /* squared errors that are averaged, as far apart as samples */
    SlideNetworkView estimator; /* feed-forward */
    const unsigned char *ranges; /* f32 [2][its features], least and largest values */
    bool has_bound;
    SlideBoundView bound;
    SlideForecastView forecast;
    const unsigned char *output_ranges; /* f64 [n_outputs][low, high] in the training, or NULL */
    char guid[48]; /* derived from the bytes, as in slide_fmu/fmu/description/fmi2.py */
} SlidePayload;

/* What an input is of an angle. */
static inline SlideAngle slide_angle_of(const SlidePayload *payload, size_t input) {
    return (SlideAngle)slide_u32(payload->input_scaling + SLIDE_INPUT_ROW * input + 28);
}

/* Check all bytes and describe them. False, with a message, when the file must not be used. */
bool slide_payload_read(SlidePayload *payload, const unsigned char *data, size_t size,
                        SlideMessage *message);

#endif
