/* FMI 2.0: from instantiation to the end. */
#include "instance.h"
#include "resource.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *fmi2GetTypesPlatform(void) { return "default"; }

const char *fmi2GetVersion(void) { return "2.0"; }

/* Place the instance and all it needs; the same code measures and fills. */
static SlideInstance *place_instance(const SlidePayload *payload, fmi2String name,
                                     SlideArena *arena) {
    SlideInstance measured = {0};
    SlideInstance *placed = slide_place(arena, 1, sizeof *placed);
    SlideInstance *instance = placed == NULL ? &measured : placed;
    instance->name = slide_place(arena, strlen(name) + 1, 1);
    if (placed != NULL) {
        strcpy(instance->name, name);
    }
    slide_model_place(&instance->model, payload, arena);
    slide_state_place(&instance->state, &instance->model, arena);
    return placed;
}

static SlideInstance *build_instance(const SlidePayload *payload, fmi2String name,
                                     SlideMessage *message) {
    SlideArena arena = {NULL, 0};
    place_instance(payload, name, &arena);
    unsigned char *block = calloc(arena.used + SLIDE_ALIGNMENT, 1);
    if (block == NULL) {
        slide_say(message, "out of memory: %llu bytes", (unsigned long long)arena.used);
        return NULL;
    }
    size_t misaligned = (size_t)((uintptr_t)block % SLIDE_ALIGNMENT);
    arena = (SlideArena){block + (SLIDE_ALIGNMENT - misaligned), 0};
    SlideInstance *instance = place_instance(payload, name, &arena);
    instance->block = block;
    slide_state_reset(&instance->model, &instance->state);
    instance->state.head->mode = SLIDE_INSTANTIATED;
    return instance;
}

static SlideInstance *load_instance(fmi2String name, fmi2String guid, fmi2String location,
                                    SlideMessage *message) {
    size_t size = 0;
    const unsigned char *data = slide_surrogate_open(location, &size, message);
    SlidePayload payload;
    SlideInstance *instance = NULL;
    if (data != NULL && slide_payload_read(&payload, data, size, message)) {
        if (guid != NULL && strcmp(guid, payload.guid) == 0) {
            instance = build_instance(&payload, name, message);
        } else {
            slide_say(message,
                      "GUID %s; expected %s: modelDescription.xml and resources/surrogate.slide "
                      "do not belong together, export the FMU again",
                      guid == NULL ? "is NULL" : guid, payload.guid);
        }
    }
    slide_surrogate_close(data);
    return instance;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean loggingOn) {
    char unnamed[] = "unnamed";
    SlideMessage message = {""};
    SlideInstance *instance = NULL, nobody = {0};
    (void)visible;
    nobody.name = unnamed;
    if (functions != NULL) {
        nobody.callbacks = *functions;
    }
    if (instanceName == NULL || instanceName[0] == '\0') {
        slide_say(&message, "the instance name is empty; expected a name");
    } else if (fmuType != fmi2CoSimulation) {
        slide_say(&message, "this FMU is for co-simulation only, not for model exchange");
    } else {
        instance = load_instance(instanceName, fmuGUID, fmuResourceLocation, &message);
    }
    if (instance == NULL) {
        slide_report(&nobody, fmi2Error, "fmi2Instantiate: %s", message.text);
        return NULL;
    }
    instance->callbacks = nobody.callbacks;
    instance->debug = loggingOn != fmi2False;
    slide_report(instance, fmi2OK, "instantiated, window of %u samples, kernel %s",
                 (unsigned)instance->model.predictor.n_samples, instance->model.kernel->name);
    return instance;
}

void fmi2FreeInstance(fmi2Component c) {
    if (c != NULL) {
        free(((SlideInstance *)c)->block);
    }
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    SlideInstance *instance = slide_enter(c, SLIDE_ANY_MODE, __func__);
    if (instance == NULL) {
        return fmi2Error;
    }
    if (nCategories > 0 && categories == NULL) {
        return slide_null(instance, __func__);
    }
    bool events = nCategories == 0;
    for (size_t i = 0; i < nCategories; ++i) {
        const char *category = categories[i] == NULL ? "" : categories[i];
        bool event = strcmp(category, "logEvents") == 0 || strcmp(category, "logAll") == 0;
        if (!event && strcmp(category, "logStatusError") != 0 &&
            strcmp(category, "logStatusDiscard") != 0) {
            return slide_report(instance, fmi2Error,
                                "fmi2SetDebugLogging: category '%s'; expected logAll, logEvents, "
                                "logStatusDiscard or logStatusError",
                                category);
        }
        events = events || event;
    }
    if (events) {
        instance->debug = loggingOn != fmi2False;
    }
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                               fmi2Real startTime, fmi2Boolean stopTimeDefined,
                               fmi2Real stopTime) {
    SlideInstance *instance = slide_enter(c, SLIDE_INSTANTIATED, __func__);
    (void)toleranceDefined;
    (void)tolerance;
    if (instance == NULL) {
        return fmi2Error;
    }
    if (!isfinite(startTime) || (stopTimeDefined && !(stopTime >= startTime))) {
        return slide_report(instance, fmi2Error,
                            "fmi2SetupExperiment: start time %g s, stop time %g s; expected a "
                            "finite start and no earlier stop",
                            startTime, stopTime);
    }
    double step = instance->model.step;
    if (fabs(startTime) > slide_clock_farthest(step)) {
        return slide_report(instance, fmi2Error,
                            "fmi2SetupExperiment: start time %.15g s; expected at most %.3g s "
                            "from 0, where steps of %.9g s can be told apart: start nearer to 0; "
                            "nothing was changed",
                            startTime, slide_clock_farthest(step), step);
    }
    instance->state.head->clock.anchor = startTime;
    return fmi2OK;
}

static fmi2Status change_mode(fmi2Component c, SlideMode from, SlideMode to,
                              const char *function) {
    SlideInstance *instance = slide_enter(c, from, function);
    if (instance == NULL) {
        return fmi2Error;
    }
    instance->state.head->mode = to;
    return slide_report(instance, fmi2OK, "%s", function);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return change_mode(c, SLIDE_INSTANTIATED, SLIDE_INITIALIZATION, __func__);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    return change_mode(c, SLIDE_INITIALIZATION, SLIDE_STEPPING, __func__);
}

fmi2Status fmi2Terminate(fmi2Component c) {
    return change_mode(c, SLIDE_STEPPING, SLIDE_TERMINATED, __func__);
}

fmi2Status fmi2Reset(fmi2Component c) {
    SlideInstance *instance = slide_enter(c, SLIDE_ANY_MODE, __func__);
    if (instance == NULL) {
        return fmi2Error;
    }
    slide_state_reset(&instance->model, &instance->state);
    instance->state.head->mode = SLIDE_INSTANTIATED;
    return slide_report(instance, fmi2OK, "fmi2Reset");
}
