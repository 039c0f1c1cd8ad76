/* What a network sees of the newest inputs (slide_fmu/features/base.py), formed in double precision. */
#ifndef SLIDE_FEATURE_SET_H
#define SLIDE_FEATURE_SET_H

#include "chain.h"

enum { SLIDE_BEFORE = 3 }; /* inputs before the newest that features may depend on */

typedef struct {
    uint32_t set, order;
    size_t n_inputs;
    SlideChain chain; /* of set SLIDE_CHAIN_MOTION */
    size_t count;
    size_t *chosen;         /* [count] signals of the set */
    double *offset, *factor; /* [count]; (signal - offset) * factor */
    double *signals;        /* scratch: all signals of the set */
} SlideFeatures;

/* Place the features of some lists, indices of those of the view, one list after the other; without
 * lists all in their order. While the arena measures, they are not usable. */
void slide_features_place(SlideFeatures *features, const SlideFeaturesView *view,
                          const SlideIndices *lists, size_t n_lists, SlideArena *arena);

/* Features of a scaled input [n_inputs] and those before it [SLIDE_BEFORE][n_inputs], newest first.
 * False when one is not finite. */
bool slide_features_write(const SlideFeatures *features, const double *input,
                          const double *before, float *result);

/* The same, not rounded to single precision and not checked. */
void slide_features_exact(const SlideFeatures *features, const double *input,
                          const double *before, double *result);

#endif
