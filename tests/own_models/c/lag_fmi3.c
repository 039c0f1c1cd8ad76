/* A lag as FMU of FMI 3.0 for co-simulation: lag * level' = drive - level, by exact steps of a held drive.
 * Value references: 0 drive, 1 level, both Float32; 2 excess = drive - level, Float64; 3 lag in s, Float32. */
#include <math.h>
#include <stdlib.h>

#include "fmi3FunctionTypes.h"

#ifdef _WIN32
#define API __declspec(dllexport)
#else
#define API
#endif

enum { DRIVE, LEVEL, EXCESS, LAG };

typedef struct {
    double drive, level, lag;
} Lag;

static void start(Lag *lag) {
    lag->drive = lag->level = 0.0;
    lag->lag = 0.5;
}

API fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                             fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode,
                                             fmi3Boolean early_return, const fmi3ValueReference required[],
                                             size_t n_required, fmi3InstanceEnvironment environment,
                                             fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    Lag *lag = malloc(sizeof(Lag));
    if (lag) start(lag);
    return lag;
}
API void fmi3FreeInstance(fmi3Instance c) { free(c); }
API fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean with_tolerance, fmi3Float64 tolerance,
                                           fmi3Float64 begin, fmi3Boolean with_end, fmi3Float64 end) {
    return fmi3OK;
}
API fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { /* the drive has always acted */
    Lag *lag = c;
    lag->level = lag->drive;
    return fmi3OK;
}
API fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
API fmi3Status fmi3Reset(fmi3Instance c) {
    start(c);
    return fmi3OK;
}
API fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 begin, fmi3Float64 step, fmi3Boolean no_way_back,
                          fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached) {
    Lag *lag = c;
    lag->level += (1.0 - exp(-step / lag->lag)) * (lag->drive - lag->level);
    *event = fmi3False;
    *terminate = lag->drive > 1.0; /* beyond its range */
    *early = lag->drive < -1.0;
    *reached = begin + step;
    return fmi3OK;
}
API fmi3Status fmi3GetFloat32(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float32 values[],
                              size_t n_values) {
    const Lag *lag = c;
    for (size_t i = 0; i < n; i++) {
        if (r[i] == DRIVE) values[i] = (float)lag->drive;
        else if (r[i] == LEVEL) values[i] = (float)lag->level;
        else if (r[i] == LAG) values[i] = (float)lag->lag;
        else return fmi3Error;
    }
    return fmi3OK;
}
API fmi3Status fmi3SetFloat32(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float32 values[],
                              size_t n_values) {
    Lag *lag = c;
    for (size_t i = 0; i < n; i++) {
        if (r[i] == DRIVE) lag->drive = values[i];
        else if (r[i] == LAG) lag->lag = values[i];
        else return fmi3Error;
    }
    return fmi3OK;
}
API fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 values[],
                              size_t n_values) {
    const Lag *lag = c;
    for (size_t i = 0; i < n; i++) {
        if (r[i] != EXCESS) return fmi3Error;
        values[i] = lag->drive - lag->level;
    }
    return fmi3OK;
}

/* What the FMU has not. */
#define NOT_THERE(name) API fmi3Status name(void) { return fmi3Error; }
