#include "variables.h"

typedef enum { PER_ONE = 1, PER_INPUT, PER_OUTPUT, PER_PARAMETER } Per; /* 0: no kind has this number */
typedef enum {
    WHEN_ALWAYS,
    WHEN_ESTIMATOR,
    WHEN_STATE_SPACE,
    WHEN_SEVERAL_SAMPLES,
    WHEN_FIRST_ORDER,
    WHEN_ZERO_ORDER,
    WHEN_PARAMETERS,
    WHEN_BOUND,
    WHEN_OUTPUT_RANGES,
    WHEN_KNOWN_START
} When;
typedef enum { SIZE_SCALAR, SIZE_BLOCK, SIZE_SAMPLED } Size;
typedef enum {
    CAUSALITY_INPUT,
    CAUSALITY_OUTPUT,
    CAUSALITY_PARAMETER,
    CAUSALITY_INDEPENDENT,
    CAUSALITY_LOCAL
} Causality;

typedef struct {
    Causality causality;
    SlideType type;
    Per per;
    When when;
    Size size;
    int fmi; /* the first version in which it exists */
} Kind;

#define ROW(name, number, causality, type, per, when, size, fmi)                                  \
    [number] = {CAUSALITY_##causality, SLIDE_##type, PER_##per, WHEN_##when, SIZE_##size, fmi},
static const Kind KINDS[SLIDE_KINDS] = {SLIDE_VARIABLE_KINDS(ROW)};

/* Does the surrogate have what a kind asks for? One question, since every value that is read or set
 * asks it. */
static bool has(const SlideModel *model, When when) {
    switch (when) {
    case WHEN_ALWAYS:
        return true;
    case WHEN_ESTIMATOR:
        return model->estimator.positions > 0 || model->bound.span_length > 0;
    case WHEN_STATE_SPACE:
        return slide_is_recurrent(model->predictor.family);
    case WHEN_SEVERAL_SAMPLES:
        return model->predictor.n_block > 1;
    case WHEN_FIRST_ORDER:
        return model->history.first_order;
    case WHEN_ZERO_ORDER:
        return !model->history.first_order;
    case WHEN_PARAMETERS:
        return model->parameters.count > 0;
    case WHEN_BOUND:
        return model->bound.memory_length > 0;
    case WHEN_OUTPUT_RANGES:
        return model->has_output_ranges;
    case WHEN_KNOWN_START:
        return slide_shows_state(model);
    }
    return false;
}

uint32_t slide_count_of(const SlideInstance *instance, SlideVariableKind number) {
    const SlideModel *model = &instance->model;
    const Kind *kind = &KINDS[number];
    if (!has(model, kind->when) || (kind->fmi != 2 && !instance->has_more)) {
        return 0;
    }
    return kind->per == PER_INPUT       ? model->n_inputs
           : kind->per == PER_OUTPUT    ? model->n_outputs
           : kind->per == PER_PARAMETER ? model->parameters.count
           : kind->per == PER_ONE       ? 1
                                        : 0;
}

SlideVariable slide_variable(const SlideInstance *instance, uint32_t reference) {
    const uint32_t number = reference / SLIDE_REFERENCES_PER_KIND;
    const uint32_t index = reference % SLIDE_REFERENCES_PER_KIND;
    if (number >= SLIDE_KINDS || index >= slide_count_of(instance, (SlideVariableKind)number)) {
        return (SlideVariable){.kind = SLIDE_KINDS, .size = 1};
    }
    const Kind *kind = &KINDS[number];
    const size_t size = kind->size == SIZE_SCALAR  ? 1
                        : kind->size == SIZE_BLOCK ? instance->model.predictor.n_block
                                                   : instance->model.memory_length;
    return (SlideVariable){(SlideVariableKind)number, index, size, kind->type,
                           kind->causality == CAUSALITY_PARAMETER,
                           kind->causality == CAUSALITY_OUTPUT};
}
