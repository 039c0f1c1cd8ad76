/* A lag as FMU of FMI 2.0 for co-simulation, which is strict in what it takes: one instance (ONLY_ONE),
 * multiples of one step (ONLY_STEP), one start time (START), no time beyond an end (END, or where it
 * is told one and takes it, TOLD_END, that). What is wrong it logs by a format and its numbers. With CLOCK, a time, another drive acts from that time on.
 * AT_START and AT_STEP are what else it does then, and with STATES it goes back. Value references: 0 drive, 1 level. */
#include <math.h>
#include <stdio.h>
#include <signal.h>
#include <unistd.h>
#include <stdlib.h>

#include "fmi2Functions.h"

#define LAG 0.1

typedef struct {
    double drive, level, time, end;
    const fmi2CallbackFunctions *callbacks;
} Lag;

static int alive = 0;

#define REFUSE(calls, ...)                                                                          \
    do {                                                                                            \
        (calls)->logger((calls)->componentEnvironment, "lag", fmi2Error, "error", __VA_ARGS__);     \
        return fmi2Error;                                                                           \
    } while (0)

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    return fmi2OK;
}
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
#ifdef ONLY_ONE
    if (alive > 0) {
        callbacks->logger(callbacks->componentEnvironment, name, fmi2Error, "error", "%d of %d instances are there",
                          alive, 1);
        return NULL;
    }
#endif
    alive++;
    Lag *lag = calloc(1, sizeof(Lag));
    lag->callbacks = callbacks;
    return lag;
}
void fmi2FreeInstance(fmi2Component c) {
    alive--;
    free(c);
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
#ifdef START
    if (start != START) REFUSE(((Lag *)c)->callbacks, "start time must be %g s, got %g s", START, start);
#endif
#ifdef AT_START
    AT_START
#endif
#ifdef END
    ((Lag *)c)->end = END;
#endif
#ifdef TOLD_END
    if (has_stop) ((Lag *)c)->end = stop;
#endif
    ((Lag *)c)->time = start;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    ((Lag *)c)->level = ((Lag *)c)->drive;
    return fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) {
    ((Lag *)c)->drive = ((Lag *)c)->level = 0.0;
    return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    for (size_t i = 0; i < n; i++) v[i] = r[i] == 0 ? ((Lag *)c)->drive : ((Lag *)c)->level;
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    for (size_t i = 0; i < n; i++) ((Lag *)c)->drive = v[i];
    return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real begin, fmi2Real step, fmi2Boolean forget) {
    Lag *lag = c;
#ifdef AT_STEP
    AT_STEP
#endif
    if (fabs(begin - lag->time) > 1e-9) REFUSE(lag->callbacks, "expected the time %g s, got %g s", lag->time, begin);
#ifdef ONLY_STEP
    if (fabs(step / ONLY_STEP - round(step / ONLY_STEP)) > 1e-6 || step < 0.5 * ONLY_STEP)
        REFUSE(lag->callbacks, "a step of %g s is no multiple of %g s", step, ONLY_STEP);
#endif
#ifdef END
    if (begin + step > lag->end + 1e-9) REFUSE(lag->callbacks, "%.2f s is beyond the end", begin + step);
#endif
    double drive = lag->drive;
#ifdef CLOCK
    drive += begin >= CLOCK ? 0.5 : 0.0;
#endif
    lag->level += (1.0 - exp(-step / LAG)) * (drive - lag->level);
    lag->time = begin + step;
    return fmi2OK;
}

#ifdef STATES
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (*state == NULL) *state = malloc(sizeof(Lag));
    *(Lag *)*state = *(Lag *)c;
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    *(Lag *)c = *(Lag *)state;
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    free(*state);
    *state = NULL;
    return fmi2OK;
}
#endif
#include "fmi2_not_there.h"
NOT_THERE(fmi2GetDirectionalDerivative, fmi2Component c, const fmi2ValueReference u[], size_t n,
          const fmi2ValueReference k[], size_t m, const fmi2Real along[], fmi2Real changes[])
NOT_THERE(fmi2SetRealInputDerivatives, fmi2Component c, const fmi2ValueReference r[], size_t n,
          const fmi2Integer o[], const fmi2Real v[])
