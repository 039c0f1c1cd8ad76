#include "estimate.h"

#include <math.h>

static const double FARTHEST_EXPONENT = 150; /* its square is a number, and so is their sum */

static double within(double value, double low, double high) {
    return value < low ? low : (value > high ? high : value);
}

static double square_of(double exponent) {
    return pow(10.0, 2 * within(exponent, -FARTHEST_EXPONENT, FARTHEST_EXPONENT));
}

static void place_ranges(SlideEstimator *estimator, const unsigned char *ranges,
                         SlideArena *arena) {
    size_t count = 2 * estimator->network.seen.count;
    estimator->ranges = slide_place(arena, count, sizeof(float));
    for (size_t i = 0; arena->base != NULL && i < count; ++i) {
        estimator->ranges[i] = slide_f32(ranges + 4 * i);
    }
}

void slide_estimator_place(SlideEstimator *estimator, const SlidePayload *payload,
                           SlideArena *arena) {
    estimator->positions = 0;
    if (!payload->has_estimator) {
        return;
    }
    const SlideNetworkView *view = &payload->estimator;
    estimator->positions = payload->positions;
    estimator->n_outputs = payload->n_outputs;
    estimator->n_means = view->n_values - payload->n_outputs;
    estimator->memory_length = (uint64_t)payload->positions + view->n_samples - 1;
    estimator->log_middle = 0.5 * (payload->high + payload->low);
    estimator->log_half_range = 0.5 * (payload->high - payload->low);
    estimator->largest = square_of(estimator->log_middle + estimator->log_half_range);
    slide_network_place(&estimator->network, view, view->n_values, arena);
    place_ranges(estimator, payload->ranges, arena);
}

void slide_estimate_place(SlideEstimate *estimate, const SlideEstimator *estimator,
                          SlideArena *arena) {
    if (estimator->positions == 0) {
        return;
    }
    size_t n_outputs = estimator->n_outputs;
    estimate->known = slide_place(arena, 1, sizeof *estimate->known);
    const size_t start = arena->used - sizeof *estimate->known;
    estimate->squares = slide_place(arena, estimator->positions * n_outputs, sizeof(double));
    estimate->errors = slide_place(arena, n_outputs, sizeof(double));
    estimate->newest = slide_place(arena, n_outputs, sizeof(double));
    estimator->network.family->place_state(&estimate->network, &estimator->network, arena);
    estimate->evaluated = arena->used - start;
}

void slide_estimate_restart(const SlideEstimator *estimator, SlideEstimate *estimate) {
    if (estimator->positions > 0) {
        *estimate->known = 0;
    }
}

void slide_estimate_take_back(const SlideEstimator *estimator, SlideEstimate *estimate,
                              uint64_t count) {
    if (estimator->positions > 0 && *estimate->known > count) {
        slide_estimate_restart(estimator, estimate);
    }
}

double slide_squared_error(const SlideEstimator *estimator, double mean, double eps) {
    double kept = eps < 1 ? eps : 1;
    double variance = square_of(estimator->log_middle + estimator->log_half_range * kept);
    double square = variance * (1 + mean * mean);
    bool usable = isfinite(mean) && isfinite(eps) && square < estimator->largest;
    return usable ? square : estimator->largest;
}

double *slide_estimate_square(const SlideEstimator *estimator, const SlideEstimate *estimate,
                              size_t output, uint64_t sample) {
    size_t positions = estimator->positions;
    return estimate->squares + output * positions + (size_t)(sample % positions);
}

/* Has the training seen such features as those of the newest sample? */
static bool in_range(const SlideEstimator *estimator) {
    size_t count = estimator->network.seen.count;
    const float *least = estimator->ranges, *largest = least + count;
    for (size_t i = 0; i < count; ++i) {
        float value = estimator->network.features[i];
        if (!(value >= least[i] && value <= largest[i])) {
            return false;
        }
    }
    return true;
}

/* Look at a sample: are its features known? */
static bool see(const SlideEstimator *estimator, const SlideSamplesShape *shape,
                const SlideSamples *samples, uint64_t sample, SlideEstimate *estimate) {
    const double *input = slide_samples_at(shape, samples, sample);
    slide_network_see_anyhow(&estimator->network, &estimate->network, sample, input,
                             input + shape->n_inputs);
    return in_range(estimator);
}

