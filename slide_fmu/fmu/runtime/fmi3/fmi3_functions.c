/* FMI 3.0, over calls.h. */
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

static fmi3Instance refuse(const char *function, const char *name, const char *fault,
                           SlideLogger logger) {
    return slide_instantiate(&(SlideRequest){
        .function = function, .name = name, .fault = fault, .logger = logger});
}

void fmi3FreeInstance(fmi3Instance instance) { slide_free(instance); }

static SlideStatus begin(SlideInstance *instance, double start, bool stop_defined, double stop) {
    SlideStatus status = slide_set_start(instance, start, stop_defined, stop);
    return status == SLIDE_OK ? slide_change_mode(instance, SLIDE_INITIALIZATION) : status;
}

/* A surrogate has no events and never asks to end the simulation. */
static SlideStatus do_step(SlideInstance *instance, double point, double length,
                           bool *needs_events, bool *ends, bool *early, double *time) {
    if (needs_events == NULL || ends == NULL || early == NULL || time == NULL) {
        return slide_null(instance);
    }
    SlideStatus status = slide_do_step(instance, point, length, early);
    *needs_events = *ends = fmi3False;
    *time = slide_clock_time(&instance->state.head->clock);
    return status;
}

#pragma GCC diagnostic ignored "-Wunused-parameter" /* not all that the standard passes is used */

#define INSTANTIATE(function, arguments, call)                                                    \
    fmi3Instance function arguments { return call; }
#define CALL(function, arguments, modes, call)                                                    \
    fmi3Status function arguments {                                                               \
        SlideInstance *instance = slide_enter(c, modes, __func__);                                \
        return instance == NULL ? fmi3Error : (fmi3Status)call;                                   \
    }
#include "fmi3_functions.h"
