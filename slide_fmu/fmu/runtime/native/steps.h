/* The communication steps of an FMU in memory, of any tool: all of them in one call from Python. */
#ifndef SLIDE_STEPS_H
#define SLIDE_STEPS_H

#include "native.h"

/* A function of FMI; its own type is restored before it is called. */
typedef void (*SlideFmiFunction)(void);

/* Variables of one type, which are set before each step, or read behind it. */
typedef struct SlideVariables {
    SlideFmiFunction call; /* fmi2SetReal, fmi3GetFloat64 and so on */
    const uint32_t *references;
    size_t count;
    unsigned char *values; /* [steps][count] in the type that the function has */
    size_t row;            /* bytes of a step's values */
} SlideVariables;

/* What is called, and where it ended. */
typedef struct SlideSteps {
    uint32_t fmi; /* major version of the standard: 2 or 3 */
    void *component;
    SlideFmiFunction do_step;
    const double *begins, *lengths; /* of the steps in s */
    size_t count;
    const SlideVariables *set, *get;
    size_t n_set, n_get;
    size_t done;       /* out: number of whole steps */
    size_t place;      /* out: the call that failed: of set, then do_step, then those of get */
    double reached;    /* out: FMI 3.0's lastSuccessfulTime of the last step */
    uint32_t terminate; /* out: FMI 3.0: whether the end of the simulation was asked for */
    uint32_t early;     /* out: FMI 3.0: whether the last step ended early */
} SlideSteps;

/* Set, step and get, until a call has a status above a warning, or a step asks for the end or ends
 * early. Return that status; 0 if all was well. */
SLIDE_Export int slide_native_steps(SlideSteps *steps);

#endif
