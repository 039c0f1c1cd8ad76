/* FMI 2.0: the functions that this FMU offers, over calls.h. */
#include "calls.h"
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
