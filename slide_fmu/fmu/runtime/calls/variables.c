#include "variables.h"

typedef enum { PER_ONE = 1, PER_INPUT, PER_OUTPUT, PER_PARAMETER } Per; /* 0: no kind has this number */
typedef enum {
    WHEN_ALWAYS,
    WHEN_ESTIMATOR,
    WHEN_STATE_SPACE,
    WHEN_SEVERAL_SAMPLES,
    WHEN_FIRST_ORDER,
    WHEN_PARAMETERS,
    WHEN_BOUND
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

uint32_t slide_count_of(const SlideInstance *instance, SlideVariableKind number) {
    const SlideModel *model = &instance->model;
    const Kind *kind = &KINDS[number];
    const bool has[] = {[WHEN_ALWAYS] = true,
                        [WHEN_ESTIMATOR] = model->estimator.positions > 0,
                        [WHEN_STATE_SPACE] = slide_is_recurrent(model->predictor.family),
                        [WHEN_SEVERAL_SAMPLES] = model->predictor.n_block > 1,
                        [WHEN_FIRST_ORDER] = model->history.first_order,
                        [WHEN_PARAMETERS] = model->parameters.count > 0,
                        [WHEN_BOUND] = model->bound.memory_length > 0};
    const uint32_t counts[] = {[PER_ONE] = 1,
                               [PER_INPUT] = model->n_inputs,
                               [PER_OUTPUT] = model->n_outputs,
                               [PER_PARAMETER] = model->parameters.count};
    return has[kind->when] && (kind->fmi == 2 || instance->has_more) ? counts[kind->per] : 0;
}

SlideVariable slide_variable(const SlideInstance *instance, uint32_t reference) {
    const uint32_t number = reference / SLIDE_REFERENCES_PER_KIND;
    const uint32_t index = reference % SLIDE_REFERENCES_PER_KIND;
    if (number >= SLIDE_KINDS || index >= slide_count_of(instance, (SlideVariableKind)number)) {
        return (SlideVariable){.kind = SLIDE_KINDS, .size = 1};
    }
    const Kind *kind = &KINDS[number];
    const size_t sizes[] = {[SIZE_SCALAR] = 1,
                            [SIZE_BLOCK] = instance->model.predictor.n_block,
                            [SIZE_SAMPLED] = instance->model.memory_length};
    return (SlideVariable){(SlideVariableKind)number, index, sizes[kind->size], kind->type,
                           kind->causality == CAUSALITY_PARAMETER,
                           kind->causality == CAUSALITY_OUTPUT};
}
