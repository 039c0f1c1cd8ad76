/* The newest samples of the inputs, scaled. */
#ifndef SLIDE_SAMPLES_H
#define SLIDE_SAMPLES_H

#include "arena.h"
#include "feature_set.h"

#include <stdint.h>

/* So many samples before one of held inputs that change within it get a share of the change; and so
 * many samples are not known before the next has come. */
enum { SLIDE_SPREAD = 4, SLIDE_UNSETTLED = SLIDE_SPREAD + 1 };

/* So many samples before one tell whether an input that moves jumped just before it. */
enum { SLIDE_LOOKED_BACK = 4 };

/* What does not change. */
typedef struct {
    size_t n_inputs;
    uint64_t capacity; /* samples kept; more than SLIDE_BEFORE, a power of two */
} SlideSamplesShape;

/* What changes; part of the flat state block. */
typedef struct {
    uint64_t *count; /* samples so far: the number of the next one */
    double *ring;    /* [capacity + SLIDE_BEFORE][n_inputs], later ones at lower places; the first
                        SLIDE_BEFORE places are there again behind the last, so that a sample and
                        those before it lie in one piece */
} SlideSamples;

void slide_samples_place(SlideSamples *samples, const SlideSamplesShape *shape,
                         SlideArena *arena);

/* The place of a sample in the ring, by its number. */
size_t slide_samples_place_of(const SlideSamplesShape *shape, uint64_t sample);

/* Forget all; a scaled input [n_inputs] counts for all that are kept. */
void slide_samples_fill(const SlideSamplesShape *shape, SlideSamples *samples,
                        const double *input);
void slide_samples_append(const SlideSamplesShape *shape, SlideSamples *samples,
                          const double *input);

/* A sample by its number and those before it, [1 + SLIDE_BEFORE][n_inputs], newest first. Kept are
 * those of the last capacity numbers. */
const double *slide_samples_at(const SlideSamplesShape *shape, const SlideSamples *samples,
                               uint64_t sample);

#endif
