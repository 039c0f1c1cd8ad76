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

/* At each sample the outputs are there, and but for the last one, inputs may be set for the rest of
 * the step. */
static bool show(const SlideWatcher *watcher, double time, bool last, double *until) {
    fmi3IntermediateUpdateCallback callback = (fmi3IntermediateUpdateCallback)watcher->callback;
    fmi3Boolean ends = fmi3False, may_end = watcher->may_end && !last;
    callback(watcher->environment, time, !last, fmi3True, fmi3True, may_end, &ends, until);
    return may_end && ends;
}

static SlideWatcher watcher_of(fmi3IntermediateUpdateCallback callback,
                               fmi3InstanceEnvironment environment, fmi3Boolean may_end) {
    SlideWatcher watcher = {0};
    if (callback != NULL) {
        watcher.show = show;
        watcher.callback = (void (*)(void))callback;
        watcher.environment = environment;
        watcher.may_end = may_end;
    }
    return watcher;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)visible, (void)requiredIntermediateVariables, (void)nRequiredIntermediateVariables;
    SlideRequest request = {
        .function = __func__,
        .name = instanceName,
        .guid = instantiationToken,
        .location = resourcePath,
        .logger = logger_of(logMessage, instanceEnvironment),
        .debug = loggingOn,
        .has_more = true,
        .watcher = watcher_of(intermediateUpdate, instanceEnvironment, earlyReturnAllowed),
    };
    if (eventModeUsed) {
        request.fault = "eventModeUsed is true; expected false: this FMU has no event mode, as "
                        "modelDescription.xml says";
    }
    return slide_instantiate(&request);
}

static fmi3Instance refuse_instance(const char *function, fmi3String name, const char *fault,
                                    fmi3LogMessageCallback callback,
                                    fmi3InstanceEnvironment environment) {
    return slide_instantiate(&(SlideRequest){.function = function,
                                             .name = name,
                                             .fault = fault,
                                             .logger = logger_of(callback, environment)});
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible,
                                          fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    return refuse_instance(__func__, instanceName,
                           "this FMU is for co-simulation, not for model exchange", logMessage,
                           instanceEnvironment);
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
    fmi3LockPreemptionCallback lockPreemption, fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    return refuse_instance(__func__, instanceName,
                           "this FMU is for co-simulation, not for scheduled execution",
                           logMessage, instanceEnvironment);
}

void fmi3FreeInstance(fmi3Instance instance) { slide_free(instance); }

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

/* A surrogate has no events and never asks to end the simulation. */
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
    SlideStatus status = slide_do_step(c, currentCommunicationPoint, communicationStepSize,
                                       earlyReturn, __func__);
    *eventHandlingNeeded = *terminateSimulation = fmi3False;
    *lastSuccessfulTime = slide_clock_time(&instance->state.head->clock);
    return (fmi3Status)status;
}
