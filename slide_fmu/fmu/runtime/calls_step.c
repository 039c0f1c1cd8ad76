/* The communication step. */
#include "calls.h"

#include <math.h>

/* Why a step of this size cannot be taken, or NULL. */
static const char *fault_of(double time, double length, double sample_step) {
    if (!(length > 0) || !isfinite(length)) {
        return "expected a positive, finite step";
    }
    if (fabs(time + length) > slide_clock_farthest(sample_step)) {
        return "its end is so far from 0 that steps cannot be told apart there";
    }
    double seen = (time + length) - time;
    return fabs(seen - length) <= length / 4 ? NULL : "it is too small to be told apart from zero";
}

static const double SHORTEST_DIRECTOR = 1e-6;

/* An angle needs a direction. The file names inputs for people only: here they are references. */
static bool has_direction(const SlideInstance *instance, const double *inputs, const char *which,
                          const char *function) {
    double length = slide_director_length(&instance->model, inputs);
    if (length >= SHORTEST_DIRECTOR) {
        return true;
    }
    slide_report(instance, SLIDE_ERROR,
                 "%s: %s with value references 0 and 1 = %g, %g, which gives no direction; "
                 "expected cosine and sine of an angle, not both zero (length at least %g): set "
                 "both and step again; nothing was changed",
                 function, which, inputs[0], inputs[1], SHORTEST_DIRECTOR);
    return false;
}

static bool have_direction(const SlideInstance *instance, const char *function) {
    const SlideState *state = &instance->state;
    return has_direction(instance, state->inputs, "inputs", function) &&
           (!slide_stream_fresh(state) || has_direction(instance, slide_stream_prehistory(state),
                                                        "initial inputs of those", function));
}

/* Wrong steps are errors, not discarded ones: a master may try a discarded step again for ever. */
SlideStatus slide_do_step(void *component, double point, double length, const char *function) {
    SlideInstance *instance = slide_enter(component, SLIDE_STEPPING, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    SlideClock *clock = &instance->state.head->clock;
    double step = instance->model.step, time = slide_clock_time(clock);
    if (!slide_clock_is_now(clock, point, step)) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: communication point %.15g s; expected %.15g s, the end of the "
                            "last step; nothing was changed",
                            function, point, time);
    }
    const char *fault = fault_of(time, length, step);
    if (fault != NULL) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: communication step %.9g s at %.9g s: %s; nothing was changed",
                            function, length, time, fault);
    }
    if (!have_direction(instance, function)) {
        return SLIDE_ERROR;
    }
    double meant = slide_clock_meant(clock, length, step);
    if (!slide_stream_step(&instance->model, &instance->state, meant)) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: the outputs at %.9g s are not finite; set inputs within their "
                            "ranges and step again; nothing was changed",
                            function, time + meant);
    }
    slide_clock_advance(clock, point, length);
    return SLIDE_OK;
}
