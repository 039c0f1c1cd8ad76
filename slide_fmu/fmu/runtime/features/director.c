/* Direction, turn and change of the turn of an angle given by cosine and sine
 * (slide_fmu/features/director.py). */
#include "feature_set.h"

#include <math.h>

enum { N_INPUTS = 2, N_SIGNALS = 4 };
static const double PI = 3.14159265358979323846;

/* There is nothing in the file that is the set's own. */
static void check_inputs(SlideFeaturesView *view, SlideCursor *cursor) {
    view->n_signals = N_SIGNALS;
    slide_check(cursor, view->n_inputs == N_INPUTS,
                "surrogate file: director of %u inputs; expected %d", (unsigned)view->n_inputs,
                (int)N_INPUTS);
}

/* Into (-pi, pi]. */
static double wrapped(double turn) { return turn - 2 * PI * ceil((turn - PI) / (2 * PI)); }

static void write_signals(const SlideFeatures *features, const double *input,
                          const double *before) {
    double angle = atan2(input[1], input[0]), angle_before = atan2(before[1], before[0]);
    double turn = wrapped(angle - angle_before);
    double turn_before = wrapped(angle_before - atan2(before[3], before[2]));
    features->signals[0] = cos(angle);
    features->signals[1] = sin(angle);
    features->signals[2] = turn;
    features->signals[3] = turn - turn_before;
}

const SlideFeatureSet slide_director = {
    .number = 2,
    .of_angle = true,
    .read = check_inputs,
    .write = write_signals,
};
