/* The error bound: what this step's error stays below, and whether its inputs are known. The
 * definition is in slide_fmu/surrogate/error_bound.py. A companion, a second state-space network,
 * goes on beside the predictor; how far both are apart and what the companion sees are statistics
 * of a sample, from which the head, a small network, gives a local scale of the error.
 *
 * A step only remembers its samples and what the predictor gave; the rest is evaluated when a
 * result is read. Whenever and however often that is, it is the same, bit by bit: the companion's
 * younger state begins anew at the samples 1 + j * n_samples, and blocks of the means at samples
 * j * length, where the sample 0 is the one that counts for all before it. */
#ifndef SLIDE_BOUND_H
#define SLIDE_BOUND_H

#include "block_means.h"
#include "samples.h"

/* What does not change. Statistics: [n_seen] states and features that drive the companion, then
 * logarithms of [3][n_outputs] squared disagreements, of [n_seen] mean squares and, where the head
 * sees what the error estimator expects, of [n_outputs] squared errors of this sample. */
typedef struct {
    uint64_t memory_length; /* newest samples that a result depends on; 0 without a bound, then
                               there is nothing else */
    uint64_t filling_length; /* newest samples that must be known for a result to count */
    uint64_t span_length;    /* newest samples that must be known for an error estimate made of
                                expected errors to count; 0 without one */
    size_t n_outputs;       /* 0 without a bound */
    size_t n_states, n_seen;
    size_t n_expected;      /* squared errors that the head sees: n_outputs, or 0 */
    uint64_t n_predicted;   /* samples for which the predictor's values are kept, a power of two */
    SlideBlocksShape of_short, of_long, of_seen; /* blocks of squared disagreements [n_outputs], and
                                                    long ones of squares of what is seen [n_seen] */
    SlideBlocksShape of_span; /* blocks of squared errors that the head expects [n_outputs], for
                                 an error estimate; length 0 without one */
    double *span_factors;   /* [n_outputs], of the root of their means */
    double *factors;        /* [SLIDE_CONFIDENCES][n_outputs] */
    double *tolerances;     /* [n_outputs], of bounds that are trusted, relative to the scales */
    double *floors;         /* [n_outputs], below which no bound is, relative to the scales */
    double *shares;         /* [n_outputs], of the disagreement, which no bound is below */
    double doubt;           /* where held inputs change within samples (window/sampling.h), so much of what
                               one polynomial more would change may be wrong; where moving ones jump, so
                               much of the jump comes later for the companion (window/jumps.h) */
    double *quietest;       /* logarithms that the head gets at least */
    double *limits;         /* [2 * n_outputs + n_seen], one over those of the means, in the order
                               of the blocks */
    SlideNetwork companion; /* state space */
    SlideNetwork head;      /* feed-forward, of one sample: it needs no state; local scales of all
                               outputs and, for an error estimate, their expected errors */
    double *statistics;     /* scratch [1 + SLIDE_BEFORE][statistics], the later ones zeros */
    double *squares;        /* scratch [the larger of n_outputs and n_seen], of a sample */
    double *means;          /* scratch [2 * n_outputs + n_seen] */
    double *expected;       /* scratch [n_expected] */
} SlideBound;

/* All that changes; part of the flat state block. What is evaluated lies in one piece. */
typedef struct {
    float *predicted;   /* [n_predicted][n_outputs], the predictor's values after the sample k in
                           place k % n_predicted; NAN where it gave none */
    uint64_t *known;    /* samples that are evaluated, or too old to be needed: below a number */
    SlideNetworkState companion;
    SlideBlocks of_short, of_long, of_seen, of_span;
    double *apart_squared; /* [n_outputs], squared disagreements of the last of the known samples;
                              0 where the predictor gave nothing */
    double *seen;          /* [n_seen], what the companion sees at it */
    uint64_t *concluded;   /* the results are those after so many samples: */
    double *scales;    /* [n_outputs], local scales of the error */
    double *apart;     /* [n_outputs], the disagreement */
    double *estimates; /* [n_outputs], of the error over a span; all relative to the output's scale */
    double *novelty;   /* [1], 1 at the edge of the domain */
    size_t evaluated;  /* bytes from known on */
} SlideBoundState;

void slide_bound_place(SlideBound *bound, const SlidePayload *payload, SlideArena *arena);

void slide_bound_place_state(SlideBoundState *state, const SlideBound *bound, SlideArena *arena);

/* Nothing is known any more. */
void slide_bound_restart(const SlideBound *bound, SlideBoundState *state);

/* Samples from this number on are taken back, as of estimates (estimate.h). */
void slide_bound_take_back(const SlideBound *bound, SlideBoundState *state, uint64_t count);

/* What the predictor gave after a sample, scaled [n_outputs]; NULL: nothing. */
void slide_bound_remember(const SlideBound *bound, SlideBoundState *state, uint64_t sample,
                          const float *values);

/* Where that is kept. */
float *slide_bound_predicted(const SlideBound *bound, const SlideBoundState *state,
                             uint64_t sample);

/* Evaluate companion and means for all of the first count samples that are not known yet. Kept must
 * be memory_length samples before the last of them, and those before them. */
void slide_bound_catch_up(const SlideBound *bound, const SlideKernel *kernel,
                          const SlideSamplesShape *shape, const SlideSamples *samples,
                          uint64_t count, SlideBoundState *state);

/* Form local scales, disagreement and novelty at the last sample that was evaluated
 * (bound_results.c). The scratch holds what the error estimator expects of it, where the head sees
 * that. With an error estimate, the scratch squares holds the squared errors that the head expects
 * afterwards. */
void slide_bound_weigh(const SlideBound *bound, const SlideKernel *kernel, SlideBoundState *state);

/* Form all results at the last of the known samples, unless they are there. */
void slide_bound_conclude(const SlideBound *bound, const SlideKernel *kernel,
                          SlideBoundState *state);

/* The least and the largest confidence for which there are bounds, and the usual one. */
#define SLIDE_LEAST_CONFIDENCE 0.9
#define SLIDE_USUAL_CONFIDENCE 0.95
#define SLIDE_LARGEST_CONFIDENCE 0.99

/* The novelty at the last of the known samples: 1 at the edge of the domain. */
double slide_bound_novelty(const SlideBound *bound, const SlideBoundState *state);

/* The bound of an output, relative to its scale, for a confidence between these. It has a floor, is at
 * least a share of the disagreement, outside of the domain a larger one, and grows by what forecasts of the inputs changed in the
 * output lately: forecast, a mean square, relative to the scale too. */
double slide_bound_of(const SlideBound *bound, const SlideBoundState *state, size_t output,
                      double confidence, double forecast);

#endif
