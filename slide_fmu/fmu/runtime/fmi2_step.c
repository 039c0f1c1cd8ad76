/* FMI 2.0: the communication step and its status. */
#include "instance.h"

#include <float.h>
#include <math.h>

/* Relative slack of communication points and steps: masters compute both in floating point. A
 * point never has more than a part of the step, so that a step done twice is noticed at any time. */
static const double STEP_SLACK = 1e-6, TIME_SLACK = 1e-9, LARGEST_SLACK = 0.25;

/* Wrong steps are errors, not fmi2Discard: a master may try a discarded step again for ever. */
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint,
                      fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    SlideInstance *instance = slide_enter(c, SLIDE_STEPPING, __func__);
    (void)noSetFMUStatePriorToCurrentPoint;
    if (instance == NULL) {
        return fmi2Error;
    }
    double step = instance->model.step, time = slide_time(instance);
    double slack = fmin(STEP_SLACK * step + TIME_SLACK * fabs(time), LARGEST_SLACK * step);
    if (!(fabs(currentCommunicationPoint - time) <= slack)) {
        return slide_report(instance, fmi2Error,
                            "fmi2DoStep: communication point %.15g s; expected %.15g s, the end "
                            "of the last step; nothing was changed",
                            currentCommunicationPoint, time);
    }
    /* a master that subtracts two times of this size can be off by their rounding */
    double rounding = 2 * DBL_EPSILON * fabs(time);
    if (!(fabs(communicationStepSize - step) <= STEP_SLACK * step + rounding)) {
        return slide_report(instance, fmi2Error,
                            "fmi2DoStep: communication step %.9g s; expected %.9g s, the sample "
                            "step of the surrogate: set the master's step to it; nothing was "
                            "changed",
                            communicationStepSize, step);
    }
    if (!slide_stream_step(&instance->model, &instance->state)) {
        return slide_report(instance, fmi2Error,
                            "fmi2DoStep: the outputs at %.9g s are not finite; set inputs within "
                            "their ranges and step again; nothing was changed",
                            time + step);
    }
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
    *value = slide_time(instance);
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
