#include "fmu.h"

#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "variable_kinds.h"
#include "instance.h"
#include "target.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static unsigned messages;

static void hear_2(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                   fmi2String category, fmi2String message, ...) {
    (void)environment, (void)instance, (void)status, (void)category;
    messages += message[0] != '\0';
}

static void hear_3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                   fmi3String message) {
    (void)environment, (void)status, (void)category;
    messages += message[0] != '\0';
}

/* The instance of FMI 3.0 that shows its intermediate states, or NULL. */
static void *watched;

/* Reads, sets and asks for an early end, now or later: always the same at the same time. */
static void watch(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean set_requested,
                  fmi3Boolean get_allowed, fmi3Boolean step_finished, fmi3Boolean can_return,
                  fmi3Boolean *return_requested, fmi3Float64 *return_time) {
    (void)environment, (void)get_allowed, (void)step_finished, (void)can_return;
    const double phase = fmod(time, 0.035);
    for (fmi3ValueReference kind = 0; watched != NULL && kind < 8; ++kind) {
        const fmi3ValueReference reference = kind * SLIDE_REFERENCES_PER_KIND;
        double value;
        fmi3GetFloat64(watched, &reference, 1, &value, 1);
    }
    if (watched != NULL && set_requested && phase > 0.01) {
        const fmi3ValueReference input = 0;
        fmi3SetFloat64(watched, &input, 1, &phase, 1);
    }
    *return_requested = phase > 0.03;
    *return_time = time + fmod(time, 0.014);
}

void fuzz_watch(const FuzzFmu *fmu) { watched = fmu == NULL ? NULL : fmu->component; }

static int told(int status) {
    fuzz_expect(status >= 0 && status <= fmi2Error, "a status of the standard");
    fuzz_expect(status == fmi2OK || messages > 0, "a message with a refusal");
    messages = 0;
    return status;
}

void *fuzz_instantiate(int standard, const char *name, const char *guid, const char *location,
                       bool debug, bool watches) {
    static const fmi2CallbackFunctions callbacks = {hear_2, NULL, NULL, NULL, NULL};
    messages = 0;
    void *made =
        standard == 2
            ? fmi2Instantiate(name, fmi2CoSimulation, guid, location, &callbacks, false, debug)
            : fmi3InstantiateCoSimulation(name, guid, location, false, debug, false, watches,
                                          NULL, 0, NULL, hear_3, watches ? watch : NULL);
    fuzz_expect(made != NULL || messages > 0, "a message with a refusal");
    messages = 0;
    return made;
}

void fuzz_free(FuzzFmu *fmu) {
    if (fmu->standard == 2) {
        fmi2FreeInstance(fmu->component);
    } else {
        fmi3FreeInstance(fmu->component);
    }
    fmu->component = NULL;
}

int fuzz_set_logging(FuzzFmu *fmu, bool on, size_t count, const char *const categories[]) {
    void *c = fmu->component;
    return told(fmu->standard == 2 ? (int)fmi2SetDebugLogging(c, on, count, categories)
                                   : (int)fmi3SetDebugLogging(c, on, count, categories));
}

int fuzz_set_up(FuzzFmu *fmu, double start, bool stops, double stop) {
    void *c = fmu->component;
    return told(fmu->standard == 2
                    ? (int)fmi2SetupExperiment(c, true, 1e-6, start, stops, stop)
                    : (int)fmi3EnterInitializationMode(c, true, 1e-6, start, stops, stop));
}

int fuzz_enter_initialization(FuzzFmu *fmu, double start) {
    return fmu->standard == 2 ? told(fmi2EnterInitializationMode(fmu->component))
                              : fuzz_set_up(fmu, start, false, 0);
}

int fuzz_exit_initialization(FuzzFmu *fmu) {
    void *c = fmu->component;
    return told(fmu->standard == 2 ? (int)fmi2ExitInitializationMode(c)
                                   : (int)fmi3ExitInitializationMode(c));
}

int fuzz_terminate(FuzzFmu *fmu) {
    void *c = fmu->component;
    return told(fmu->standard == 2 ? (int)fmi2Terminate(c) : (int)fmi3Terminate(c));
}

int fuzz_reset(FuzzFmu *fmu) {
    void *c = fmu->component;
    return told(fmu->standard == 2 ? (int)fmi2Reset(c) : (int)fmi3Reset(c));
}

int fuzz_set(FuzzFmu *fmu, const uint32_t *references, size_t count, const double *values,
             size_t n_values) {
    void *c = fmu->component;
    return told(fmu->standard == 2
                    ? (int)fmi2SetReal(c, references, count, values)
                    : (int)fmi3SetFloat64(c, references, count, values, n_values));
}

int fuzz_get(FuzzFmu *fmu, const uint32_t *references, size_t count, double *values,
             size_t n_values) {
    void *c = fmu->component;
    return told(fmu->standard == 2
                    ? (int)fmi2GetReal(c, references, count, values)
                    : (int)fmi3GetFloat64(c, references, count, values, n_values));
}