/* The square of an output, from the values that the network gave. */
static double square_from(const SlideEstimator *estimator, const float *values, bool known,
                          size_t output) {
    const double mean = estimator->n_means > 0 ? values[output] : 0;
    const double square =
        slide_squared_error(estimator, mean, values[estimator->n_means + output]);
    return known ? square : estimator->largest;
}

static void store(const SlideEstimator *estimator, const float *values, bool known,
                  uint64_t sample, SlideEstimate *estimate) {
    for (size_t i = 0; i < estimator->n_outputs; ++i) {
        *slide_estimate_square(estimator, estimate, i, sample) =
            square_from(estimator, values, known, i);
    }
}

/* A sum in parts, so that the additions need not wait for each other; always in the same order. */
static double sum_of(const double *values, size_t count) {
    enum { N_PARTS = 8 };
    double parts[N_PARTS] = {0}, sum = 0;
    size_t i = 0;
    for (; i + N_PARTS <= count; i += N_PARTS) {
        for (size_t part = 0; part < N_PARTS; ++part) {
            parts[part] += values[i + part];
        }
    }
    for (; i < count; ++i) {
        sum += values[i];
    }
    for (size_t part = 0; part < N_PARTS; ++part) {
        sum += parts[part];
    }
    return sum;
}

/* All of the first count samples that are not known yet, but for the last ones: so many are left. */
static void catch_up(const SlideEstimator *estimator, const SlideKernel *kernel,
                     const SlideSamplesShape *shape, const SlideSamples *samples, uint64_t count,
                     SlideEstimate *estimate) {
    const SlideNetwork *network = &estimator->network;
    const uint64_t behind = count - *estimate->known;
    const uint64_t todo = behind < estimator->memory_length ? behind : estimator->memory_length;
    for (uint64_t left = todo; left > 0; --left) {
        const bool known = see(estimator, shape, samples, count - left, estimate);
        if (left <= estimator->positions) {
            const float *values =
                network->family->evaluate(network, kernel, &estimate->network, count - left);
            store(estimator, values, known, count - left, estimate);
        }
    }
    *estimate->known = count;
}

/* The estimates are those at a sample; newest: its squares, in the place of the oldest ones of the
 * span, or NULL where they are there. */
static void conclude(const SlideEstimator *estimator, uint64_t sample, const double *newest,
                     SlideEstimate *estimate) {
    for (size_t i = 0; i < estimator->n_outputs; ++i) {
        double *place = slide_estimate_square(estimator, estimate, i, sample);
        const double kept = *place;
        *place = newest == NULL ? kept : newest[i];
        const double sum =
            sum_of(slide_estimate_square(estimator, estimate, i, 0), estimator->positions);
        estimate->errors[i] = sqrt(sum / estimator->positions);
        estimate->newest[i] = *place;
        *place = kept;
    }
}

void slide_estimate_form(const SlideEstimator *estimator, const SlideKernel *kernel,
                         const SlideSamplesShape *shape, const SlideSamples *samples,
                         uint64_t n_known, uint64_t n_ahead, SlideEstimate *estimate) {
    const SlideNetwork *network = &estimator->network;
    const bool alone = n_ahead > n_known, pair = alone && *estimate->known + 1 == n_known;
    const float *values[2] = {NULL, NULL};
    bool known[2] = {true, true};
    catch_up(estimator, kernel, shape, samples, pair ? n_known - 1 : n_known, estimate);
    if (pair) {
        known[0] = see(estimator, shape, samples, n_known - 1, estimate);
        *estimate->known = n_known;
    }
    if (alone) {
        known[1] = see(estimator, shape, samples, n_known, estimate);
    }
    if (pair) {
        slide_layers_evaluate_two(network, kernel, &estimate->network.layers, n_known - 1, n_known,
                                  values);
        store(estimator, values[0], known[0], n_known - 1, estimate);
    } else if (alone) {
        values[1] = network->family->evaluate(network, kernel, &estimate->network, n_known);
    }
    for (size_t i = 0; alone && i < estimator->n_outputs; ++i) {
        estimate->newest[i] = square_from(estimator, values[1], known[1], i);
    }
    conclude(estimator, n_ahead - 1, alone ? estimate->newest : NULL, estimate);
}
