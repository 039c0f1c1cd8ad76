#include "feature_set.h"

#include "chain_motion.h"
#include "differences.h"
#include "director.h"

#include <float.h>
#include <math.h>

static const SlideFeatureSet *const SETS[] = {
    &slide_differences,
    &slide_director,
    &slide_chain_motion,
};
enum { N_SETS = sizeof SETS / sizeof SETS[0] };

static bool find_set(SlideFeaturesView *view, SlideCursor *section, SlideMessage *message) {
    uint32_t number;
    if (!slide_take_u32(section, &number)) {
        return slide_too_short(message, "a set of features");
    }
    for (size_t i = 0; i < N_SETS; ++i) {
        if (SETS[i]->number == number) {
            view->set = SETS[i];
            return true;
        }
    }
    return slide_say(message, "surrogate file: features of set %u; expected a number from %u to %u",
                     (unsigned)number, (unsigned)SETS[0]->number,
                     (unsigned)SETS[N_SETS - 1]->number);
}

bool slide_features_read(SlideFeaturesView *view, uint32_t n_inputs, SlideCursor *section,
                         SlideMessage *message) {
    SlideIndices *chosen = &view->chosen;
    view->n_inputs = n_inputs;
    if (!find_set(view, section, message)) {
        return false;
    }
    view->own = section->at;
    if (!view->set->read(view, section, message) ||
        !slide_read_indices(chosen, view->n_signals, section, "chosen features", message)) {
        return false;
    }
    if (chosen->count < 1) {
        return slide_say(message, "surrogate file: no features chosen; expected at least one");
    }
    if (!slide_read_f64(&view->offset, chosen->count, 1, section, "feature offset", message) ||
        !slide_read_f64(&view->scale, chosen->count, 1, section, "feature scale", message)) {
        return false;
    }
    for (size_t i = 0; i < chosen->count; ++i) {
        if (!(slide_f64(view->scale + 8 * i) > 0)) {
            return slide_say(message, "surrogate file: a feature scale is not positive");
        }
    }
    return true;
}

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
    features->n_inputs = view->n_inputs;
    features->n_signals = (size_t)view->n_signals;
    features->own = view->set->place == NULL ? NULL : view->set->place(view, arena);
    features->count = n_lists == 0 ? view->chosen.count : 0;
    for (size_t i = 0; i < n_lists; ++i) {
        features->count += lists[i].count;
    }
    features->chosen = slide_place(arena, features->count, sizeof *features->chosen);
    features->offset = slide_place(arena, features->count, sizeof(double));
    features->factor = slide_place(arena, features->count, sizeof(double));
    features->signals = slide_place(arena, features->n_signals, sizeof(double));
    if (arena->base != NULL) {
        fill(features, view, lists, n_lists);
    }
}

static inline double feature_of(const SlideFeatures *features, size_t i) {
    return (features->signals[features->chosen[i]] - features->offset[i]) * features->factor[i];
}

bool slide_features_write(const SlideFeatures *features, const double *input,
                          const double *before, float *result) {
    bool finite = true;
    features->set->write(features, input, before);
    for (size_t i = 0; i < features->count; ++i) {
        const double feature = feature_of(features, i);
        result[i] = (float)feature;
        finite &= fabs(feature) <= FLT_MAX;
    }
    return finite;
}

void slide_features_exact(const SlideFeatures *features, const double *input,
                          const double *before, double *result) {
    features->set->write(features, input, before);
    for (size_t i = 0; i < features->count; ++i) {
        result[i] = feature_of(features, i);
    }
}
