#include "seen.h"

#include <string.h>

static ptrdiff_t place_of(const SlideState *state, const void *part) {
    return (const unsigned char *)part - (const unsigned char *)state->strayed;
}

const void *slide_seen_part(const SlideState *state, const void *copy, const void *part) {
    return (const unsigned char *)copy + place_of(state, part);
}

void slide_seen_copy_all(const SlideState *state, const void *from, void *to) {
    memcpy(to, from, state->seen_size);
}

static void copy_part(const SlideState *state, const SlideSeenCopy *copy, const void *part,
                      size_t size) {
    const ptrdiff_t place = place_of(state, part);
    memcpy((unsigned char *)copy->to + place, (const unsigned char *)copy->from + place, size);
}

static void copy_between(const SlideState *state, const SlideSeenCopy *copy, const void *begin,
                         const void *end) {
    copy_part(state, copy, begin, (size_t)(place_of(state, end) - place_of(state, begin)));
}

/* What comes after the predictor's state. */
static const void *after_predictor(const SlideModel *model, const SlideState *state) {
    if (model->estimator.positions > 0) {
        return state->estimate.known;
    }
    return model->bound.memory_length > 0
               ? (const void *)state->bound.predicted
               : (const unsigned char *)state->strayed + state->seen_size;
}

/* Places to copy, of all: later samples take the places of earlier ones again. So the counters of a
 * damaged state cost no more than a copy of all. */
static uint64_t n_places(const SlideSeenCopy *copy, uint64_t all) {
    const uint64_t count = copy->end - copy->first;
    return count < all ? count : all;
}

void slide_seen_copy_samples(const SlideModel *model, const SlideState *state,
                             const SlideSeenCopy *copy) {
    const SlideSamplesShape *shape = &model->samples;
    const double *ring = state->samples.ring;
    const size_t row = shape->n_inputs;
    copy_between(state, copy, state->strayed, ring);
    for (uint64_t left = n_places(copy, shape->capacity); left > 0; --left) {
        const size_t place = slide_samples_place_of(shape, copy->first + left - 1);
        copy_part(state, copy, ring + place * row, row * sizeof *ring);
        if (place < SLIDE_BEFORE) {
            copy_part(state, copy, ring + (shape->capacity + place) * row, row * sizeof *ring);
        }
    }
    copy_between(state, copy, ring + (shape->capacity + SLIDE_BEFORE) * row,
                 after_predictor(model, state));
}

void slide_seen_copy_predicted(const SlideModel *model, const SlideState *state,
                               const SlideSeenCopy *copy) {
    const SlideBound *bound = &model->bound;
    if (bound->memory_length == 0) {
        return;
    }
    for (uint64_t left = n_places(copy, bound->n_predicted); left > 0; --left) {
        const uint64_t sample = copy->first + left - 1;
        const float *values = slide_bound_predicted(bound, &state->bound, sample);
        copy_part(state, copy, values, bound->n_outputs * sizeof *values);
    }
}

/* A number that counts what is found. */
static bool differs(const SlideState *state, const SlideSeenCopy *copy, const uint64_t *number) {
    return memcmp(slide_seen_part(state, copy->from, number),
                  slide_seen_part(state, copy->to, number), sizeof *number) != 0;
}

void slide_seen_copy_found(const SlideModel *model, const SlideState *state,
                           const SlideSeenCopy *copy) {
    const SlideEstimate *estimate = &state->estimate;
    const SlideBoundState *bound = &state->bound;
    if (model->estimator.positions > 0 && differs(state, copy, estimate->known)) {
        copy_part(state, copy, estimate->known, estimate->evaluated);
    }
    if (model->bound.memory_length > 0 &&
        (differs(state, copy, bound->known) || differs(state, copy, bound->concluded))) {
        copy_part(state, copy, bound->known, bound->evaluated);
    }
}
