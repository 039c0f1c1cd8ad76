#include "variables.h"

static uint32_t count_of(const SlideInstance *instance, SlideVariableKind kind) {
    const SlideModel *model = &instance->model;
    const bool estimates = model->estimator.positions > 0;
    switch (kind) {
    case SLIDE_INPUT:
    case SLIDE_INITIAL_INPUT:
        return model->n_inputs;
    case SLIDE_OUTPUT:
        return model->n_outputs;
    case SLIDE_ESTIMATE:
        return estimates ? model->n_outputs : 0;
    case SLIDE_ESTIMATE_FILLED:
        return estimates;
    case SLIDE_TRUNCATION_ERROR:
        return model->predictor.kind == SLIDE_STATE_SPACE ? model->n_outputs : 0;
    case SLIDE_TIME:
        return instance->has_more;
    case SLIDE_OUTPUT_WINDOW:
        return instance->has_more && model->n_block > 1 ? model->n_outputs : 0;
    case SLIDE_INITIAL_WINDOW:
        return instance->has_more ? model->n_inputs : 0;
    default:
        return 1;
    }
}

SlideVariable slide_variable(const SlideInstance *instance, uint32_t reference) {
    uint32_t index = reference;
    for (SlideVariableKind kind = SLIDE_INPUT; kind < SLIDE_KINDS; ++kind) {
        uint32_t count = count_of(instance, kind);
        if (index < count) {
            return (SlideVariable){kind, index};
        }
        index -= count;
    }
    return (SlideVariable){SLIDE_KINDS, 0};
}

static uint64_t count_before(const SlideInstance *instance, SlideVariableKind end) {
    uint64_t count = 0;
    for (SlideVariableKind kind = SLIDE_INPUT; kind < end; ++kind) {
        count += count_of(instance, kind);
    }
    return count;
}

uint64_t slide_count_variables(const SlideInstance *instance) {
    return count_before(instance, SLIDE_KINDS);
}

uint32_t slide_first_parameter(const SlideInstance *instance) {
    return (uint32_t)count_before(instance, SLIDE_PREHISTORY_KNOWN);
}
