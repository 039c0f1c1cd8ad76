/* The functions of FMI 3.0 (fmi-standard.org, FMI 3.0.2, chapter 2), over calls.h. The headers of
 * the FMI project declare them; the Python package fmpy brings these. */
#include "calls.h"
#include "fmi3Functions.h"

const char *fmi3GetVersion(void) { return fmi3Version; }

static void write_log(const SlideLogger *logger, const char *instance, SlideStatus status,
                      const char *category, const char *text) {
    fmi3LogMessageCallback callback = (fmi3LogMessageCallback)logger->callback;
    (void)instance;
    callback(logger->environment, (fmi3Status)status, category, text);
}

/* At each sample the outputs are there, and but for the last one, inputs may be set for the rest
 * of the step. */
static bool show(const SlideWatcher *watcher, double time, bool last, double *until) {
    fmi3IntermediateUpdateCallback callback = (fmi3IntermediateUpdateCallback)watcher->callback;
    fmi3Boolean ends = fmi3False, may_end = watcher->may_end && !last;
    callback(watcher->environment, time, !last, fmi3True, fmi3True, may_end, &ends, until);
    return may_end && ends;
}

#if defined(__GNUC__) /* not all that the standard passes is used */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#define NO_EXCHANGE "this FMU is for co-simulation, not for model exchange"
#define NO_SCHEDULE "this FMU is for co-simulation, not for scheduled execution"
#define NO_EVENTS "this FMU has no event mode, as modelDescription.xml says"
#define OF_MODEL                                                                                  \
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logs
#define LOGGER {write_log, (void (*)(void))log, environment}

fmi3Instance fmi3InstantiateCoSimulation(OF_MODEL, fmi3Boolean events, fmi3Boolean may_end,
                                         const fmi3ValueReference vr[], size_t nvr,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    SlideRequest request = {
        .function = __func__,
        .name = name,
        .guid = token,
        .location = resources,
        .logger = LOGGER,
        .debug = logs,
        .has_more = true,
        .watcher = {.show = update == NULL ? NULL : show,
                    .callback = (void (*)(void))update,
                    .environment = environment,
                    .may_end = may_end},
    };
    if (events) {
        request.fault = "eventModeUsed is true; expected false: " NO_EVENTS;
    }
    return slide_instantiate(&request);
}

fmi3Instance fmi3InstantiateModelExchange(OF_MODEL, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    SlideRequest request = {
        .function = __func__, .name = name, .fault = NO_EXCHANGE, .logger = LOGGER};
    return slide_instantiate(&request);
}

