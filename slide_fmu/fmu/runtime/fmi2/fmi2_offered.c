/* FMI 2.0: the functions that this FMU offers, over calls.h. */
#include "calls.h"
#include "derivatives_by_reference.h"
#include "fmi2.h"

const char *fmi2GetTypesPlatform(void) { return "default"; }

const char *fmi2GetVersion(void) { return "2.0"; }

/* The logger takes a printf format in which # marks variables: both characters are doubled. */
static void escape(const char *text, char *escaped, size_t size) {
    size_t at = 0;
    for (; *text != '\0' && at + 3 < size; ++text) {
        if (*text == '%' || *text == '#') {
            escaped[at++] = *text;
        }
        escaped[at++] = *text;
    }
    escaped[at] = '\0';
}

static void write_log(const SlideLogger *logger, const char *instance, SlideStatus status,
                      const char *category, const char *text) {
    fmi2CallbackLogger callback = (fmi2CallbackLogger)logger->callback;
    char escaped[1024];
    escape(text, escaped, sizeof escaped);
    callback(logger->environment, instance, (fmi2Status)status, category, escaped);
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean loggingOn) {
    (void)visible;
    SlideRequest request = {
        .function = __func__,
        .name = instanceName,
        .guid = fmuGUID,
        .location = fmuResourceLocation,
        .location_is_uri = true,
        .debug = loggingOn != fmi2False,
    };
    if (fmuType != fmi2CoSimulation) {
        request.fault = "this FMU is for co-simulation only, not for model exchange";
    }
    if (functions != NULL && functions->logger != NULL) {
        request.logger = (SlideLogger){write_log, (void (*)(void))functions->logger,
                                       functions->componentEnvironment};
    }
    return slide_instantiate(&request);
}

void fmi2FreeInstance(fmi2Component c) { slide_free(c); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    return (fmi2Status)slide_set_logging(c, loggingOn != fmi2False, nCategories, categories,
                                         __func__);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                               fmi2Real startTime, fmi2Boolean stopTimeDefined,
                               fmi2Real stopTime) {
    (void)toleranceDefined, (void)tolerance;
    return (fmi2Status)slide_set_start(c, startTime, stopTimeDefined != fmi2False, stopTime,
                                       __func__);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return (fmi2Status)slide_change_mode(c, SLIDE_INSTANTIATED, SLIDE_INITIALIZATION, __func__);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    return (fmi2Status)slide_change_mode(c, SLIDE_INITIALIZATION, SLIDE_STEPPING, __func__);
}

fmi2Status fmi2Terminate(fmi2Component c) {
    return (fmi2Status)slide_change_mode(c, SLIDE_STEPPING, SLIDE_TERMINATED, __func__);
}

fmi2Status fmi2Reset(fmi2Component c) { return (fmi2Status)slide_reset(c, __func__); }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                       fmi2Real value[]) {
    return (fmi2Status)slide_get(c, &(SlideValues){vr, nvr, nvr, SLIDE_DOUBLES}, value, __func__);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                       const fmi2Real value[]) {
    return (fmi2Status)slide_set(c, &(SlideValues){vr, nvr, nvr, SLIDE_DOUBLES}, value, __func__);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    return (fmi2Status)slide_set_rates(c, vr, nvr, order, value, __func__);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          fmi2Boolean value[]) {
    return (fmi2Status)slide_get(c, &(SlideValues){vr, nvr, nvr, SLIDE_INTS}, value, __func__);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          const fmi2Boolean value[]) {
    return (fmi2Status)slide_set(c, &(SlideValues){vr, nvr, nvr, SLIDE_INTS}, value, __func__);
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    return (fmi2Status)slide_save(c, state, __func__);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    return (fmi2Status)slide_restore(c, state, __func__);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    return (fmi2Status)slide_free_state(c, state, __func__);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    return (fmi2Status)slide_serialized_size(c, state, size, __func__);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[],
                                 size_t size) {
    return (fmi2Status)slide_serialize(c, state, bytes, size, __func__);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state) {
    return (fmi2Status)slide_deserialize(c, bytes, size, state, __func__);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint,
                      fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint;
    return (fmi2Status)slide_do_step(c, currentCommunicationPoint, communicationStepSize, NULL,
                                     __func__);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    SlideInstance *instance = slide_enter(c, SLIDE_STEPPING | SLIDE_TERMINATED, __func__);
    if (instance == NULL || value == NULL) {
        return (fmi2Status)(instance == NULL ? SLIDE_ERROR : slide_null(instance, __func__));
    }
    if (kind != fmi2LastSuccessfulTime) {
        return (fmi2Status)slide_refuse(
            c, __func__, "the only status of type Real is fmi2LastSuccessfulTime");
    }
    *value = slide_clock_time(&instance->state.head->clock);
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    SlideInstance *instance = slide_enter(c, SLIDE_STEPPING | SLIDE_TERMINATED, __func__);
    if (instance == NULL || value == NULL) {
        return (fmi2Status)(instance == NULL ? SLIDE_ERROR : slide_null(instance, __func__));
    }
    if (kind != fmi2Terminated) {
        return (fmi2Status)slide_refuse(c, __func__,
                                        "the only status of type Boolean is fmi2Terminated");
    }
    *value = fmi2False; /* a surrogate never asks to end the simulation */
    return fmi2OK;
}

/* Of outputs by inputs; derivative.h says of what. */
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[],
                                        size_t nUnknown, const fmi2ValueReference vKnown_ref[],
                                        size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
    const SlideDerivativePair of = {vUnknown_ref, nUnknown, vKnown_ref, nKnown};
    return (fmi2Status)slide_get_directional_derivative(c, &of, dvKnown, dvUnknown, __func__);
}
