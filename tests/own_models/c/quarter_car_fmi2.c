/* The quarter car as FMU of FMI 2.0, for model exchange and for co-simulation.
 * Value references: 0 road, 1 .. 3 outputs, 10 .. parameters, 20 .. states, 30 .. their rates.
 * With TRAPS, the FMU fails and crashes where the parameters 40 and 41 say, refuses steps of less than
 * 1 ms, and does not reset. */
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "quarter_car.h"

enum { ROAD = 0, OUTPUT = 1, PARAMETER = 10, STATE = 20, RATE = 30, FAIL_ABOVE = 40, CRASH_ABOVE = 41 };

/* Where the parameter 41 starts. */
#ifndef CRASH_START
#define CRASH_START 1e9
#endif

typedef struct {
    double p[PARAMETERS], x[STATES], road, slope, time, fail_above, crash_above;
    const fmi2CallbackFunctions *callbacks;
    char name[64];
} Car;

static void start(Car *car) {
    memcpy(car->p, START_PARAMETERS, sizeof car->p);
    car->road = car->slope = car->time = 0.0;
    car->fail_above = 1e9;
    car->crash_above = CRASH_START;
    memset(car->x, 0, sizeof car->x);
}

static fmi2Status evaluate(Car *car, double *rates, double *outputs) {
#ifdef TRAPS
    if (fabs(car->road) > car->crash_above) *(volatile int *)0 = 1; /* a segmentation fault */
    if (fabs(car->road) > car->fail_above) {
        car->callbacks->logger(car->callbacks->componentEnvironment, car->name, fmi2Discard, "logStatusDiscard",
                               "the wheel leaves the road");
        return fmi2Discard;
    }
#endif
    equations(car->p, car->x, car->road, rates, outputs);
    return fmi2OK;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    Car *car = calloc(1, sizeof(Car));
    if (!car) return NULL;
    strncpy(car->name, name, sizeof car->name - 1);
    car->callbacks = callbacks;
    start(car);
    return car;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean with_tolerance, fmi2Real tolerance, fmi2Real begin,
                               fmi2Boolean with_end, fmi2Real end) {
    ((Car *)c)->time = begin;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { /* the car stands on the road where it is */
    Car *car = c;
    car->x[0] = car->x[1] = car->road;
    return fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) {
    Car *car = c;
#ifndef TRAPS
    start(car);
#endif
    (void)car;
    return fmi2OK;
}

static double *place(Car *car, unsigned reference) {
    if (reference == ROAD) return &car->road;
    if (reference >= PARAMETER && reference < PARAMETER + PARAMETERS) return &car->p[reference - PARAMETER];
    if (reference >= STATE && reference < STATE + STATES) return &car->x[reference - STATE];
    if (reference == FAIL_ABOVE) return &car->fail_above;
    return reference == CRASH_ABOVE ? &car->crash_above : NULL;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2Real values[]) {
    double rates[STATES], outputs[OUTPUTS];
    if (evaluate(c, rates, outputs) != fmi2OK) return fmi2Discard;
    for (size_t i = 0; i < n; i++) {
        const double *found = place(c, references[i]);
        const unsigned r = references[i];
        if (!found && r >= OUTPUT && r < OUTPUT + OUTPUTS) found = &outputs[r - OUTPUT];
        if (!found && r >= RATE && r < RATE + STATES) found = &rates[r - RATE];
        if (!found) return fmi2Error;
        values[i] = *found;
    }
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t n, const fmi2Real values[]) {
    for (size_t i = 0; i < n; i++) {
        double *found = place(c, references[i]);
        if (!found) return fmi2Error;
        *found = values[i];
        if (references[i] == ROAD) ((Car *)c)->slope = 0.0;
    }
    return fmi2OK;
}

/* Model exchange. */
fmi2Status fmi2EnterEventMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    memset(info, 0, sizeof *info);
    return fmi2OK;
}
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean forget, fmi2Boolean *event, fmi2Boolean *end) {
    *event = *end = fmi2False;
    return fmi2OK;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    ((Car *)c)->time = time;
    return fmi2OK;
}
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    memcpy(((Car *)c)->x, x, n * sizeof *x);
    return fmi2OK;
}
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    memcpy(x, ((Car *)c)->x, n * sizeof *x);
    return fmi2OK;
}
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t n) {
    const double sizes[STATES] = {0.1, 0.1, 1.0, 1.0};
    memcpy(nominals, sizes, n * sizeof *nominals);
    return fmi2OK;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real rates[], size_t n) {
    double outputs[OUTPUTS];
    return evaluate(c, rates, outputs);
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) { return n ? fmi2Error : fmi2OK; }

