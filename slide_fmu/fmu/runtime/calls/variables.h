/* Which variable a value reference means. References count through the kinds in this order; the
 * same order is in slide_fmu/fmu/description/fmi2.py. */
#ifndef SLIDE_VARIABLES_H
#define SLIDE_VARIABLES_H

#include "instance.h"

typedef enum {
    SLIDE_INPUT,
    SLIDE_OUTPUT,
    SLIDE_ESTIMATE, /* one for each output, with an estimator */
    SLIDE_WINDOW_FILLED,
    SLIDE_ESTIMATE_FILLED,  /* with an estimator */
    SLIDE_TRUNCATION_ERROR, /* one for each output, of cells */
    SLIDE_IN_RANGE,
    SLIDE_PREHISTORY_KNOWN, /* a parameter */
    SLIDE_INITIAL_INPUT,
    SLIDE_TIME,          /* in FMI 3.0 */
    SLIDE_OUTPUT_WINDOW, /* arrays, one for each output, in FMI 3.0 where the network gives several
                            samples at a time */
    SLIDE_INITIAL_WINDOW, /* array parameters, one for each input, in FMI 3.0 */
    SLIDE_KINDS
} SlideVariableKind;

typedef struct {
    SlideVariableKind kind; /* SLIDE_KINDS where there is none */
    size_t index;           /* among those of its kind */
} SlideVariable;

SlideVariable slide_variable(const SlideInstance *instance, uint32_t reference);

/* Number of all variables. */
uint64_t slide_count_variables(const SlideInstance *instance);

/* The reference of the first parameter. */
uint32_t slide_first_parameter(const SlideInstance *instance);

/* Number of values of a variable. */
static inline size_t slide_size_of(const SlideInstance *instance, SlideVariable variable) {
    switch (variable.kind) {
    case SLIDE_OUTPUT_WINDOW:
        return instance->model.n_block;
    case SLIDE_INITIAL_WINDOW:
        return instance->model.n_sampled;
    default:
        return 1;
    }
}

static inline bool slide_is_parameter(SlideVariable variable) {
    return variable.kind == SLIDE_PREHISTORY_KNOWN || variable.kind == SLIDE_INITIAL_INPUT ||
           variable.kind == SLIDE_INITIAL_WINDOW;
}

#endif
