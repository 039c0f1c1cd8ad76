/* Which variable a value reference means, by the table of all kinds (variable_kinds.h). */
#ifndef SLIDE_VARIABLES_H
#define SLIDE_VARIABLES_H

#include "instance.h"
#include "variable_kinds.h"

#define SLIDE_NUMBER_OF_KIND(name, number, ...) SLIDE_##name = number,
typedef enum { SLIDE_VARIABLE_KINDS(SLIDE_NUMBER_OF_KIND) SLIDE_KINDS } SlideVariableKind;

typedef enum { SLIDE_REAL, SLIDE_BOOLEAN } SlideType;

typedef struct {
    SlideVariableKind kind; /* SLIDE_KINDS where there is none */
    size_t index;           /* among those of its kind */
    size_t size;            /* number of values */
    SlideType type;
    bool is_parameter, is_output;
} SlideVariable;

SlideVariable slide_variable(const SlideInstance *instance, uint32_t reference);

/* Number of variables of a kind. */
uint32_t slide_count_of(const SlideInstance *instance, SlideVariableKind kind);

#endif
