#include "clock.h"

#include <float.h>
#include <math.h>

/* Relative slack of communication points and steps. */
static const double STEP_SLACK = 1e-6, TIME_SLACK = 1e-9, LARGEST_SLACK = 0.25;

/* Relative slack of a step that is written down, such as 0.016667 s for 1/60 s. */
static const double MEANT_SLACK = 3e-5;

/* Of a sample step: smaller ones could hardly be told apart by this slack. */
static const double MOST_PARTS = 1000;

/* Largest rounding error of a time, relative to the step; greater ones would blur the steps. */
static const double TIME_RESOLUTION = 1e-3;

double slide_clock_time(const SlideClock *clock) {
    return clock->anchor + (double)clock->count * clock->stride;
}

static double slack(const SlideClock *clock, double sample_step) {
    return STEP_SLACK * sample_step + TIME_SLACK * fabs(slide_clock_time(clock));
}

bool slide_clock_is_now(const SlideClock *clock, double point, double sample_step) {
    double last = clock->count > 0 ? fmin(clock->stride, sample_step) : sample_step;
    return fabs(point - slide_clock_time(clock)) <=
           fmin(slack(clock, sample_step), LARGEST_SLACK * last);
}

bool slide_clock_reaches(const SlideClock *clock, double time, double other, double sample_step) {
    return other - time <= slack(clock, sample_step);
}

double slide_clock_farthest(double step) { return 2 * TIME_RESOLUTION * step / DBL_EPSILON; }

double slide_clock_meant(const SlideClock *clock, double step, double sample_step) {
    /* an importer that subtracts two times of this size can be off by their rounding */
    const double rounding = 2 * DBL_EPSILON * fabs(slide_clock_time(clock));
    if (fabs(step - clock->stride) <= TIME_SLACK * step + rounding) {
        return clock->stride;
    }
    const double ratio = step / sample_step;
    const double nearest = ratio > 1 ? nearbyint(ratio) * sample_step
                                     : sample_step / fmin(nearbyint(1 / ratio), MOST_PARTS);
    return fabs(step - nearest) <= MEANT_SLACK * nearest + rounding ? nearest : step;
}

void slide_clock_advance(SlideClock *clock, double point, double step) {
    if (step != clock->stride) {
        clock->anchor = point;
        clock->stride = step;
        clock->count = 0;
    }
    clock->count += 1;
}
