/* Cosine and sine of SLIDE_MOTIONS angles at once. Within 5e4 rad of 0 they are within 2e-16 of
 * the exact ones; to 1e14 rad, within half of the rounding of the angle itself; beyond, where the
 * next double is 0.02 rad away, they mean nothing. */
#ifndef SLIDE_CHAIN_ANGLE_H
#define SLIDE_CHAIN_ANGLE_H

#include <stdint.h>
#include <string.h>

/* Motions that go together: as many as a register holds of those who say so before, else two. */
#if defined(SLIDE_SCALAR)
#define SLIDE_MOTIONS 1
#elif !defined(SLIDE_MOTIONS)
#define SLIDE_MOTIONS 2
#endif

/* Vector extension of GCC and Clang; or one number. */
#if defined(SLIDE_SCALAR)
typedef double Motions;
typedef uint64_t MotionsBits;
#else
typedef double Motions __attribute__((vector_size(8 * SLIDE_MOTIONS)));
typedef uint64_t MotionsBits __attribute__((vector_size(8 * SLIDE_MOTIONS)));
#endif

typedef struct {
    Motions c, s;
} Turn;

static inline Motions each(double value) { return value - (Motions){0}; }

static inline MotionsBits bits_of(Motions x) {
    MotionsBits bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline Motions of_bits(MotionsBits bits) {
    Motions x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* 1 / d[0] - x / d[1] + x^2 / d[2] - ... of count divisors, x being a square: a Taylor series whose
 * signs alternate. */
static inline Motions alternating(const double *divisors, int count, Motions square) {
    Motions sum = each(1 / divisors[count - 1]);
    for (int term = count - 2; term >= 0; --term) {
        sum = each(1 / divisors[term]) - square * sum;
    }
    return sum;
}

/* sin r - r and cos r - 1 for |r| <= pi / 4 by their Taylor series, square being r^2. */
static inline Motions sine_beyond_linear(Motions r, Motions square) {
    static const double odd[] = {6,        120,        5040,         362880,
                                            39916800, 6227020800, 1307674368000};
    return -(r * square) * alternating(odd, 7, square);
}

static inline Motions cosine_beyond_one(Motions square) {
    static const double even[] = {2,       24,        720,         40320,
                                         3628800, 479001600, 87178291200, 20922789888000};
    return -square * alternating(even, 8, square);
}

/* Of n quarters and a rest r. A quarter more makes of cosine and sine minus the sine and the
 * cosine: the last bit of n says whether they change places, two bits give their signs. */
static inline Turn turn_by(Motions angle) {
    const double quarters_each = 0.636619772367581343076; /* 1/rad */
    /* The first part has 33 bits: n times it is exact. */
    const double width = 1.57079632673412561417e+00, width_rest = 6.07710050650619224932e-11;
    const Motions round_to_integer = each(6755399441055744.0); /* 1.5 * 2^52 */
    const Motions shifted = each(quarters_each) * angle + round_to_integer;
    const Motions n = shifted - round_to_integer;
    const Motions r = (angle - each(width) * n) - each(width_rest) * n;
    const Motions square = r * r;
    const MotionsBits quarters = bits_of(shifted);
    const MotionsBits cosine = bits_of(1.0 + cosine_beyond_one(square));
    const MotionsBits sine = bits_of(r + sine_beyond_linear(r, square));
    const MotionsBits other = (cosine ^ sine) & (0 - (quarters & 1));
    const MotionsBits below = (quarters & 2) << 62, left = ((quarters + 1) & 2) << 62;
    return (Turn){of_bits(cosine ^ other ^ left), of_bits(sine ^ other ^ below)};
}

#endif
