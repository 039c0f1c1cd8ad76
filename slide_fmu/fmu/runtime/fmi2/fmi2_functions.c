/* The functions of FMI 2.0 (fmi-standard.org, FMI 2.0.4, chapter 2), over calls.h. The headers of
 * the FMI project declare them; the Python package fmpy brings these. */
#include "calls.h"
#include "fmi2Functions.h"

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

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
    if (functions != NULL) {
        request.logger = (SlideLogger){write_log, (void (*)(void))functions->logger,
                                       functions->componentEnvironment};
    }
    return slide_instantiate(&request);
}

void fmi2FreeInstance(fmi2Component c) { slide_free(c); }

/* What can be asked, but is not known, is discarded (section 4.2.3). */
static SlideStatus no_status(const SlideInstance *instance, const char *reason) {
    return slide_report(instance, SLIDE_DISCARD, "%s", reason);
}

static SlideStatus get_time(SlideInstance *instance, fmi2StatusKind kind, fmi2Real *value) {
    if (value == NULL) {
        return slide_null(instance);
    }
    if (kind != fmi2LastSuccessfulTime) {
        return no_status(instance, "the only status of type Real is fmi2LastSuccessfulTime");
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
        return no_status(instance, "the only status of type Boolean is fmi2Terminated");
    }
    *value = fmi2False;
    return SLIDE_OK;
}

#if defined(__GNUC__) /* not all that the standard passes is used */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

/* The functions of an instance, and those that this FMU exports, because importers look them up,
 * but does not offer: name, arguments as the standard has them, states in which the function may
 * be called, what is called then. */
#define CALL(function, arguments, modes, call)                                                    \
    fmi2Status function arguments {                                                               \
        SlideInstance *instance = slide_enter(c, modes, __func__);                                \
        return instance == NULL ? fmi2Error : (fmi2Status)call;                                   \
    }
#define REFUSED(function, arguments, reason)                                                      \
    CALL(function, arguments, SLIDE_ANY_MODE, slide_refuse(instance, reason))
/* There are none of this type; asking for none of them is fine. */
#define NO_SUCH_TYPE(function, arguments)                                                         \
    CALL(function, arguments, SLIDE_ANY_MODE, slide_none_of_type(instance, nvr))

CALL(fmi2SetDebugLogging,
     (fmi2Component c, fmi2Boolean on, size_t n_categories, const fmi2String categories[]),
     SLIDE_ANY_MODE | SLIDE_BETWEEN,
     slide_set_logging(instance, on != fmi2False, n_categories, categories))
CALL(fmi2SetupExperiment,
     (fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
      fmi2Boolean stop_defined, fmi2Real stop),
     SLIDE_INSTANTIATED, slide_set_start(instance, start, stop_defined != fmi2False, stop))
CALL(fmi2EnterInitializationMode, (fmi2Component c), SLIDE_INSTANTIATED,
     slide_change_mode(instance, SLIDE_INITIALIZATION))
CALL(fmi2ExitInitializationMode, (fmi2Component c), SLIDE_INITIALIZATION,
     slide_change_mode(instance, SLIDE_STEPPING))
CALL(fmi2Terminate, (fmi2Component c), SLIDE_STEPPING,
     slide_change_mode(instance, SLIDE_TERMINATED))
CALL(fmi2Reset, (fmi2Component c), SLIDE_ANY_MODE, slide_reset(instance))

#define VARIABLES fmi2Component c, const fmi2ValueReference vr[], size_t nvr
CALL(fmi2GetReal, (VARIABLES, fmi2Real value[]), SLIDE_READABLE,
     slide_get(instance, &(SlideValues){vr, nvr, nvr, SLIDE_DOUBLES}, value))
CALL(fmi2SetReal, (VARIABLES, const fmi2Real value[]), SLIDE_SETTABLE,
     slide_set(instance, &(SlideValues){vr, nvr, nvr, SLIDE_DOUBLES}, value))
CALL(fmi2GetBoolean, (VARIABLES, fmi2Boolean value[]), SLIDE_READABLE,
     slide_get(instance, &(SlideValues){vr, nvr, nvr, SLIDE_INTS}, value))
CALL(fmi2SetBoolean, (VARIABLES, const fmi2Boolean value[]), SLIDE_SETTABLE,
     slide_set(instance, &(SlideValues){vr, nvr, nvr, SLIDE_INTS}, value))
CALL(fmi2SetRealInputDerivatives, (VARIABLES, const fmi2Integer order[], const fmi2Real value[]),
     SLIDE_SETTABLE, slide_set_rates(instance, vr, nvr, order, value))