int fuzz_get_boolean(FuzzFmu *fmu, const uint32_t *reference, int *truth) {
    if (fmu->standard == 2) {
        return told(fmi2GetBoolean(fmu->component, reference, 1, truth));
    }
    fmi3Boolean value = *truth == 1;
    const int status = told(fmi3GetBoolean(fmu->component, reference, 1, &value, 1));
    *truth = value;
    return status;
}

double fuzz_time(const FuzzFmu *fmu) {
    const SlideInstance *instance = fmu->component;
    return slide_clock_time(&instance->state.head->clock);
}

static int do_step(FuzzFmu *fmu, double time, double length) {
    void *c = fmu->component;
    if (fmu->standard == 2) {
        return told(fmi2DoStep(c, time, length, true));
    }
    bool event = true, terminate = true, early = true;
    double last = 0;
    const unsigned mode = ((const SlideInstance *)c)->state.head->mode;
    const int status = told(fmi3DoStep(c, time, length, true, &event, &terminate, &early, &last));
    fuzz_expect(mode != SLIDE_STEPPING || (last == fuzz_time(fmu) && !event && !terminate),
                "the time that was reached, and no event");
    return status;
}

enum { FOLLOWED = 5, READ = 8 };

/* What the FMU gives from a state on: the first variable of every kind now and after steps under
 * the start inputs, of which one takes in the whole past anew. */
static void follow(FuzzFmu *fmu, void *state, double found[FOLLOWED][READ]) {
    static const double lengths[FOLLOWED] = {0.6, 1, 3, 1, 1};
    const SlideModel *model = &((const SlideInstance *)fmu->component)->model;
    fuzz_expect(fuzz_restore(fmu, state) == 0, "that its own state is taken");
    for (size_t i = 0; i < FOLLOWED; ++i) {
        for (uint32_t kind = 0; kind < READ; ++kind) {
            const uint32_t reference = kind * SLIDE_REFERENCES_PER_KIND;
            found[i][kind] = 0;
            fuzz_get(fmu, &reference, 1, &found[i][kind], 1);
        }
        for (uint32_t input = 0; input < model->n_inputs; ++input) {
            fuzz_set(fmu, &input, 1, &model->starts[input], 1);
        }
        do_step(fmu, fuzz_time(fmu), lengths[i] * model->step);
    }
}

/* A refused step changes nothing that is seen later. */
static void compare(FuzzFmu *fmu, void *before) {
    void *after = NULL;
    double expected[FOLLOWED][READ], found[FOLLOWED][READ];
    fuzz_expect(fuzz_save(fmu, &after) == 0, "a state at any time");
    follow(fmu, before, expected);
    follow(fmu, after, found);
    fuzz_expect(memcmp(found, expected, sizeof found) == 0, "that a refused step changes nothing");
    fuzz_expect(fuzz_restore(fmu, after) == 0, "that its own state is taken");
    fuzz_free_state(fmu, &after);
}

int fuzz_do_step(FuzzFmu *fmu, double time, double length) {
    void *before = NULL;
    fuzz_expect(fuzz_save(fmu, &before) == 0, "a state at any time");
    const int status = do_step(fmu, time, length);
    if (status != 0 && !fmu->tampered) {
        compare(fmu, before);
    }
    fuzz_free_state(fmu, &before);
    return status;
}

int fuzz_save(FuzzFmu *fmu, void **state) {
    void *c = fmu->component;
    return told(fmu->standard == 2 ? (int)fmi2GetFMUstate(c, state)
                                   : (int)fmi3GetFMUState(c, state));
}

int fuzz_restore(FuzzFmu *fmu, void *state) {
    void *c = fmu->component;
    return told(fmu->standard == 2 ? (int)fmi2SetFMUstate(c, state)
                                   : (int)fmi3SetFMUState(c, state));
}

int fuzz_free_state(FuzzFmu *fmu, void **state) {
    void *c = fmu->component;
    return told(fmu->standard == 2 ? (int)fmi2FreeFMUstate(c, state)
                                   : (int)fmi3FreeFMUState(c, state));
}

int fuzz_serialized_size(FuzzFmu *fmu, void *state, size_t *size) {
    void *c = fmu->component;
    return told(fmu->standard == 2 ? (int)fmi2SerializedFMUstateSize(c, state, size)
                                   : (int)fmi3SerializedFMUStateSize(c, state, size));
}

int fuzz_serialize(FuzzFmu *fmu, void *state, unsigned char *bytes, size_t size) {
    void *c = fmu->component;
    return told(fmu->standard == 2
                    ? (int)fmi2SerializeFMUstate(c, state, (fmi2Byte *)bytes, size)
                    : (int)fmi3SerializeFMUState(c, state, bytes, size));
}

int fuzz_deserialize(FuzzFmu *fmu, const unsigned char *bytes, size_t size, void **state) {
    void *c = fmu->component;
    return told(fmu->standard == 2
                    ? (int)fmi2DeSerializeFMUstate(c, (const fmi2Byte *)bytes, size, state)
                    : (int)fmi3DeserializeFMUState(c, bytes, size, state));
}

