/* Does a sample lie where the training had its inputs? */
#ifndef SLIDE_RANGES_H
#define SLIDE_RANGES_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* Of scaled inputs, which have the range -1 to 1: planned motions go along curves, which reach a little
 * beyond their samples. */
#define SLIDE_RANGE_SLACK 1e-4

/* Of the length of a director, which was 1 in the training. Shorter ones come from importers that
 * move cosine and sine each by itself: then the angle does not turn steadily. */
#define SLIDE_LENGTH_SLACK 0.01

/* Of a scaled sample [n_inputs]; cosine: which inputs are one of an angle, the next its sine. */
static inline bool slide_in_range(const double *sample, size_t n_inputs, const bool *cosine) {
    for (size_t i = 0; i < n_inputs; ++i) {
        bool inside = cosine[i] ? fabs(hypot(sample[i], sample[i + 1]) - 1) <= SLIDE_LENGTH_SLACK
                                : fabs(sample[i]) <= 1 + SLIDE_RANGE_SLACK;
        if (!inside) {
            return false;
        }
        i += cosine[i];
    }
    return true;
}

#endif
