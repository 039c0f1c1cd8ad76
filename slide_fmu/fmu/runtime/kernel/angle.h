/* Cosine and sine of two angles at once. Within 5e4 rad of 0 they are within 4e-16 of the exact
 * ones; to 1e14 rad, within half of the rounding of the angle itself; beyond, where the next
 * double is 0.02 rad away, they mean nothing. */
#ifndef SLIDE_ANGLE_H
#define SLIDE_ANGLE_H

#include <math.h>
#include <stdint.h>

/* Vector extension of GCC and Clang. */
typedef double SlideTwo __attribute__((vector_size(16)));
typedef uint64_t SlideTwoBits __attribute__((vector_size(16)));

enum { SLIDE_SECTORS = 128 }; /* of the circle */

typedef struct {
    SlideTwo c, s;
} SlideCosineSine;

static inline SlideTwo slide_both(double value) { return (SlideTwo){value, value}; }

/* Cosine and sine of the middle of every sector. */
static inline void slide_fill_sectors(SlideTwo *sectors) {
    for (int i = 0; i < SLIDE_SECTORS; ++i) {
        int turned = i < SLIDE_SECTORS / 2 ? i : i - SLIDE_SECTORS;
        double angle = 6.28318530717958647693 / SLIDE_SECTORS * turned;
        sectors[i] = (SlideTwo){cos(angle), sin(angle)};
    }
}

/* Of n sectors and a rest r, |r| < 0.025: series in r, and the rule for sums of angles. */
static inline SlideCosineSine slide_cosine_sine(const SlideTwo *sectors, SlideTwo angle) {
    const double sectors_each = SLIDE_SECTORS / 6.28318530717958647693; /* 1/rad */
    /* The first part has 33 bits: n times it is exact. */
    const double width = 4 * 1.57079632673412561417e+00 / SLIDE_SECTORS;
    const double width_rest = 4 * 6.07710050650619224932e-11 / SLIDE_SECTORS;
    const SlideTwo round_to_integer = slide_both(6755399441055744.0); /* 1.5 * 2^52 */
    SlideTwo shifted = slide_both(sectors_each) * angle + round_to_integer;
    const SlideTwoBits last = {SLIDE_SECTORS - 1, SLIDE_SECTORS - 1};
    SlideTwoBits sector = (SlideTwoBits)shifted & last;
    SlideTwo n = shifted - round_to_integer;
    SlideTwo r = (angle - slide_both(width) * n) - slide_both(width_rest) * n;
    SlideTwo square = r * r;
    SlideTwo sine = slide_both(1.0 / 120) - square * slide_both(1.0 / 5040);
    sine = r - r * square * (slide_both(1.0 / 6) - square * sine);
    SlideTwo versine = slide_both(1.0 / 24) - square * slide_both(1.0 / 720);
    versine = square * (slide_both(0.5) - square * versine);
    SlideTwo one = sectors[sector[0]], other = sectors[sector[1]];
    SlideTwo c = {one[0], other[0]}, s = {one[1], other[1]};
    return (SlideCosineSine){c - (c * versine + s * sine), s - (s * versine - c * sine)};
}

#endif
