/* Cosine and sine of SLIDE_MOTIONS angles at once. Within 5e4 rad of 0 they are within 4e-16 of
 * the exact ones; to 1e14 rad, within half of the rounding of the angle itself; beyond, where the
 * next double is 0.02 rad away, they mean nothing. */
#ifndef SLIDE_CHAIN_ANGLE_H
#define SLIDE_CHAIN_ANGLE_H

#include <math.h>
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
#else
typedef double Motions __attribute__((vector_size(8 * SLIDE_MOTIONS)));
typedef uint64_t MotionsBits __attribute__((vector_size(8 * SLIDE_MOTIONS)));
#endif

enum { SECTORS = 128 }; /* of the circle */

typedef struct {
    Motions c, s;
} Turn;

static inline Motions each(double value) { return value - (Motions){0}; }

/* Cosine and sine of the middle of every sector. */
static inline void fill_sectors(double (*sectors)[2]) {
    for (int i = 0; i < SECTORS; ++i) {
        int turned = i < SECTORS / 2 ? i : i - SECTORS;
        double angle = 6.28318530717958647693 / SECTORS * turned;
        sectors[i][0] = cos(angle), sectors[i][1] = sin(angle);
    }
}

/* Cosine and sine of the sectors whose numbers are the last bits of what round_to_integer leaves. */
static inline void find_sectors(double (*sectors)[2], Motions shifted, Motions *c, Motions *s) {
#if defined(SLIDE_SCALAR)
    uint64_t sector;
    memcpy(&sector, &shifted, sizeof sector);
    sector &= SECTORS - 1;
    *c = sectors[sector][0], *s = sectors[sector][1];
#else
    const MotionsBits sector = (MotionsBits)shifted & (SECTORS - 1);
    for (int i = 0; i < SLIDE_MOTIONS; ++i) {
        (*c)[i] = sectors[sector[i]][0], (*s)[i] = sectors[sector[i]][1];
    }
#endif
}

/* Of n sectors and a rest r, |r| < 0.025: series in r, and the rule for sums of angles. */
static inline Turn turn_by(double (*sectors)[2], Motions angle) {
    const double sectors_each = SECTORS / 6.28318530717958647693; /* 1/rad */
    /* The first part has 33 bits: n times it is exact. */
    const double width = 4 * 1.57079632673412561417e+00 / SECTORS;
    const double width_rest = 4 * 6.07710050650619224932e-11 / SECTORS;
    const Motions round_to_integer = each(6755399441055744.0); /* 1.5 * 2^52 */
    Motions shifted = each(sectors_each) * angle + round_to_integer;
    Motions n = shifted - round_to_integer;
    Motions r = (angle - each(width) * n) - each(width_rest) * n;
    Motions square = r * r;
    Motions sine = each(1.0 / 120) - square * each(1.0 / 5040);
    sine = r - r * square * (each(1.0 / 6) - square * sine);
    Motions versine = each(1.0 / 24) - square * each(1.0 / 720);
    versine = square * (each(0.5) - square * versine);
    Motions c, s;
    find_sectors(sectors, shifted, &c, &s);
    return (Turn){c - (c * versine + s * sine), s - (s * versine - c * sine)};
}

#endif
