#include "feature_set.h"

#include <float.h>
#include <math.h>

static const double PI = 3.14159265358979323846;

static void take_over(SlideFeatures *features, const SlideFeaturesView *view, size_t place,
                      uint32_t index) {
    features->chosen[place] = slide_u32(view->chosen.at + 4 * (size_t)index);
    features->offset[place] = slide_f64(view->offset + 8 * (size_t)index);
    features->factor[place] = fmin(1 / slide_f64(view->scale + 8 * (size_t)index), DBL_MAX);
}

static void fill(SlideFeatures *features, const SlideFeaturesView *view,
                 const SlideIndices *lists, size_t n_lists) {
    size_t place = 0;
    for (size_t list = 0; list < n_lists; ++list) {
        for (size_t i = 0; i < lists[list].count; ++i) {
            take_over(features, view, place++, slide_u32(lists[list].at + 4 * i));
        }
    }
    for (uint32_t i = 0; n_lists == 0 && i < view->chosen.count; ++i) {
        take_over(features, view, place++, i);
    }
}

void slide_features_place(SlideFeatures *features, const SlideFeaturesView *view,
                          const SlideIndices *lists, size_t n_lists, SlideArena *arena) {
    features->set = view->set;
    features->order = view->order;
    features->n_inputs = view->n_inputs;
    if (view->set == SLIDE_CHAIN_MOTION) {
        slide_chain_place(&features->chain, view, arena);
    }
    features->count = n_lists == 0 ? view->chosen.count : 0;
    for (size_t i = 0; i < n_lists; ++i) {
        features->count += lists[i].count;
    }
    features->chosen = slide_place(arena, features->count, sizeof *features->chosen);
    features->offset = slide_place(arena, features->count, sizeof(double));
    features->factor = slide_place(arena, features->count, sizeof(double));
    features->signals = slide_place(arena, (size_t)view->n_signals, sizeof(double));
    if (arena->base != NULL) {
        fill(features, view, lists, n_lists);
    }
}

/* Differences cancel: they are formed before anything is rounded. */
static void write_differences(const SlideFeatures *features, const double *input,
                              const double *before) {
    size_t n = features->n_inputs;
    double *signals = features->signals;
    for (size_t i = 0; i < n; ++i) {
        double change = input[i] - before[i], change_before = before[i] - before[n + i];
        signals[i] = input[i];
        if (features->order > 0) {
            signals[n + i] = change;
        }
        if (features->order > 1) {
            signals[2 * n + i] = change - change_before;
        }
    }
}

/* Into (-pi, pi]. */
static double wrapped(double turn) { return turn - 2 * PI * ceil((turn - PI) / (2 * PI)); }

static void write_director(const SlideFeatures *features, const double *input,
                           const double *before) {
    double angle = atan2(input[1], input[0]), angle_before = atan2(before[1], before[0]);
    double turn = wrapped(angle - angle_before);
    double turn_before = wrapped(angle_before - atan2(before[3], before[2]));
    features->signals[0] = cos(angle);
    features->signals[1] = sin(angle);
    features->signals[2] = turn;
    features->signals[3] = turn - turn_before;
}

static void write_chain_motion(const SlideFeatures *features, const double *input,
                               const double *before) {
    size_t n = features->n_inputs;
    const double *const inputs[4] = {input, before, before + n, before + 2 * n};
    slide_chain_write(&features->chain, inputs, features->signals);
}

/* Two features, of places i and j of the lists. */
static inline SlideTwo two_of(const SlideFeatures *features, size_t i, size_t j) {
    const double *signals = features->signals, *offset = features->offset;
    const double *factor = features->factor;
    const size_t *chosen = features->chosen;
    const SlideTwo two = {signals[chosen[i]], signals[chosen[j]]};
    return (two - (SlideTwo){offset[i], offset[j]}) * (SlideTwo){factor[i], factor[j]};
}

/* Set where a value becomes a finite float. */
static inline SlideTwoBits finite_bits(SlideTwo two) {
    const SlideTwo largest = {FLT_MAX, FLT_MAX};
    return (SlideTwoBits)(two <= largest) & (SlideTwoBits)(two >= -largest);
}

static bool write_chosen(const SlideFeatures *features, float *result) {
    const size_t count = features->count;
    SlideTwoBits finite = {UINT64_MAX, UINT64_MAX};
    for (size_t i = 0; i + 2 <= count; i += 2) {
        SlideTwo two = two_of(features, i, i + 1);
        result[i] = (float)two[0], result[i + 1] = (float)two[1];
        finite &= finite_bits(two);
    }
    if (count % 2 == 1) {
        SlideTwo last = two_of(features, count - 1, count - 1);
        result[count - 1] = (float)last[0];
        finite &= finite_bits(last);
    }
    return (finite[0] & finite[1]) != 0;
}

static void form_signals(const SlideFeatures *features, const double *input,
                         const double *before) {
    switch (features->set) {
    case SLIDE_DIRECTOR:
        write_director(features, input, before);
        break;
    case SLIDE_CHAIN_MOTION:
        write_chain_motion(features, input, before);
        break;
    default:
        write_differences(features, input, before);
        break;
    }
}

bool slide_features_write(const SlideFeatures *features, const double *input,
                          const double *before, float *result) {
    form_signals(features, input, before);
    return write_chosen(features, result);
}

void slide_features_exact(const SlideFeatures *features, const double *input,
                          const double *before, double *result) {
    form_signals(features, input, before);
    for (size_t i = 0; i < features->count; ++i) {
        double signal = features->signals[features->chosen[i]];
        result[i] = (signal - features->offset[i]) * features->factor[i];
    }
}
