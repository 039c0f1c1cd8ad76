/* What a network sees of the newest inputs (slide_fmu/features/base.py): described in a surrogate
 * file (byte contract: slide_fmu/features/sets.py), formed in double precision. */
#ifndef SLIDE_FEATURE_SET_H
#define SLIDE_FEATURE_SET_H

#include "arena.h"
#include "reading.h"

enum { SLIDE_BEFORE = 3 }; /* inputs before the newest that features may depend on */

typedef struct SlideFeatureSet SlideFeatureSet;

/* Features in a file. All pointers point into the bytes that were read and checked. */
typedef struct {
    const SlideFeatureSet *set;
    uint32_t n_inputs;
    uint64_t n_signals;
    const unsigned char *own; /* numbers of the set's own */
    SlideIndices chosen;      /* signals of the set */
    const unsigned char *offset, *scale; /* f64 [chosen.count]; scale: positive */
} SlideFeaturesView;

typedef struct {
    const SlideFeatureSet *set;
    size_t n_inputs, n_signals;
    void *own; /* what the set has placed */
    size_t count;
    size_t *chosen;          /* [count] signals of the set */
    double *offset, *factor; /* [count]; (signal - offset) * factor */
    double *signals;         /* scratch [n_signals] */
} SlideFeatures;

/* A set of features. */
struct SlideFeatureSet {
    uint32_t number; /* in files */
    /* Whether an input must be the cosine of an angle, with its sine behind it; NULL: none. */
    bool (*is_cosine)(const SlideFeaturesView *view, size_t input);
    /* Read what is the set's own in a file and say how many signals there are. */
    void (*read)(SlideFeaturesView *view, SlideCursor *cursor);
    /* Place what the set needs of it; NULL: nothing. */
    void *(*place)(const SlideFeaturesView *view, SlideArena *arena);
    /* Write all signals; arguments as those of slide_features_write. */
    void (*write)(const SlideFeatures *features, const double *input, const double *before);
};

/* The sets that there are. */
extern const SlideFeatureSet slide_differences;
extern const SlideFeatureSet slide_director;
extern const SlideFeatureSet slide_chain_motion;

/* Check features in a file and describe them. */
void slide_features_read(SlideFeaturesView *view, uint32_t n_inputs, SlideCursor *cursor);

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
