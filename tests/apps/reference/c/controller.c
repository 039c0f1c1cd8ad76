/* A controller as FMI 2.0 co-simulation FMU, to close a loop around a surrogate:
 * force = GAIN * (target(t) - position), taken in and given out at communication points. */
#include "fmi2Functions.h"

#include <math.h>
#include <stdlib.h>

enum { POSITION, FORCE };

static const double GAIN = 150, AMPLITUDE = 2, FREQUENCY = 2, BEGIN = 0.3;

typedef struct {
    double time, position;
} Controller;

static double target(double time) {
    return time < BEGIN ? 0 : AMPLITUDE * sin(FREQUENCY * (time - BEGIN));
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging) {
    (void)name, (void)guid, (void)location, (void)functions, (void)visible, (void)logging;
    return type == fmi2CoSimulation ? calloc(1, sizeof(Controller)) : NULL;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    ((Controller *)c)->time = start;
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t count,
                       const fmi2Real values[]) {
    for (size_t i = 0; i < count; ++i) {
        if (references[i] != POSITION) {
            return fmi2Error;
        }
        ((Controller *)c)->position = values[i];
    }
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t count,
                       fmi2Real values[]) {
    const Controller *controller = c;
    for (size_t i = 0; i < count; ++i) {
        double force = GAIN * (target(controller->time) - controller->position);
        values[i] = references[i] == FORCE ? force : controller->position;
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_rollback) {
    (void)no_rollback;
    ((Controller *)c)->time = time + step;
    return fmi2OK;
}

/* Nothing to do. */
#define IDLE(name, ...) \
    fmi2Status name(__VA_ARGS__) { return fmi2OK; }
/* Not offered: importers look for all functions of the standard, whether or not they are. */
#define REFUSED(name, ...) \
    fmi2Status name(__VA_ARGS__) { return fmi2Error; }

#if defined(__clang__) || defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
typedef const fmi2ValueReference *References;
IDLE(fmi2EnterInitializationMode, fmi2Component c)
IDLE(fmi2ExitInitializationMode, fmi2Component c)
IDLE(fmi2Terminate, fmi2Component c)
IDLE(fmi2Reset, fmi2Component c)
IDLE(fmi2SetDebugLogging, fmi2Component c, fmi2Boolean on, size_t n, const fmi2String *categories)
REFUSED(fmi2GetInteger, fmi2Component c, References r, size_t n, fmi2Integer *v)
REFUSED(fmi2GetBoolean, fmi2Component c, References r, size_t n, fmi2Boolean *v)
REFUSED(fmi2GetString, fmi2Component c, References r, size_t n, fmi2String *v)
REFUSED(fmi2SetInteger, fmi2Component c, References r, size_t n, const fmi2Integer *v)
REFUSED(fmi2SetBoolean, fmi2Component c, References r, size_t n, const fmi2Boolean *v)
REFUSED(fmi2SetString, fmi2Component c, References r, size_t n, const fmi2String *v)
REFUSED(fmi2GetFMUstate, fmi2Component c, fmi2FMUstate *s)
REFUSED(fmi2SetFMUstate, fmi2Component c, fmi2FMUstate s)
REFUSED(fmi2FreeFMUstate, fmi2Component c, fmi2FMUstate *s)
REFUSED(fmi2SerializedFMUstateSize, fmi2Component c, fmi2FMUstate s, size_t *n)
REFUSED(fmi2SerializeFMUstate, fmi2Component c, fmi2FMUstate s, fmi2Byte *b, size_t n)
REFUSED(fmi2DeSerializeFMUstate, fmi2Component c, const fmi2Byte *b, size_t n, fmi2FMUstate *s)
REFUSED(fmi2GetDirectionalDerivative, fmi2Component c, References u, size_t nu, References k,
        size_t nk, const fmi2Real *dk, fmi2Real *du)
REFUSED(fmi2SetRealInputDerivatives, fmi2Component c, References r, size_t n,
        const fmi2Integer *order, const fmi2Real *v)
REFUSED(fmi2GetRealOutputDerivatives, fmi2Component c, References r, size_t n,
        const fmi2Integer *order, fmi2Real *v)
REFUSED(fmi2CancelStep, fmi2Component c)
REFUSED(fmi2GetStatus, fmi2Component c, const fmi2StatusKind k, fmi2Status *v)
REFUSED(fmi2GetRealStatus, fmi2Component c, const fmi2StatusKind k, fmi2Real *v)
REFUSED(fmi2GetIntegerStatus, fmi2Component c, const fmi2StatusKind k, fmi2Integer *v)
REFUSED(fmi2GetBooleanStatus, fmi2Component c, const fmi2StatusKind k, fmi2Boolean *v)
REFUSED(fmi2GetStringStatus, fmi2Component c, const fmi2StatusKind k, fmi2String *v)
