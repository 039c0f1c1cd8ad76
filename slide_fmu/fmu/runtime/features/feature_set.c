#include "feature_set.h"

#include <float.h>
#include <math.h>

static const SlideFeatureSet *const SETS[] = {
    &slide_differences,
    &slide_director,
    &slide_chain_motion,
};
enum { N_SETS = sizeof SETS / sizeof SETS[0] };

static const SlideFeatureSet *take_set(SlideCursor *cursor) {
    const uint32_t number = slide_take_u32(cursor, "a set of features");
    for (size_t i = 0; i < N_SETS; ++i) {
        if (SETS[i]->number == number) {
            return SETS[i];
        }
    }
    slide_check(cursor, false,
                "surrogate file: features of set %u; expected one that this version writes",
                (unsigned)number);
    return NULL;
}

void slide_features_read(SlideFeaturesView *view, uint32_t n_inputs, SlideCursor *cursor) {
    view->n_inputs = n_inputs;
    view->set = take_set(cursor);
    view->own = cursor->at;
    if (view->set != NULL) {
        view->set->read(view, cursor);
    }
    view->chosen = slide_take_indices(cursor, view->n_signals, "chosen features");
    const uint32_t count = view->chosen.count;
    slide_check(cursor, count >= 1, "surrogate file: no features chosen; expected at least one");
    view->offset = slide_take_f64s(cursor, count, 1, "feature offset");
    view->scale = slide_take_f64s(cursor, count, 1, "feature scale");
    for (size_t i = 0; cursor->good && i < count; ++i) {
        slide_check(cursor, slide_f64(view->scale + 8 * i) > 0,
                    "surrogate file: a feature scale is not positive");
    }
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
