/* One FMU instance: model, state, logger. Instances share nothing. */
#ifndef SLIDE_INSTANCE_H
#define SLIDE_INSTANCE_H

#include "fmi2.h"
#include "stream.h"

/* States of the FMI 2.0 co-simulation state machine, as bits. */
typedef enum {
    SLIDE_INSTANTIATED = 1,
    SLIDE_INITIALIZATION = 2,
    SLIDE_STEPPING = 4,
    SLIDE_TERMINATED = 8,
    SLIDE_ANY_MODE = 15
} SlideMode;

/* The instance begins the aligned part of its one memory block; name, model arrays and state
 * follow in it. */
typedef struct {
    void *block; /* what calloc gave */
    SlideModel model;
    SlideState state;
    fmi2CallbackFunctions callbacks;
    char *name;
    bool debug;
} SlideInstance;

/* Log a message (errors always, others when debug logging is on) and give the status back. */
__attribute__((format(printf, 3, 4))) fmi2Status slide_report(const SlideInstance *instance,
                                                              fmi2Status status,
                                                              const char *format, ...);

/* The instance behind a component, when the function may be called now; otherwise NULL, with a
 * logged message. modes: sum of SlideMode bits. */
SlideInstance *slide_enter(fmi2Component component, unsigned modes, const char *function);

/* Log that an argument pointer is missing. */
fmi2Status slide_null(const SlideInstance *instance, const char *function);

#endif
