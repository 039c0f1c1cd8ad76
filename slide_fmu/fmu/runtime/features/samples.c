#include "samples.h"

#include <string.h>

void slide_samples_place(SlideSamples *samples, const SlideSamplesShape *shape,
                         SlideArena *arena) {
    samples->count = slide_place(arena, 1, sizeof *samples->count);
    samples->ring = slide_place(arena, (size_t)shape->capacity + SLIDE_BEFORE,
                                shape->n_inputs * sizeof(double));
}

size_t slide_samples_place_of(const SlideSamplesShape *shape, uint64_t sample) {
    uint64_t mask = shape->capacity - 1;
    return (size_t)(mask - (sample & mask));
}

void slide_samples_append(const SlideSamplesShape *shape, SlideSamples *samples,
                          const double *input) {
    size_t place = slide_samples_place_of(shape, *samples->count);
    size_t n = shape->n_inputs;
    memcpy(samples->ring + place * n, input, n * sizeof *input);
    if (place < SLIDE_BEFORE) {
        memcpy(samples->ring + (shape->capacity + place) * n, input, n * sizeof *input);
    }
    *samples->count += 1;
}

/* Counting starts at capacity: no sample that is kept has a number below 0. */
void slide_samples_fill(const SlideSamplesShape *shape, SlideSamples *samples,
                        const double *input) {
    *samples->count = 0;
    for (uint64_t i = 0; i < shape->capacity; ++i) {
        slide_samples_append(shape, samples, input);
    }
}

const double *slide_samples_at(const SlideSamplesShape *shape, const SlideSamples *samples,
                               uint64_t sample) {
    return samples->ring + slide_samples_place_of(shape, sample) * shape->n_inputs;
}
