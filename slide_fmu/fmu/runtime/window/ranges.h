/* Does a sample lie where the training had its inputs? */
#ifndef SLIDE_RANGES_H
#define SLIDE_RANGES_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* Of scaled inputs, which have the range -1 to 1: rounding. */
#define SLIDE_RANGE_SLACK 1e-6

/* Of the length of a director, which was 1 in the training. Shorter ones come from masters that
 * move cosine and sine each by itself: then the angle does not turn steadily. */
#define SLIDE_LENGTH_SLACK 0.01

/* Of a scaled sample [n_inputs]. */
static inline bool slide_in_range(const double *sample, size_t n_inputs, bool director) {
    if (director) {
        return fabs(hypot(sample[0], sample[1]) - 1) <= SLIDE_LENGTH_SLACK;
    }
    for (size_t i = 0; i < n_inputs; ++i) {
        if (!(fabs(sample[i]) <= 1 + SLIDE_RANGE_SLACK)) {
            return false;
        }
    }
    return true;
}

#endif
