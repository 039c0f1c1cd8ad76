/* One FMU instance: model, state, logger. Instances share nothing. An instance knows no standard:
 * fmi2_*.c and fmi3_*.c wrap the same calls (calls.h). */
#ifndef SLIDE_INSTANCE_H
#define SLIDE_INSTANCE_H

#include "stream.h"

/* The numbers of fmi2Status and fmi3Status. */
typedef enum {
    SLIDE_OK = 0,
    SLIDE_WARNING = 1,
    SLIDE_DISCARD = 2,
    SLIDE_ERROR = 3
} SlideStatus;

/* States of the co-simulation state machine of both standards, as bits. */
typedef enum {
    SLIDE_INSTANTIATED = 1,
    SLIDE_INITIALIZATION = 2,
    SLIDE_STEPPING = 4,
    SLIDE_TERMINATED = 8,
    SLIDE_ANY_MODE = 15,
    SLIDE_BETWEEN = 16, /* within a step, intermediate update mode; for few functions */
    SLIDE_SETTABLE = SLIDE_INSTANTIATED | SLIDE_INITIALIZATION | SLIDE_STEPPING | SLIDE_BETWEEN
} SlideMode;

typedef struct SlideLogger SlideLogger;

/* The master's logger. */
struct SlideLogger {
    /* Call it; instance: its name. NULL: nobody listens. */
    void (*write)(const SlideLogger *logger, const char *instance, SlideStatus status,
                  const char *category, const char *text);
    void (*callback)(void); /* the master's function, of a type that write knows */
    void *environment;      /* the master's, for callback */
};

typedef struct SlideWatcher SlideWatcher;

/* The master's callback for intermediate update: a step of several samples is then done one by one,
 * and shown to the master after each. */
struct SlideWatcher {
    /* Call it; the time of the sample, and whether it is the last one of the step. True when the
     * master asks to end the step at a time, which it gives. NULL: nobody watches. */
    bool (*show)(const SlideWatcher *watcher, double time, bool last, double *until);
    void (*callback)(void); /* the master's function, of a type that show knows */
    void *environment;      /* the master's, for callback */
    bool may_end;           /* may the master end a step early? */
    bool was_set;           /* variables were set */
    void *undo;             /* room for the state before the step */
    double *from, *to;      /* [n_inputs], what ramps move between */
};

/* The instance begins the aligned part of its one memory block; name, model arrays and state
 * follow in it. */
typedef struct {
    void *block; /* what calloc gave */
    SlideModel model;
    SlideState state;
    SlideLogger logger;
    SlideWatcher watcher;
    double stop; /* s; no step may end later; of this run, so that no saved state brings another */
    char *name;
    bool debug;
    bool has_more; /* variables that only FMI 3.0 has: the time, and arrays */
} SlideInstance;

/* Log a message (errors always, others when debug logging is on) and give the status back. */
__attribute__((format(printf, 3, 4))) SlideStatus slide_report(const SlideInstance *instance,
                                                               SlideStatus status,
                                                               const char *format, ...);

/* The instance behind a component, when the function may be called now; otherwise NULL, with a
 * logged message. modes: sum of SlideMode bits. */
SlideInstance *slide_enter(void *component, unsigned modes, const char *function);

/* Log that an argument pointer is missing. */
SlideStatus slide_null(const SlideInstance *instance, const char *function);

#endif
