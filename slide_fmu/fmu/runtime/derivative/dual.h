/* Dual numbers: a value, and its derivative in one direction. */
#ifndef SLIDE_DUAL_H
#define SLIDE_DUAL_H

typedef struct {
    double value, slope;
} SlideDual;

static inline SlideDual slide_plus(SlideDual a, SlideDual b) {
    return (SlideDual){a.value + b.value, a.slope + b.slope};
}

static inline SlideDual slide_minus(SlideDual a, SlideDual b) {
    return (SlideDual){a.value - b.value, a.slope - b.slope};
}

static inline SlideDual slide_times(SlideDual a, SlideDual b) {
    return (SlideDual){a.value * b.value, a.slope * b.value + a.value * b.slope};
}

#endif
