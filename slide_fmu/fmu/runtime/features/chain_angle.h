/* Cosine and sine of two angles at once. Within 5e4 rad of 0 they are within 4e-16 of the exact
 * ones; to 1e14 rad, within half of the rounding of the angle itself; beyond, where the next
 * double is 0.02 rad away, they mean nothing. */
#ifndef SLIDE_CHAIN_ANGLE_H
#define SLIDE_CHAIN_ANGLE_H

#include <math.h>
#include <stdint.h>

/* Vector extension of GCC and Clang. */
typedef double Two __attribute__((vector_size(16)));
typedef uint64_t TwoBits __attribute__((vector_size(16)));

enum { SECTORS = 128 }; /* of the circle */

typedef struct {
    Two c, s;
} Turn;

static inline Two both(double value) { return (Two){value, value}; }

/* Cosine and sine of the middle of every sector. */
static inline void fill_sectors(Two *sectors) {
    for (int i = 0; i < SECTORS; ++i) {
        int turned = i < SECTORS / 2 ? i : i - SECTORS;
        double angle = 6.28318530717958647693 / SECTORS * turned;
        sectors[i] = (Two){cos(angle), sin(angle)};
    }
}

/* Of n sectors and a rest r, |r| < 0.025: series in r, and the rule for sums of angles. */
static inline Turn turn_by(const Two *sectors, Two angle) {
    const double sectors_each = SECTORS / 6.28318530717958647693; /* 1/rad */
    /* The first part has 33 bits: n times it is exact. */
    const double width = 4 * 1.57079632673412561417e+00 / SECTORS;
    const double width_rest = 4 * 6.07710050650619224932e-11 / SECTORS;
    const Two round_to_integer = both(6755399441055744.0); /* 1.5 * 2^52 */
    Two shifted = both(sectors_each) * angle + round_to_integer;
    const TwoBits last = {SECTORS - 1, SECTORS - 1};
    TwoBits sector = (TwoBits)shifted & last;
    Two n = shifted - round_to_integer;
    Two r = (angle - both(width) * n) - both(width_rest) * n;
    Two square = r * r;
    Two sine = both(1.0 / 120) - square * both(1.0 / 5040);
    sine = r - r * square * (both(1.0 / 6) - square * sine);
    Two versine = both(1.0 / 24) - square * both(1.0 / 720);
    versine = square * (both(0.5) - square * versine);
    Two one = sectors[sector[0]], other = sectors[sector[1]];
    Two c = {one[0], other[0]}, s = {one[1], other[1]};
    return (Turn){c - (c * versine + s * sine), s - (s * versine - c * sine)};
}

#endif
