#include "bound.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const double MOST_EXPONENT = 60;  /* of the head, to base 2; NaN counts as this */
static const double MOST_NOVELTY = 1e9;  /* NaN counts as this */
static const double SMALLEST = 1e-30;    /* smaller squares count as this in logarithms */

/* Outside of the domain the head extrapolates: the share of the disagreement that a bound is at least
 * grows with the novelty, up to so many times. */
static const double MOST_GROWTH = 6;

/* Of the root mean square of what forecasts of the inputs change in an output, for each confidence:
 * those of a normal distribution, and a little more since few forecasts make the mean. */
static const double FORECAST_FACTORS[SLIDE_CONFIDENCES] = {1.7, 2.0, 3.0};

/* About the logarithm to base 2, linear between its powers: read off the bits of the number in
 * single precision. What is too large for it, or no number, counts as infinite. */
static double logarithm(double square) {
    const float single = square < SMALLEST ? (float)SMALLEST
                                           : (square <= FLT_MAX ? (float)square : INFINITY);
    int32_t bits;
    memcpy(&bits, &single, sizeof bits);
    return (float)bits * 0x1p-23f - 127.0f;
}

/* A local scale, or an expected error. */
static double power_of(double exponent) {
    const double kept = exponent < MOST_EXPONENT ? exponent : MOST_EXPONENT;
    return exp2(kept > -MOST_EXPONENT ? kept : -MOST_EXPONENT);
}

static double novelty_of(const SlideBound *bound) {
    const size_t count = 2 * bound->n_outputs + bound->n_seen;
    double largest = 0;
    bool known = true;
    for (size_t i = 0; i < count; ++i) {
        const double ratio = bound->means[i] * bound->limits[i];
        known = known && ratio <= MOST_NOVELTY * MOST_NOVELTY;
        largest = ratio > largest ? ratio : largest;
    }
    return known ? sqrt(largest) : MOST_NOVELTY;
}

static void form_means(const SlideBound *bound, const SlideBoundState *state) {
    const size_t n_outputs = bound->n_outputs;
    slide_blocks_means(&bound->of_short, &state->of_short, bound->means);
    slide_blocks_means(&bound->of_long, &state->of_long, bound->means + n_outputs);
    slide_blocks_means(&bound->of_seen, &state->of_seen, bound->means + 2 * n_outputs);
}

/* Far below what its training had, the head would extrapolate. NaN stays. */
static void limit_logarithms(double *logarithms, const double *quietest, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        logarithms[i] = logarithms[i] < quietest[i] ? quietest[i] : logarithms[i];
    }
}

void slide_bound_weigh(const SlideBound *bound, const SlideKernel *kernel,
                       SlideBoundState *state) {
    const SlideNetwork *head = &bound->head;
    const size_t n_outputs = bound->n_outputs, n_means = 2 * n_outputs + bound->n_seen;
    double *logarithms = bound->statistics + bound->n_seen;
    double *of_expected = logarithms + n_outputs + n_means;
    memcpy(bound->statistics, state->seen, bound->n_seen * sizeof(double));
    form_means(bound, state);
    for (size_t i = 0; i < n_outputs; ++i) {
        const double square = state->apart_squared[i], mean = bound->means[i];
        const double apart = sqrt(square > mean ? square : mean);
        logarithms[i] = logarithm(square);
        state->apart[i] = apart <= DBL_MAX ? apart : power_of(MOST_EXPONENT);
    }
    for (size_t i = 0; i < n_means; ++i) {
        logarithms[n_outputs + i] = logarithm(bound->means[i]);
    }
    for (size_t i = 0; i < bound->n_expected; ++i) {
        of_expected[i] = logarithm(bound->expected[i]);
    }
    limit_logarithms(logarithms, bound->quietest, n_outputs + n_means + bound->n_expected);
    *state->novelty = novelty_of(bound);
    const bool finite = slide_features_write(&head->seen, bound->statistics,
                                             bound->statistics + head->seen.n_inputs,
                                             head->features);
    const float *exponents =
        slide_feed_forward_evaluate(&head->of.layers.stack, kernel, head->features);
    for (size_t i = 0; i < n_outputs; ++i) { /* units that saturate hide what is not finite */
        state->scales[i] = power_of(finite ? exponents[i] : NAN);
    }
    for (size_t i = 0; bound->span_length > 0 && i < n_outputs; ++i) {
        const double error = power_of(finite ? exponents[n_outputs + i] : NAN);
        bound->squares[i] = error * error;
    }
}

/* The root of the mean squared error that is expected over a span, times a factor. */
static void form_estimates(const SlideBound *bound, SlideBoundState *state) {
    slide_blocks_means(&bound->of_span, &state->of_span, state->estimates);
    for (size_t i = 0; i < bound->n_outputs; ++i) {
        state->estimates[i] = bound->span_factors[i] * sqrt(state->estimates[i]);
    }
}

void slide_bound_conclude(const SlideBound *bound, const SlideKernel *kernel,
                          SlideBoundState *state) {
    if (*state->concluded == *state->known) {
        return;
    }
    if (bound->span_length > 0) { /* the last sample has been weighed, as all of the span */
        form_estimates(bound, state);
    } else {
        slide_bound_weigh(bound, kernel, state);
    }
    *state->concluded = *state->known;
}

double slide_bound_novelty(const SlideBound *bound, const SlideBoundState *state) {
    form_means(bound, state);
    return novelty_of(bound);
}

double slide_bound_of(const SlideBound *bound, const SlideBoundState *state, size_t output,
                      double confidence, double forecast) {
    const size_t row = confidence <= SLIDE_LEAST_CONFIDENCE   ? 0
                       : confidence <= SLIDE_USUAL_CONFIDENCE ? 1
                                                              : 2;
    const double scaled = bound->factors[row * bound->n_outputs + output] * state->scales[output];
    const double least = bound->floors[output];
    const double value = sqrt(scaled * scaled + least * least);
    const double far = *state->novelty < 1 ? 1 : *state->novelty < MOST_GROWTH ? *state->novelty : MOST_GROWTH;
    const double apart = far * bound->shares[output] * state->apart[output];
    const double known = apart > value ? apart : value;
    const double ahead = FORECAST_FACTORS[row] * FORECAST_FACTORS[row] * forecast;
    return ahead > 0 ? sqrt(known * known + ahead) : known;
}