CALL(fmi2GetDirectionalDerivative, /* of outputs by inputs; derivative.h says of what */
     (fmi2Component c, const fmi2ValueReference unknowns[], size_t n_unknowns,
      const fmi2ValueReference knowns[], size_t n_knowns, const fmi2Real seed[],
      fmi2Real sensitivity[]),
     SLIDE_DIFFERENTIABLE,
     slide_get_directional_derivative(
         instance, &(SlideSensitivities){unknowns, n_unknowns, knowns, n_knowns, seed, n_knowns,
                                         sensitivity, n_unknowns}))

CALL(fmi2GetFMUstate, (fmi2Component c, fmi2FMUstate *state), SLIDE_ANY_MODE,
     slide_save(instance, state))
CALL(fmi2SetFMUstate, (fmi2Component c, fmi2FMUstate state), SLIDE_ANY_MODE,
     slide_restore(instance, state))
CALL(fmi2FreeFMUstate, (fmi2Component c, fmi2FMUstate *state), SLIDE_ANY_MODE,
     slide_free_state(instance, state))
CALL(fmi2SerializedFMUstateSize, (fmi2Component c, fmi2FMUstate state, size_t *size),
     SLIDE_ANY_MODE, slide_serialized_size(instance, state, size))
CALL(fmi2SerializeFMUstate, (fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size),
     SLIDE_ANY_MODE, slide_serialize(instance, state, bytes, size))
CALL(fmi2DeSerializeFMUstate,
     (fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state), SLIDE_ANY_MODE,
     slide_deserialize(instance, bytes, size, state))

CALL(fmi2DoStep,
     (fmi2Component c, fmi2Real point, fmi2Real length, fmi2Boolean no_state_set_before),
     SLIDE_STEPPING, slide_do_step(instance, point, length, NULL))
CALL(fmi2GetRealStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Real *value),
     SLIDE_STEPPING | SLIDE_TERMINATED, get_time(instance, kind, value))
CALL(fmi2GetBooleanStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value),
     SLIDE_STEPPING | SLIDE_TERMINATED, get_end(instance, kind, value))

#define NO_DERIVATIVES                                                                            \
    "derivatives of outputs with respect to time are not offered, as modelDescription.xml says"
#define NEVER_PENDING "steps end before fmi2DoStep returns; nothing is pending"
#define NO_EXCHANGE "this FMU is for co-simulation, not for model exchange"

NO_SUCH_TYPE(fmi2GetInteger, (VARIABLES, fmi2Integer value[]))
NO_SUCH_TYPE(fmi2SetInteger, (VARIABLES, const fmi2Integer value[]))
NO_SUCH_TYPE(fmi2GetString, (VARIABLES, fmi2String value[]))
NO_SUCH_TYPE(fmi2SetString, (VARIABLES, const fmi2String value[]))

REFUSED(fmi2GetRealOutputDerivatives,
        (VARIABLES, const fmi2Integer order[], fmi2Real value[]), NO_DERIVATIVES)
REFUSED(fmi2CancelStep, (fmi2Component c), NEVER_PENDING)
CALL(fmi2GetStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Status *value), SLIDE_ANY_MODE,
     no_status(instance, NEVER_PENDING))
CALL(fmi2GetStringStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2String *value),
     SLIDE_ANY_MODE, no_status(instance, NEVER_PENDING))
CALL(fmi2GetIntegerStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value),
     SLIDE_ANY_MODE, no_status(instance, "FMI 2.0 defines no status of type Integer"))

REFUSED(fmi2EnterEventMode, (fmi2Component c), NO_EXCHANGE)
REFUSED(fmi2NewDiscreteStates, (fmi2Component c, fmi2EventInfo *info), NO_EXCHANGE)
REFUSED(fmi2EnterContinuousTimeMode, (fmi2Component c), NO_EXCHANGE)
REFUSED(fmi2CompletedIntegratorStep,
        (fmi2Component c, fmi2Boolean no_set_state, fmi2Boolean *enter_event_mode,
         fmi2Boolean *terminate),
        NO_EXCHANGE)
REFUSED(fmi2SetTime, (fmi2Component c, fmi2Real time), NO_EXCHANGE)
REFUSED(fmi2SetContinuousStates, (fmi2Component c, const fmi2Real x[], size_t nx), NO_EXCHANGE)
REFUSED(fmi2GetDerivatives, (fmi2Component c, fmi2Real derivatives[], size_t nx), NO_EXCHANGE)
REFUSED(fmi2GetEventIndicators, (fmi2Component c, fmi2Real indicators[], size_t ni), NO_EXCHANGE)
REFUSED(fmi2GetContinuousStates, (fmi2Component c, fmi2Real x[], size_t nx), NO_EXCHANGE)
REFUSED(fmi2GetNominalsOfContinuousStates, (fmi2Component c, fmi2Real nominals[], size_t nx),
        NO_EXCHANGE)