int fuzz_derivative(FuzzFmu *fmu, bool adjoint, const uint32_t *unknowns, size_t n_unknowns,
                    const uint32_t *knowns, size_t n_knowns, const double *seed,
                    double *sensitivity) {
    void *c = fmu->component;
    if (fmu->standard == 2) {
        return told(fmi2GetDirectionalDerivative(c, unknowns, n_unknowns, knowns, n_knowns, seed,
                                                 sensitivity));
    }
    return told(adjoint
                    ? (int)fmi3GetAdjointDerivative(c, unknowns, n_unknowns, knowns, n_knowns,
                                                    seed, n_unknowns, sensitivity, n_knowns)
                    : (int)fmi3GetDirectionalDerivative(c, unknowns, n_unknowns, knowns, n_knowns,
                                                        seed, n_knowns, sensitivity, n_unknowns));
}

int fuzz_time_derivatives(FuzzFmu *fmu, bool of_inputs, const uint32_t *references, size_t count,
                          const int32_t *orders, double *values) {
    void *c = fmu->component;
    if (fmu->standard == 3) {
        return told(fmi3GetOutputDerivatives(c, references, count, orders, values, count));
    }
    return told(of_inputs ? (int)fmi2SetRealInputDerivatives(c, references, count, orders, values)
                          : (int)fmi2GetRealOutputDerivatives(c, references, count, orders,
                                                              values));
}

static int ask_2(fmi2Component c, unsigned which, size_t count) {
    double value;
    fmi2Boolean truth;
    switch (which % 16) {
    case 0:
        return (int)fmi2GetRealStatus(c, (fmi2StatusKind)(count % 4), &value);
    case 1:
        return (int)fmi2GetBooleanStatus(c, (fmi2StatusKind)(count % 4), &truth);
    case 2:
        return (int)fmi2GetIntegerStatus(c, fmi2PendingStatus, NULL);
    case 3:
        return (int)fmi2GetStringStatus(c, fmi2PendingStatus, NULL);
    case 4:
        return (int)fmi2GetStatus(c, fmi2DoStepStatus, NULL);
    case 5:
        return (int)fmi2CancelStep(c);
    case 6:
        return (int)fmi2GetInteger(c, NULL, count, NULL);
    case 7:
        return (int)fmi2SetBoolean(c, NULL, count, NULL);
    case 8:
        return (int)fmi2GetString(c, NULL, count, NULL);
    case 9:
        return (int)fmi2EnterEventMode(c);
    case 10:
        return (int)fmi2NewDiscreteStates(c, NULL);
    case 11:
        return (int)fmi2GetContinuousStates(c, NULL, count);
    case 12:
        return (int)fmi2GetRealStatus(c, fmi2LastSuccessfulTime, NULL);
    case 13:
        return (int)fmi2SetTime(c, 0);
    case 14:
        return (int)fmi2CompletedIntegratorStep(c, true, NULL, NULL);
    default:
        return (int)fmi2GetDerivatives(c, NULL, count);
    }
}

static int ask_3(fmi3Instance c, unsigned which, size_t count) {
    switch (which % 16) {
    case 0:
        return (int)fmi3EnterEventMode(c);
    case 1:
        return (int)fmi3EnterStepMode(c);
    case 2:
        return (int)fmi3EnterConfigurationMode(c);
    case 3:
        return (int)fmi3ExitConfigurationMode(c);
    case 4:
        return (int)fmi3GetFloat32(c, NULL, count, NULL, count);
    case 5:
        return (int)fmi3SetInt64(c, NULL, count, NULL, count);
    case 6:
        return (int)fmi3GetBinary(c, NULL, count, NULL, NULL, count);
    case 7:
        return (int)fmi3GetClock(c, NULL, count, NULL);
    case 8:
        return (int)fmi3GetString(c, NULL, count, NULL, count);
    case 9:
        return (int)fmi3SetBoolean(c, NULL, count, NULL, count);
    case 10:
        return (int)fmi3GetIntervalDecimal(c, NULL, count, NULL, NULL);
    case 11:
        return (int)fmi3UpdateDiscreteStates(c, NULL, NULL, NULL, NULL, NULL, NULL);
    case 12:
        return (int)fmi3GetNumberOfVariableDependencies(c, (fmi3ValueReference)count, NULL);
    case 13:
        return (int)fmi3EvaluateDiscreteStates(c);
    case 14:
        return (int)fmi3DoStep(c, 0, 1, true, NULL, NULL, NULL, NULL);
    default:
        return (int)fmi3GetNumberOfEventIndicators(c, NULL);
    }
}

int fuzz_ask(FuzzFmu *fmu, unsigned which, size_t count) {
    void *c = fmu->component;
    return told(fmu->standard == 2 ? ask_2(c, which, count) : ask_3(c, which, count));
}
