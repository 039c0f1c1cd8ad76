#include "features_view.h"

#include <math.h>

enum { MAX_DIFFERENCES = 2, DIRECTOR_INPUTS = 2, DIRECTOR_SIGNALS = 4, MOTION_SIGNALS = 38 };

static bool read_differences(SlideFeaturesView *features, SlideCursor *section,
                             SlideMessage *message) {
    if (!slide_take_u32(section, &features->order)) {
        return slide_too_short(message, "a set of features");
    }
    features->n_signals = (uint64_t)features->n_inputs * ((uint64_t)features->order + 1);
    return features->order <= MAX_DIFFERENCES ||
           slide_say(message, "surrogate file: differences of order %u; expected at most %d",
                     (unsigned)features->order, (int)MAX_DIFFERENCES);
}

static bool read_director(SlideFeaturesView *features, SlideMessage *message) {
    features->n_signals = DIRECTOR_SIGNALS;
    return features->n_inputs == DIRECTOR_INPUTS ||
           slide_say(message, "surrogate file: director of %u inputs; expected %d",
                     (unsigned)features->n_inputs, (int)DIRECTOR_INPUTS);
}

static bool read_chain_motion(SlideFeaturesView *features, SlideCursor *section,
                              SlideMessage *message) {
    SlideChainView *chain = &features->chain;
    uint64_t n = features->n_inputs;
    const struct {
        const unsigned char **place;
        uint64_t rows, columns;
    } parts[] = {{&chain->middle, n, 1},   {&chain->half_range, n, 1}, {&chain->a, n, 1},
                 {&chain->d, n, 1},        {&chain->alpha, n, 1},      {&chain->masses, n, 1},
                 {&chain->centres, n, 3},  {&chain->inertias, n, 9},   {&chain->gravity, 3, 1},
                 {&chain->tool, 3, 1}};
    features->n_signals = MOTION_SIGNALS + n;
    if (!slide_take_f64(section, &chain->step)) {
        return slide_too_short(message, "a chain");
    }
    if (!isfinite(chain->step) || !(chain->step > 0)) {
        return slide_say(message, "surrogate file: step %g s of a chain; expected positive",
                         chain->step);
    }
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; ++i) {
        if (!slide_read_f64(parts[i].place, parts[i].rows, parts[i].columns, section, "chain",
                            message)) {
            return false;
        }
    }
    return true;
}

static bool read_set(SlideFeaturesView *features, SlideCursor *section, SlideMessage *message) {
    if (!slide_take_u32(section, &features->set)) {
        return slide_too_short(message, "a set of features");
    }
    switch (features->set) {
    case SLIDE_DIFFERENCES:
        return read_differences(features, section, message);
    case SLIDE_DIRECTOR:
        return read_director(features, message);
    case SLIDE_CHAIN_MOTION:
        return read_chain_motion(features, section, message);
    default:
        return slide_say(message, "surrogate file: features of set %u; expected %d, %d or %d",
                         (unsigned)features->set, (int)SLIDE_DIFFERENCES, (int)SLIDE_DIRECTOR,
                         (int)SLIDE_CHAIN_MOTION);
    }
}

bool slide_features_read(SlideFeaturesView *features, uint32_t n_inputs, SlideCursor *section,
                         SlideMessage *message) {
    SlideIndices *chosen = &features->chosen;
    features->n_inputs = n_inputs;
    if (!read_set(features, section, message) ||
        !slide_read_indices(chosen, features->n_signals, section, "chosen features", message)) {
        return false;
    }
    if (chosen->count < 1) {
        return slide_say(message, "surrogate file: no features chosen; expected at least one");
    }
    if (!slide_read_f64(&features->offset, chosen->count, 1, section, "feature offset", message) ||
        !slide_read_f64(&features->scale, chosen->count, 1, section, "feature scale", message)) {
        return false;
    }
    for (size_t i = 0; i < chosen->count; ++i) {
        if (!(slide_f64(features->scale + 8 * i) > 0)) {
            return slide_say(message, "surrogate file: a feature scale is not positive");
        }
    }
    return true;
}
