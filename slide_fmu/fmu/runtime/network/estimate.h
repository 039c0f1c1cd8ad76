/* Error estimates: of the newest positions, the root of the mean square of what the estimator
 * gives. A step only remembers its samples; they are evaluated when an estimate is read. Whenever
 * and however often that is, the estimate is the same, bit by bit. */
#ifndef SLIDE_ESTIMATE_H
#define SLIDE_ESTIMATE_H

#include "payload.h"
#include "samples.h"

typedef struct {
    uint32_t positions; /* 0 without an estimator; then there is nothing else */
    uint32_t n_outputs;
    uint32_t n_means; /* expected errors that the network gives before the exponents */
    uint64_t memory_length; /* newest samples that an estimate depends on */
    double log_middle, log_half_range, largest; /* largest: squared error */
    float *ranges; /* [2][features], least and largest values of the training */
    SlideNetwork network; /* feed-forward */
} SlideEstimator;

/* All that changes; part of the flat state block. */
typedef struct {
    uint64_t *known;  /* samples that are evaluated, or too old to be needed: all below a number */
    double *squares;  /* [n_outputs][positions], squared errors; sample k in k % positions */
    double *errors;   /* [n_outputs], the estimates at the newest sample; both relative to the scale
                         of the output */
    double *newest;   /* [n_outputs], the square at it */
    SlideNetworkState network;
    size_t evaluated; /* bytes from known on */
} SlideEstimate;

void slide_estimator_place(SlideEstimator *estimator, const SlidePayload *payload,
                           SlideArena *arena);
void slide_estimate_place(SlideEstimate *estimate, const SlideEstimator *estimator,
                          SlideArena *arena);

/* Nothing is known any more. */
void slide_estimate_restart(const SlideEstimator *estimator, SlideEstimate *estimate);

/* Samples from this number on are taken back. Where some of them are evaluated, which open ones are
 * only if sample 0 is among them, all is evaluated anew. */
void slide_estimate_take_back(const SlideEstimator *estimator, SlideEstimate *estimate,
                              uint64_t count);

/* Form the estimates at the last of the first n_ahead samples: of these, n_known are evaluated and
 * kept, where they are not known yet, and at most one that comes after them is evaluated alone. Kept
 * must be memory_length samples before the last one, and those before them. */
void slide_estimate_form(const SlideEstimator *estimator, const SlideKernel *kernel,
                         const SlideSamplesShape *shape, const SlideSamples *samples,
                         uint64_t n_known, uint64_t n_ahead, SlideEstimate *estimate);

/* The squared error, relative to the output's scale, of an expected error over the standard
 * deviation and an eps: at most the largest that the map knows, also of what is not finite. */
double slide_squared_error(const SlideEstimator *estimator, double mean, double eps);

/* The square of an output at one of the newest samples that are known. */
double *slide_estimate_square(const SlideEstimator *estimator, const SlideEstimate *estimate,
                              size_t output, uint64_t sample);

#endif
