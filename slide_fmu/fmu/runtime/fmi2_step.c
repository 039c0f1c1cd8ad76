/* FMI 2.0: the communication step and its status. */
#include "instance.h"

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
static bool has_direction(const SlideInstance *instance, const double *inputs, const char *which) {
    double length = slide_director_length(&instance->model, inputs);
    if (length >= SHORTEST_DIRECTOR) {
        return true;
    }
    slide_report(instance, fmi2Error,
                 "fmi2DoStep: %s with value references 0 and 1 = %g, %g, which gives no "
                 "direction; expected cosine and sine of an angle, not both zero (length at least "
                 "%g): set both and step again; nothing was changed",
                 which, inputs[0], inputs[1], SHORTEST_DIRECTOR);
    return false;
}

static bool have_direction(const SlideInstance *instance) {
    const SlideState *state = &instance->state;
    return has_direction(instance, state->inputs, "inputs") &&
           (!slide_stream_fresh(state) ||
            has_direction(instance, slide_stream_prehistory(state), "initial inputs of those"));
}

/* Wrong steps are errors, not fmi2Discard: a master may try a discarded step again for ever. */
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint,
                      fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    SlideInstance *instance = slide_enter(c, SLIDE_STEPPING, __func__);
    (void)noSetFMUStatePriorToCurrentPoint;
    if (instance == NULL) {
        return fmi2Error;
    }
    SlideClock *clock = &instance->state.head->clock;
    double step = instance->model.step, time = slide_clock_time(clock);
    if (!slide_clock_is_now(clock, currentCommunicationPoint, step)) {
        return slide_report(instance, fmi2Error,
                            "fmi2DoStep: communication point %.15g s; expected %.15g s, the end "
                            "of the last step; nothing was changed",
                            currentCommunicationPoint, time);
    }
    const char *fault = fault_of(time, communicationStepSize, step);
    if (fault != NULL) {
        return slide_report(instance, fmi2Error,
                            "fmi2DoStep: communication step %.9g s at %.9g s: %s; nothing was "
                            "changed",
                            communicationStepSize, time, fault);
    }
    if (!have_direction(instance)) {
        return fmi2Error;
    }
    double length = slide_clock_meant(clock, communicationStepSize, step);
    if (!slide_stream_step(&instance->model, &instance->state, length)) {
        return slide_report(instance, fmi2Error,
                            "fmi2DoStep: the outputs at %.9g s are not finite; set inputs within "
                            "their ranges and step again; nothing was changed",
                            time + length);
    }
    slide_clock_advance(clock, currentCommunicationPoint, communicationStepSize);
    return fmi2OK;
}

static fmi2Status refuse(fmi2Component c, const char *function, const char *reason) {
    SlideInstance *instance = slide_enter(c, SLIDE_ANY_MODE, function);
    return instance == NULL ? fmi2Error
                            : slide_report(instance, fmi2Error, "%s: %s", function, reason);
}

static const char *const NEVER_PENDING = "steps end before fmi2DoStep returns; nothing is pending";

fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(c, __func__, NEVER_PENDING); }

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind;
    (void)value;
    return refuse(c, __func__, NEVER_PENDING);
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind;
    (void)value;
    return refuse(c, __func__, NEVER_PENDING);
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind;
    (void)value;
    return refuse(c, __func__, "FMI 2.0 defines no status of type Integer");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    SlideInstance *instance = slide_enter(c, SLIDE_STEPPING | SLIDE_TERMINATED, __func__);
    if (instance == NULL || value == NULL) {
        return instance == NULL ? fmi2Error : slide_null(instance, __func__);
    }
    if (kind != fmi2LastSuccessfulTime) {
        return refuse(c, __func__, "the only status of type Real is fmi2LastSuccessfulTime");
    }
    *value = slide_clock_time(&instance->state.head->clock);
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    SlideInstance *instance = slide_enter(c, SLIDE_STEPPING | SLIDE_TERMINATED, __func__);
    if (instance == NULL || value == NULL) {
        return instance == NULL ? fmi2Error : slide_null(instance, __func__);
    }
    if (kind != fmi2Terminated) {
        return refuse(c, __func__, "the only status of type Boolean is fmi2Terminated");
    }
    *value = fmi2False; /* a surrogate never asks to end the simulation */
    return fmi2OK;
}
