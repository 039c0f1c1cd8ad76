/* FMI 2.0, over calls.h. */
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

static SlideStatus get_time(SlideInstance *instance, fmi2StatusKind kind, fmi2Real *value) {
    if (value == NULL) {
        return slide_null(instance);
    }
    if (kind != fmi2LastSuccessfulTime) {
        return slide_refuse(instance, "the only status of type Real is fmi2LastSuccessfulTime");
    }
    *value = slide_clock_time(&instance->state.head->clock);
    return SLIDE_OK;
}

/* A surrogate never asks to end the simulation. */
static SlideStatus get_end(SlideInstance *instance, fmi2StatusKind kind, fmi2Boolean *value) {
    if (value == NULL) {
        return slide_null(instance);
    }
    if (kind != fmi2Terminated) {
        return slide_refuse(instance, "the only status of type Boolean is fmi2Terminated");
    }
    *value = fmi2False;
    return SLIDE_OK;
}

#pragma GCC diagnostic ignored "-Wunused-parameter" /* not all that the standard passes is used */

#define CALL(function, arguments, modes, call)                                                    \
    fmi2Status function arguments {                                                               \
        SlideInstance *instance = slide_enter(c, modes, __func__);                                \
        return instance == NULL ? fmi2Error : (fmi2Status)call;                                   \
    }
#include "fmi2_functions.h"
