/* A tank with a valve as FMU of FMI 3.0 for model exchange, with state events and a time event.
 * level' = pump * inflow - level - (valve is open ? 4 (level - threshold) : 0), in 1/s; the valve opens
 * and closes when the level passes the threshold; from half a second on the pump is twice as strong.
 * Value references: 0 inflow, 1 outflow, 2 threshold, 3 level, 4 its rate, 5 the event indicator,
 * 6 valve, 7 depth, an array of two inputs that nothing depends on. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3FunctionTypes.h"

#ifdef _WIN32
#define API __declspec(dllexport)
#else
#define API
#endif

enum { INFLOW, OUTFLOW, THRESHOLD, LEVEL, RATE, INDICATOR, VALVE };

static const double PUMP_CHANGES = 0.5;

typedef struct {
    double inflow, threshold, level, time, pump;
    int open;
} Tank;

static void start(Tank *tank) {
    const Tank fresh = {0.0, 0.2, 0.0, 0.0, 1.0, 0};
    *tank = fresh;
}
static double excess(const Tank *tank) { return tank->open ? 4.0 * (tank->level - tank->threshold) : 0.0; }

API fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                              fmi3Boolean visible, fmi3Boolean logging,
                                              fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    Tank *tank = malloc(sizeof(Tank));
    if (tank) start(tank);
    return tank;
}
API void fmi3FreeInstance(fmi3Instance c) { free(c); }
API fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean with_tolerance, fmi3Float64 tolerance,
                                           fmi3Float64 begin, fmi3Boolean with_end, fmi3Float64 end) {
    return fmi3OK;
}
API fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return fmi3OK; }
API fmi3Status fmi3EnterEventMode(fmi3Instance c) { return fmi3OK; }
API fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { return fmi3OK; }
API fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
API fmi3Status fmi3Reset(fmi3Instance c) {
    start(c);
    return fmi3OK;
}
API fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) {
    ((Tank *)c)->time = time;
    return fmi3OK;
}
API fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *end,
                                        fmi3Boolean *nominals_changed, fmi3Boolean *states_changed,
                                        fmi3Boolean *timed, fmi3Float64 *next) {
    Tank *tank = c;
    tank->open = tank->level >= tank->threshold;
    tank->pump = tank->time >= PUMP_CHANGES ? 2.0 : 1.0;
    *again = *end = *nominals_changed = *states_changed = fmi3False;
    *timed = tank->time < PUMP_CHANGES;
    *next = PUMP_CHANGES;
    return fmi3OK;
}
API fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean forget, fmi3Boolean *event,
                                           fmi3Boolean *end) {
    *event = *end = fmi3False;
    return fmi3OK;
}
API fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
    ((Tank *)c)->level = x[0];
    return fmi3OK;
}
API fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    x[0] = ((Tank *)c)->level;
    return fmi3OK;
}
API fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t n) {
    nominals[0] = 1.0;
    return fmi3OK;
}
API fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 rates[], size_t n) {
    const Tank *tank = c;
    rates[0] = tank->pump * tank->inflow - tank->level - excess(tank);
    return fmi3OK;
}
API fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) {
    const Tank *tank = c; /* not zero where the valve has just changed: the event is over then */
    z[0] = tank->level - tank->threshold + (tank->open ? 1e-12 : -1e-12);
    return fmi3OK;
}
API fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 values[],
                              size_t n_values) {
    const Tank *tank = c;
    for (size_t i = 0; i < n; i++) {
        if (r[i] == INFLOW) values[i] = tank->inflow;
        else if (r[i] == OUTFLOW) values[i] = tank->level + excess(tank);
        else if (r[i] == THRESHOLD) values[i] = tank->threshold;
        else if (r[i] == LEVEL) values[i] = tank->level;
        else if (r[i] == RATE) fmi3GetContinuousStateDerivatives(c, &values[i], 1);
        else return fmi3Error;
    }
    return fmi3OK;
}
API fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 values[],
                              size_t n_values) {
    Tank *tank = c;
    for (size_t i = 0; i < n; i++) {
        if (r[i] == INFLOW) tank->inflow = values[i];
        else if (r[i] == THRESHOLD) tank->threshold = values[i];
        else return fmi3Error;
    }
    return fmi3OK;
}

/* What the FMU has not; nobody calls these with arguments that matter. */
#define NOT_THERE(name) API fmi3Status name(void) { return fmi3Error; }
