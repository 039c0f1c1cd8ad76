/* FMI 3.0: functions that this FMU exports, because masters look them up, but does not offer. */
#include "calls.h"
#include "fmi3.h"

static fmi3Status refuse(fmi3Instance instance, const char *function, const char *reason) {
    return (fmi3Status)slide_refuse(instance, function, reason);
}

static const char *const NO_EVENTS = "this FMU has no event mode, as modelDescription.xml says";
static const char *const NO_DERIVATIVES = "derivatives with respect to time are not offered, as "
                                          "modelDescription.xml says";
static const char *const NO_PARAMETERS = "this FMU has no structural parameters";
static const char *const NO_ELEMENTS = "dependencies are those of modelDescription.xml";
static const char *const NO_EXCHANGE = "this FMU is for co-simulation, not for model exchange";
static const char *const NO_SCHEDULE = "this FMU is for co-simulation, not for scheduled "
                                       "execution";

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    return refuse(instance, __func__, NO_EVENTS);
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    return refuse(instance, __func__, NO_EVENTS);
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *need_update,
                                    fmi3Boolean *terminate, fmi3Boolean *nominals_changed,
                                    fmi3Boolean *values_changed, fmi3Boolean *next_defined,
                                    fmi3Float64 *next_time) {
    (void)need_update, (void)terminate, (void)nominals_changed, (void)values_changed;
    (void)next_defined, (void)next_time;
    return refuse(instance, __func__, NO_EVENTS);
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    return refuse(instance, __func__, NO_EVENTS);
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) {
    return refuse(instance, __func__, NO_PARAMETERS);
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) {
    return refuse(instance, __func__, NO_PARAMETERS);
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference vr,
                                               size_t *count) {
    (void)vr, (void)count;
    return refuse(instance, __func__, NO_ELEMENTS);
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elements_of_dependent[],
                                       fmi3ValueReference independents[],
                                       size_t elements_of_independents[],
                                       fmi3DependencyKind kinds[], size_t count) {
    (void)dependent, (void)elements_of_dependent, (void)independents;
    (void)elements_of_independents, (void)kinds, (void)count;
    return refuse(instance, __func__, NO_ELEMENTS);
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference vr[],
                                    size_t nvr, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t n_values) {
    (void)vr, (void)nvr, (void)orders, (void)values, (void)n_values;
    return refuse(instance, __func__, NO_DERIVATIVES);
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    return refuse(instance, __func__, NO_EXCHANGE);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean no_set_state,
                                       fmi3Boolean *enter_event_mode, fmi3Boolean *terminate) {
    (void)no_set_state, (void)enter_event_mode, (void)terminate;
    return refuse(instance, __func__, NO_EXCHANGE);
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    (void)time;
    return refuse(instance, __func__, NO_EXCHANGE);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 x[], size_t nx) {
    (void)x, (void)nx;
    return refuse(instance, __func__, NO_EXCHANGE);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nx) {
    (void)derivatives, (void)nx;
    return refuse(instance, __func__, NO_EXCHANGE);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 indicators[], size_t ni) {
    (void)indicators, (void)ni;
    return refuse(instance, __func__, NO_EXCHANGE);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 x[], size_t nx) {
    (void)x, (void)nx;
    return refuse(instance, __func__, NO_EXCHANGE);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
                                             size_t nx) {
    (void)nominals, (void)nx;
    return refuse(instance, __func__, NO_EXCHANGE);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *count) {
    (void)count;
    return refuse(instance, __func__, NO_EXCHANGE);
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *count) {
    (void)count;
    return refuse(instance, __func__, NO_EXCHANGE);
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clock,
                                      fmi3Float64 time) {
    (void)clock, (void)time;
    return refuse(instance, __func__, NO_SCHEDULE);
}
