/* FMI 2.0: functions that this FMU exports, because masters look them up, but does not offer. */
#include "calls.h"
#include "fmi2.h"

static fmi2Status refuse(fmi2Component c, const char *function, const char *reason) {
    return (fmi2Status)slide_refuse(c, function, reason);
}

static const char *const NO_DERIVATIVES = "derivatives of outputs with respect to time are not "
                                          "offered, as modelDescription.xml says";
static const char *const NEVER_PENDING = "steps end before fmi2DoStep returns; nothing is pending";
static const char *const NO_EXCHANGE = "this FMU is for co-simulation, not for model exchange";

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    (void)vr, (void)nvr, (void)order, (void)value;
    return refuse(c, __func__, NO_DERIVATIVES);
}

fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(c, __func__, NEVER_PENDING); }

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind, (void)value;
    return refuse(c, __func__, NEVER_PENDING);
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind, (void)value;
    return refuse(c, __func__, NEVER_PENDING);
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind, (void)value;
    return refuse(c, __func__, "FMI 2.0 defines no status of type Integer");
}

fmi2Status fmi2EnterEventMode(fmi2Component c) { return refuse(c, __func__, NO_EXCHANGE); }

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    (void)info;
    return refuse(c, __func__, NO_EXCHANGE);
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return refuse(c, __func__, NO_EXCHANGE); }

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set_state,
                                       fmi2Boolean *enter_event_mode, fmi2Boolean *terminate) {
    (void)no_set_state, (void)enter_event_mode, (void)terminate;
    return refuse(c, __func__, NO_EXCHANGE);
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    (void)time;
    return refuse(c, __func__, NO_EXCHANGE);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    (void)x, (void)nx;
    return refuse(c, __func__, NO_EXCHANGE);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    (void)derivatives, (void)nx;
    return refuse(c, __func__, NO_EXCHANGE);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t ni) {
    (void)indicators, (void)ni;
    return refuse(c, __func__, NO_EXCHANGE);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
    (void)x, (void)nx;
    return refuse(c, __func__, NO_EXCHANGE);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t nx) {
    (void)nominals, (void)nx;
    return refuse(c, __func__, NO_EXCHANGE);
}