/* How the rates of the states change along a direction of the states. */
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t n_unknowns,
                                        const fmi2ValueReference knowns[], size_t n_knowns, const fmi2Real along[],
                                        fmi2Real changes[]) {
    const Car *car = c;
    const double *p = car->p, travel = car->x[0] - car->x[1], speed = car->x[2] - car->x[3];
    const double stiffness = p[SPRING] + 3.0 * p[BUMP_STOP] * travel * travel;
    const double damping = p[DAMPER] * (1.0 + p[ASYMMETRY] * speed / sqrt(speed * speed + BEND * BEND));
    double d[STATES] = {0.0, 0.0, 0.0, 0.0};
    for (size_t i = 0; i < n_knowns; i++) {
        if (knowns[i] < STATE || knowns[i] >= STATE + STATES) return fmi2Error;
        d[knowns[i] - STATE] = along[i];
    }
    const double force = stiffness * (d[0] - d[1]) + damping * (d[2] - d[3]);
    const double rates[STATES] = {d[2], d[3], -force / p[BODY_MASS], (force - p[TYRE] * d[1]) / p[WHEEL_MASS]};
    for (size_t i = 0; i < n_unknowns; i++) {
        if (unknowns[i] < RATE || unknowns[i] >= RATE + STATES) return fmi2Error;
        changes[i] = rates[unknowns[i] - RATE];
    }
    return fmi2OK;
}

/* Co-simulation: steps of at most 0.2 ms by the method of Runge and Kutta. */
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference references[], size_t n,
                                       const fmi2Integer orders[], const fmi2Real values[]) {
    for (size_t i = 0; i < n; i++) {
        if (references[i] != ROAD || orders[i] != 1) return fmi2Error;
        ((Car *)c)->slope = values[i];
    }
    return fmi2OK;
}
static fmi2Status rate_at(Car *car, const double *x, double road, double *rates) {
    double outputs[OUTPUTS];
    Car moved = *car;
    memcpy(moved.x, x, sizeof moved.x);
    moved.road = road;
    return evaluate(&moved, rates, outputs);
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real begin, fmi2Real step, fmi2Boolean forget) {
    Car *car = c;
    const int count = (int)ceil(step / 2e-4 - 1e-9);
#ifdef TRAPS
    if (step < 1e-3) return fmi2Discard;
#endif
    const double h = step / count;
    for (int k = 0; k < count; k++) {
        const double factors[4] = {0.0, 0.5, 0.5, 1.0};
        double rates[4][STATES], x[STATES];
        for (int stage = 0; stage < 4; stage++) {
            for (int i = 0; i < STATES; i++)
                x[i] = car->x[i] + (stage ? factors[stage] * h * rates[stage - 1][i] : 0.0);
            if (rate_at(car, x, car->road + factors[stage] * h * car->slope, rates[stage]) != fmi2OK)
                return fmi2Discard;
        }
        for (int i = 0; i < STATES; i++)
            car->x[i] += h / 6 * (rates[0][i] + 2 * rates[1][i] + 2 * rates[2][i] + rates[3][i]);
        car->road += h * car->slope;
    }
    car->time = begin + step;
    return fmi2OK;
}

#include "fmi2_not_there.h"
