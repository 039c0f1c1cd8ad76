/* What networks have seen, and copies of it: as it was before a forecast, or before a step. A step
 * changes few of the samples that are kept, so a copy need not be of all of them. */
#ifndef SLIDE_SEEN_H
#define SLIDE_SEEN_H

#include "state.h"

/* From one place to another, each of state->seen_size bytes. Both hold the same but for the samples
 * of these numbers, [first, end), and what follows from them. */
typedef struct {
    const void *from;
    void *to;
    uint64_t first, end;
} SlideSeenCopy;

void slide_seen_copy_all(const SlideState *state, const void *from, void *to);

/* The samples, their count, and the predictor's state after them. */
void slide_seen_copy_samples(const SlideModel *model, const SlideState *state,
                             const SlideSeenCopy *copy);

/* What the predictor gave after these samples, which the error bound needs. */
void slide_seen_copy_predicted(const SlideModel *model, const SlideState *state,
                               const SlideSeenCopy *copy);

/* What the estimator and the bound found, where one place knows more of it than the other. */
void slide_seen_copy_found(const SlideModel *model, const SlideState *state,
                           const SlideSeenCopy *copy);

/* Where a part of what networks have seen lies in a copy. */
const void *slide_seen_part(const SlideState *state, const void *copy, const void *part);

#endif