fmi3Instance fmi3InstantiateScheduledExecution(OF_MODEL, fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback update,
                                               fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock) {
    SlideRequest request = {
        .function = __func__, .name = name, .fault = NO_SCHEDULE, .logger = LOGGER};
    return slide_instantiate(&request);
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

/* The functions of an instance, and those that this FMU exports, because importers look them up,
 * but does not offer: name, arguments as the standard has them, states in which the function may
 * be called, what is called then. */
#define CALL(function, arguments, modes, call)                                                    \
    fmi3Status function arguments {                                                               \
        SlideInstance *instance = slide_enter(c, modes, __func__);                                \
        return instance == NULL ? fmi3Error : (fmi3Status)call;                                   \
    }
#define REFUSED(function, arguments, reason)                                                      \
    CALL(function, arguments, SLIDE_ANY_MODE, slide_refuse(instance, reason))
/* There are none of this type; asking for none of them is fine. */
#define NO_SUCH_TYPE(function, arguments)                                                         \
    CALL(function, arguments, SLIDE_ANY_MODE, slide_none_of_type(instance, nvr))

CALL(fmi3SetDebugLogging,
     (fmi3Instance c, fmi3Boolean on, size_t n_categories, const fmi3String categories[]),
     SLIDE_ANY_MODE | SLIDE_BETWEEN, slide_set_logging(instance, on, n_categories, categories))
CALL(fmi3EnterInitializationMode,
     (fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance, fmi3Float64 start,
      fmi3Boolean stop_defined, fmi3Float64 stop),
     SLIDE_INSTANTIATED, begin(instance, start, stop_defined, stop))
CALL(fmi3ExitInitializationMode, (fmi3Instance c), SLIDE_INITIALIZATION,
     slide_change_mode(instance, SLIDE_STEPPING))
CALL(fmi3Terminate, (fmi3Instance c), SLIDE_STEPPING,
     slide_change_mode(instance, SLIDE_TERMINATED))
CALL(fmi3Reset, (fmi3Instance c), SLIDE_ANY_MODE, slide_reset(instance))

#define VARIABLES fmi3Instance c, const fmi3ValueReference vr[], size_t nvr
CALL(fmi3GetFloat64, (VARIABLES, fmi3Float64 values[], size_t n_values), SLIDE_READABLE,
     slide_get(instance, &(SlideValues){vr, nvr, n_values, SLIDE_DOUBLES}, values))
CALL(fmi3SetFloat64, (VARIABLES, const fmi3Float64 values[], size_t n_values), SLIDE_SETTABLE,
     slide_set(instance, &(SlideValues){vr, nvr, n_values, SLIDE_DOUBLES}, values))
CALL(fmi3GetBoolean, (VARIABLES, fmi3Boolean values[], size_t n_values), SLIDE_READABLE,
     slide_get(instance, &(SlideValues){vr, nvr, n_values, SLIDE_BOOLS}, values))
CALL(fmi3SetBoolean, (VARIABLES, const fmi3Boolean values[], size_t n_values), SLIDE_SETTABLE,
     slide_set(instance, &(SlideValues){vr, nvr, n_values, SLIDE_BOOLS}, values))

/* Of outputs by inputs; derivative.h says of what. */
#define SENSITIVITIES                                                                             \
    (fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,                      \
     const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[], size_t n_seed, \
     fmi3Float64 sensitivity[], size_t n_sensitivity)
CALL(fmi3GetDirectionalDerivative, SENSITIVITIES, SLIDE_DIFFERENTIABLE,
     slide_get_directional_derivative(
         instance, &(SlideSensitivities){unknowns, n_unknowns, knowns, n_knowns, seed, n_seed,
                                         sensitivity, n_sensitivity}))
CALL(fmi3GetAdjointDerivative, SENSITIVITIES, SLIDE_DIFFERENTIABLE,
     slide_get_adjoint_derivative(
         instance, &(SlideSensitivities){unknowns, n_unknowns, knowns, n_knowns, seed, n_seed,
                                         sensitivity, n_sensitivity}))

CALL(fmi3GetFMUState, (fmi3Instance c, fmi3FMUState *state), SLIDE_ANY_MODE,
     slide_save(instance, state))
CALL(fmi3SetFMUState, (fmi3Instance c, fmi3FMUState state), SLIDE_ANY_MODE,
     slide_restore(instance, state))
CALL(fmi3FreeFMUState, (fmi3Instance c, fmi3FMUState *state), SLIDE_ANY_MODE,
     slide_free_state(instance, state))
CALL(fmi3SerializedFMUStateSize, (fmi3Instance c, fmi3FMUState state, size_t *size),
     SLIDE_ANY_MODE, slide_serialized_size(instance, state, size))
CALL(fmi3SerializeFMUState, (fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size),
     SLIDE_ANY_MODE, slide_serialize(instance, state, bytes, size))
CALL(fmi3DeserializeFMUState,
     (fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state), SLIDE_ANY_MODE,
     slide_deserialize(instance, bytes, size, state))

CALL(fmi3DoStep,
     (fmi3Instance c, fmi3Float64 point, fmi3Float64 length, fmi3Boolean no_state_set_before,
      fmi3Boolean *needs_events, fmi3Boolean *ends, fmi3Boolean *early, fmi3Float64 *time),
     SLIDE_STEPPING, do_step(instance, point, length, needs_events, ends, early, time))

#define NOT_OF_TYPE(Type)                                                                         \
    NO_SUCH_TYPE(fmi3Get##Type, (VARIABLES, fmi3##Type values[], size_t n_values))                \
    NO_SUCH_TYPE(fmi3Set##Type, (VARIABLES, const fmi3##Type values[], size_t n_values))

NOT_OF_TYPE(Float32)
NOT_OF_TYPE(Int8)
NOT_OF_TYPE(UInt8)
NOT_OF_TYPE(Int16)
NOT_OF_TYPE(UInt16)
NOT_OF_TYPE(Int32)
NOT_OF_TYPE(UInt32)
NOT_OF_TYPE(Int64)
NOT_OF_TYPE(UInt64)
NOT_OF_TYPE(String)
NO_SUCH_TYPE(fmi3GetBinary, (VARIABLES, size_t sizes[], fmi3Binary values[], size_t n_values))
NO_SUCH_TYPE(fmi3SetBinary,
             (VARIABLES, const size_t sizes[], const fmi3Binary values[], size_t n_values))
NO_SUCH_TYPE(fmi3GetClock, (VARIABLES, fmi3Clock values[]))
NO_SUCH_TYPE(fmi3SetClock, (VARIABLES, const fmi3Clock values[]))
NO_SUCH_TYPE(fmi3GetIntervalDecimal,
             (VARIABLES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]))
NO_SUCH_TYPE(fmi3GetIntervalFraction, (VARIABLES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                         fmi3IntervalQualifier qualifiers[]))
NO_SUCH_TYPE(fmi3GetShiftDecimal, (VARIABLES, fmi3Float64 shifts[]))
NO_SUCH_TYPE(fmi3GetShiftFraction, (VARIABLES, fmi3UInt64 counters[], fmi3UInt64 resolutions[]))
NO_SUCH_TYPE(fmi3SetIntervalDecimal, (VARIABLES, const fmi3Float64 intervals[]))
NO_SUCH_TYPE(fmi3SetIntervalFraction,
             (VARIABLES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))
NO_SUCH_TYPE(fmi3SetShiftDecimal, (VARIABLES, const fmi3Float64 shifts[]))
NO_SUCH_TYPE(fmi3SetShiftFraction,
             (VARIABLES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))

REFUSED(fmi3EnterEventMode, (fmi3Instance c), NO_EVENTS)
REFUSED(fmi3EvaluateDiscreteStates, (fmi3Instance c), NO_EVENTS)
REFUSED(fmi3UpdateDiscreteStates,
        (fmi3Instance c, fmi3Boolean *need_update, fmi3Boolean *terminate,
         fmi3Boolean *nominals_changed, fmi3Boolean *values_changed, fmi3Boolean *next_defined,
         fmi3Float64 *next_time),
        NO_EVENTS)
REFUSED(fmi3EnterStepMode, (fmi3Instance c), NO_EVENTS)

#define NO_PARAMETERS "this FMU has no structural parameters"
REFUSED(fmi3EnterConfigurationMode, (fmi3Instance c), NO_PARAMETERS)
REFUSED(fmi3ExitConfigurationMode, (fmi3Instance c), NO_PARAMETERS)

#define NO_ELEMENTS "dependencies are those of modelDescription.xml"
REFUSED(fmi3GetNumberOfVariableDependencies,
        (fmi3Instance c, fmi3ValueReference vr, size_t *count), NO_ELEMENTS)
REFUSED(fmi3GetVariableDependencies,
        (fmi3Instance c, fmi3ValueReference dependent, size_t elements_of_dependent[],
         fmi3ValueReference independents[], size_t elements_of_independents[],
         fmi3DependencyKind kinds[], size_t count),
        NO_ELEMENTS)

REFUSED(fmi3GetOutputDerivatives,
        (VARIABLES, const fmi3Int32 orders[], fmi3Float64 values[], size_t n_values),
        "derivatives with respect to time are not offered, as modelDescription.xml says")

REFUSED(fmi3EnterContinuousTimeMode, (fmi3Instance c), NO_EXCHANGE)
REFUSED(fmi3CompletedIntegratorStep,
        (fmi3Instance c, fmi3Boolean no_set_state, fmi3Boolean *enter_event_mode,
         fmi3Boolean *terminate),
        NO_EXCHANGE)
REFUSED(fmi3SetTime, (fmi3Instance c, fmi3Float64 time), NO_EXCHANGE)
REFUSED(fmi3SetContinuousStates, (fmi3Instance c, const fmi3Float64 x[], size_t nx),
        NO_EXCHANGE)
REFUSED(fmi3GetContinuousStateDerivatives,
        (fmi3Instance c, fmi3Float64 derivatives[], size_t nx), NO_EXCHANGE)
REFUSED(fmi3GetEventIndicators, (fmi3Instance c, fmi3Float64 indicators[], size_t ni),
        NO_EXCHANGE)
REFUSED(fmi3GetContinuousStates, (fmi3Instance c, fmi3Float64 x[], size_t nx), NO_EXCHANGE)
REFUSED(fmi3GetNominalsOfContinuousStates,
        (fmi3Instance c, fmi3Float64 nominals[], size_t nx), NO_EXCHANGE)
REFUSED(fmi3GetNumberOfEventIndicators, (fmi3Instance c, size_t *count), NO_EXCHANGE)
REFUSED(fmi3GetNumberOfContinuousStates, (fmi3Instance c, size_t *count), NO_EXCHANGE)

REFUSED(fmi3ActivateModelPartition,
        (fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time), NO_SCHEDULE)
