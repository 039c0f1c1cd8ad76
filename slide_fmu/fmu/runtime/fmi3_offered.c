/* FMI 3.0: the functions that this FMU offers, over calls.h, and instantiation for what it does
 * not offer. */
#include "calls.h"
#include "fmi3.h"

const char *fmi3GetVersion(void) { return "3.0"; }

static void write_log(const SlideLogger *logger, const char *instance, SlideStatus status,
                      const char *category, const char *text) {
    fmi3LogMessageCallback callback = (fmi3LogMessageCallback)logger->callback;
    (void)instance;
    callback(logger->environment, (fmi3Status)status, category, text);
}

static SlideLogger logger_of(fmi3LogMessageCallback callback, fmi3InstanceEnvironment environment) {
    SlideLogger nobody = {NULL, NULL, NULL};
    return callback == NULL ? nobody
                            : (SlideLogger){write_log, (void (*)(void))callback, environment};
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)visible, (void)earlyReturnAllowed, (void)requiredIntermediateVariables;
    (void)nRequiredIntermediateVariables, (void)intermediateUpdate;
    SlideRequest request = {
        .function = __func__,
        .name = instanceName,
        .guid = instantiationToken,
        .location = resourcePath,
        .logger = logger_of(logMessage, instanceEnvironment),
        .debug = loggingOn,
        .lists_time = true,
    };
    if (eventModeUsed) {
        request.fault = "eventModeUsed is true; expected false: this FMU has no event mode, as "
                        "modelDescription.xml says";
    }
    return slide_instantiate(&request);
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible,
                                          fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    return slide_instantiate(&(SlideRequest){
        .function = __func__,
        .name = instanceName,
        .fault = "this FMU is for co-simulation, not for model exchange",
        .logger = logger_of(logMessage, instanceEnvironment),
    });
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
    fmi3LockPreemptionCallback lockPreemption, fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    return slide_instantiate(&(SlideRequest){
        .function = __func__,
        .name = instanceName,
        .fault = "this FMU is for co-simulation, not for scheduled execution",
        .logger = logger_of(logMessage, instanceEnvironment),
    });
}

void fmi3FreeInstance(fmi3Instance instance) { slide_free(instance); }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    return (fmi3Status)slide_set_logging(instance, loggingOn, nCategories, categories, __func__);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined,
                                       fmi3Float64 tolerance, fmi3Float64 startTime,
                                       fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    (void)toleranceDefined, (void)tolerance;
    SlideStatus status = slide_set_start(instance, startTime, stopTimeDefined, stopTime, __func__);
    if (status == SLIDE_OK) {
        status = slide_change_mode(instance, SLIDE_INSTANTIATED, SLIDE_INITIALIZATION, __func__);
    }
    return (fmi3Status)status;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    return (fmi3Status)slide_change_mode(instance, SLIDE_INITIALIZATION, SLIDE_STEPPING, __func__);
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    return (fmi3Status)slide_change_mode(instance, SLIDE_STEPPING, SLIDE_TERMINATED, __func__);
}

fmi3Status fmi3Reset(fmi3Instance instance) { return (fmi3Status)slide_reset(instance, __func__); }

/* All variables are scalars: each has one value. */
static bool counts_agree(fmi3Instance c, size_t n_references, size_t n_values,
                         const char *function) {
    const SlideInstance *instance = c;
    if (instance != NULL && n_values != n_references) {
        slide_report(instance, SLIDE_ERROR,
                     "%s: %llu values for %llu variables; expected one for each, all are scalars; "
                     "nothing was changed",
                     function, (unsigned long long)n_values, (unsigned long long)n_references);
    }
    return n_values == n_references;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Float64 values[], size_t nValues) {
    if (!counts_agree(instance, nValueReferences, nValues, __func__)) {
        return fmi3Error;
    }
    return (fmi3Status)slide_get(instance, valueReferences, nValueReferences, values, __func__);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Float64 values[], size_t nValues) {
    if (!counts_agree(instance, nValueReferences, nValues, __func__)) {
        return fmi3Error;
    }
    return (fmi3Status)slide_set(instance, valueReferences, nValueReferences, values, __func__);
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    return (fmi3Status)slide_save(instance, FMUState, __func__);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    return (fmi3Status)slide_restore(instance, FMUState, __func__);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    return (fmi3Status)slide_free_state(instance, FMUState, __func__);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    return (fmi3Status)slide_serialized_size(instance, FMUState, size, __func__);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState,
                                 fmi3Byte serializedState[], size_t size) {
    return (fmi3Status)slide_serialize(instance, FMUState, serializedState, size, __func__);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[],
                                   size_t size, fmi3FMUState *FMUState) {
    return (fmi3Status)slide_deserialize(instance, serializedState, size, FMUState, __func__);
}

/* A surrogate has no events, never asks to end the simulation and always ends its step. */
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                      fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    SlideInstance *instance = slide_enter(c, SLIDE_STEPPING, __func__);
    (void)noSetFMUStatePriorToCurrentPoint;
    if (instance == NULL) {
        return fmi3Error;
    }
    if (eventHandlingNeeded == NULL || terminateSimulation == NULL || earlyReturn == NULL ||
        lastSuccessfulTime == NULL) {
        return (fmi3Status)slide_null(instance, __func__);
    }
    SlideStatus status =
        slide_do_step(c, currentCommunicationPoint, communicationStepSize, __func__);
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = slide_clock_time(&instance->state.head->clock);
    return (fmi3Status)status;
}
