#include "features_view.h"

#include <math.h>

enum { MAX_DIFFERENCES = 2, DIRECTOR_INPUTS = 2, DIRECTOR_SIGNALS = 4, MOTION_SIGNALS = 38 };

static void read_differences(SlideFeaturesView *features, SlideCursor *cursor) {
    features->order = slide_take_u32(cursor, "a set of features");
    features->n_signals = (uint64_t)features->n_inputs * ((uint64_t)features->order + 1);
    slide_check(cursor, features->order <= MAX_DIFFERENCES,
                "surrogate file: differences of order %u; expected at most %d",
                (unsigned)features->order, (int)MAX_DIFFERENCES);
}

static void read_director(SlideFeaturesView *features, SlideCursor *cursor) {
    features->n_signals = DIRECTOR_SIGNALS;
    slide_check(cursor, features->n_inputs == DIRECTOR_INPUTS,
                "surrogate file: director of %u inputs; expected %d", (unsigned)features->n_inputs,
                (int)DIRECTOR_INPUTS);
}

static void read_chain_motion(SlideFeaturesView *features, SlideCursor *cursor) {
    SlideChainView *chain = &features->chain;
    uint64_t n = features->n_inputs;
    features->n_signals = MOTION_SIGNALS + n;
    chain->step = slide_take_f64(cursor, "a chain");
    slide_check(cursor, isfinite(chain->step) && chain->step > 0,
                "surrogate file: step %g s of a chain; expected positive", chain->step);
    chain->middle = slide_take_f64s(cursor, n, 1, "chain");
    chain->half_range = slide_take_f64s(cursor, n, 1, "chain");
    chain->a = slide_take_f64s(cursor, n, 1, "chain");
    chain->d = slide_take_f64s(cursor, n, 1, "chain");
    chain->alpha = slide_take_f64s(cursor, n, 1, "chain");
    chain->masses = slide_take_f64s(cursor, n, 1, "chain");
    chain->centres = slide_take_f64s(cursor, n, 3, "chain");
    chain->inertias = slide_take_f64s(cursor, n, 9, "chain");
    chain->gravity = slide_take_f64s(cursor, 3, 1, "chain");
    chain->tool = slide_take_f64s(cursor, 3, 1, "chain");
}

static void read_set(SlideFeaturesView *features, SlideCursor *cursor) {
    features->set = slide_take_u32(cursor, "a set of features");
    switch (features->set) {
    case SLIDE_DIFFERENCES:
        read_differences(features, cursor);
        break;
    case SLIDE_DIRECTOR:
        read_director(features, cursor);
        break;
    case SLIDE_CHAIN_MOTION:
        read_chain_motion(features, cursor);
        break;
    default:
        slide_check(cursor, false, "surrogate file: features of set %u; expected %d, %d or %d",
                    (unsigned)features->set, (int)SLIDE_DIFFERENCES, (int)SLIDE_DIRECTOR,
                    (int)SLIDE_CHAIN_MOTION);
    }
}

void slide_features_read(SlideFeaturesView *features, uint32_t n_inputs, SlideCursor *cursor) {
    features->n_inputs = n_inputs;
    read_set(features, cursor);
    features->chosen = slide_take_indices(cursor, features->n_signals, "chosen features");
    const uint32_t count = features->chosen.count;
    slide_check(cursor, count >= 1,
                "surrogate file: no features chosen; expected at least one");
    features->offset = slide_take_f64s(cursor, count, 1, "feature offset");
    features->scale = slide_take_f64s(cursor, count, 1, "feature scale");
    for (size_t i = 0; cursor->good && i < count; ++i) {
        slide_check(cursor, slide_f64(features->scale + 8 * i) > 0,
                    "surrogate file: a feature scale is not positive");
    }
}
