/* The time of the present state and the step sizes that an importer means. */
#ifndef SLIDE_CLOCK_H
#define SLIDE_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

/* Equal steps are counted, never accumulated: time = anchor + count * stride. */
typedef struct {
    double anchor, stride; /* s; the importer's; a step of another size starts a new anchor */
    uint64_t count;
} SlideClock;

double slide_clock_time(const SlideClock *clock);

/* Is this communication point the present time? Importers compute theirs in floating point; the
 * slack is smaller than any step, so that a step done twice is noticed. */
bool slide_clock_is_now(const SlideClock *clock, double point, double sample_step);

/* Is a time at another one or after it, but for what importers may be off? */
bool slide_clock_reaches(const SlideClock *clock, double time, double other, double sample_step);

/* Largest distance from 0 (s) at which steps of this size can be told apart. */
double slide_clock_farthest(double step);

/* The step that an importer means: the last one again, or a multiple or a part of the sample step,
 * where it differs from it by rounding or by how it is written only, such as 0.016667 for 1/60. */
double slide_clock_meant(const SlideClock *clock, double step, double sample_step);

/* A step of the importer's, from its communication point. */
void slide_clock_advance(SlideClock *clock, double point, double step);

#endif
