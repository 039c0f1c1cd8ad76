/* One FMU instance: model, state, logger. Instances share nothing. An instance knows no standard:
 * the functions of FMI 2.0 and FMI 3.0 wrap the same calls (calls.h). */
#ifndef SLIDE_INSTANCE_H
#define SLIDE_INSTANCE_H

#include "derivative.h"
#include "parameter_slopes.h"

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
    SLIDE_SETTABLE = SLIDE_INSTANTIATED | SLIDE_INITIALIZATION | SLIDE_STEPPING | SLIDE_BETWEEN,
    SLIDE_DIFFERENTIABLE = SLIDE_INITIALIZATION | SLIDE_STEPPING | SLIDE_TERMINATED,
    SLIDE_READABLE = SLIDE_DIFFERENTIABLE | SLIDE_BETWEEN
} SlideMode;

typedef struct SlideLogger SlideLogger;

/* The importer's logger. */
struct SlideLogger {
    /* Call it; instance: its name. */
    void (*write)(const SlideLogger *logger, const char *instance, SlideStatus status,
                  const char *category, const char *text);
    void (*callback)(void); /* the importer's, of a type that write knows; NULL: nobody listens */
    void *environment;      /* the importer's, for callback */
};

typedef struct SlideWatcher SlideWatcher;

/* The importer's callback for intermediate update: a step of several samples is then done one by
 * one, and shown to the importer after each. */
struct SlideWatcher {
    /* Call it; the time of the sample, and whether it is the last one of the step. True when the
     * importer asks to end the step at a time, which it gives. NULL: nobody watches. */
    bool (*show)(const SlideWatcher *watcher, double time, bool last, double *until);
    void (*callback)(void); /* the importer's function, of a type that show knows */
    void *environment;      /* the importer's, for callback */
    bool may_end;           /* may the importer end a step early? */
    bool *set;              /* [n_inputs], inputs that the importer set */
    void *undo;             /* room for the state before the step */
    double *from, *to;      /* [n_inputs], what inputs of a first-order hold move between */
};

/* The instance begins the aligned part of its one memory block; name, model arrays and state
 * follow in it. */
typedef struct {
    void *block; /* what slide_memory_take gave */
    SlideModel model;
    SlideState state;
    SlideDerivativeScratch derivative;
    SlideParameterScratch parameter_slopes;
    SlideLogger logger;
    SlideWatcher watcher;
    double stop; /* s; no step may end later; of this run, so that no saved state brings another */
    char *name;
    const char *function; /* that is being called, or NULL; messages begin with it */
    bool debug;
    bool has_more; /* variables that only FMI 3.0 has: the time, and arrays */
} SlideInstance;

/* Log a text (errors always, others when debug logging is on) and give the status back. */
SlideStatus slide_log(const SlideInstance *instance, SlideStatus status, const char *text);

/* The same of a message that begins with the function's name. */
SLIDE_LIKE_PRINTF(3, 4)
SlideStatus slide_report(const SlideInstance *instance, SlideStatus status, const char *format,
                         ...);

/* The instance behind a component, when the function may be called now; otherwise NULL, with a
 * logged message. modes: sum of SlideMode bits. */
SlideInstance *slide_enter(void *component, unsigned modes, const char *function);

/* Log that an argument pointer is missing. */
SlideStatus slide_null(const SlideInstance *instance);

/* Log why a call is refused, such as of a function that is exported, because importers look it up,
 * but not offered. */
SlideStatus slide_refuse(const SlideInstance *instance, const char *reason);

#endif
