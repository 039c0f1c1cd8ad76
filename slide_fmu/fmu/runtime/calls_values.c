/* Values of variables. References: inputs, outputs, error estimates, window_filled,
 * error_estimate_filled, truncation errors, inputs_in_range; parameters: prehistory_known, initial
 * inputs; in FMI 3.0 the time. Estimates and their part only with an estimator, truncation errors
 * only of cells. See slide_fmu/fmu/model_description.py. */
#include "calls.h"

/* Outputs come with a variable that tells how much of their inputs is filled, and so do error
 * estimates. */
static uint64_t count_filled_outputs(const SlideModel *model) {
    return ((uint64_t)model->n_outputs + 1) * (model->estimator.positions > 0 ? 2 : 1);
}

static bool is_estimate(const SlideModel *model, uint32_t reference) {
    uint64_t first = (uint64_t)model->n_inputs + model->n_outputs;
    return model->estimator.positions > 0 && reference >= first &&
           reference < first + model->n_outputs;
}

/* The last output. */
static uint64_t in_range_reference(const SlideModel *model) {
    bool measures = model->predictor.kind == SLIDE_STATE_SPACE;
    return model->n_inputs + count_filled_outputs(model) + (measures ? model->n_outputs : 0);
}

/* Those of parameters: this one, then the initial inputs. */
static uint64_t prehistory_reference(const SlideModel *model) {
    return in_range_reference(model) + 1;
}

static uint64_t count_references(const SlideModel *model) {
    return prehistory_reference(model) + 1 + model->n_inputs;
}

static bool is_parameter(const SlideModel *model, uint64_t reference) {
    return reference >= prehistory_reference(model) && reference < count_references(model);
}

static bool known_references(const SlideInstance *instance, const uint32_t references[],
                             size_t n_references, const char *function) {
    /* in FMI 3.0, the last one is the time */
    uint64_t count = count_references(&instance->model) + (instance->lists_time ? 1 : 0);
    for (size_t i = 0; i < n_references; ++i) {
        if (references[i] >= count) {
            slide_report(instance, SLIDE_ERROR,
                         "%s: value reference %u; expected less than %llu; nothing was changed",
                         function, references[i], (unsigned long long)count);
            return false;
        }
    }
    return true;
}

/* Part of the inputs behind a result that were set in this run, or are known. */
static double part_filled(const SlideState *state, double n_samples) {
    double filled = state->head->filled / n_samples;
    return filled < 1 && !state->head->prehistory_known ? filled : 1;
}

static double parameter(const SlideModel *model, const SlideState *state, size_t reference) {
    size_t first = (size_t)prehistory_reference(model);
    return reference == first ? state->head->prehistory_known
                              : state->initial[reference - first - 1];
}

static double value_of(const SlideInstance *instance, size_t reference) {
    const SlideModel *model = &instance->model;
    const SlideState *state = &instance->state;
    if (is_parameter(model, reference)) {
        return parameter(model, state, reference);
    }
    if (reference < model->n_inputs) {
        return state->inputs[reference];
    }
    if (reference == count_references(model)) {
        return slide_clock_time(&state->head->clock);
    }
    size_t output = reference - model->n_inputs;
    if (output < model->n_outputs) {
        return state->outputs[output];
    }
    if (output >= count_filled_outputs(model)) {
        size_t error = output - (size_t)count_filled_outputs(model);
        return state->predictor.cells.errors[error] * model->output_scaling[error].scale;
    }
    size_t other = output - model->n_outputs;
    if (is_estimate(model, (uint32_t)reference)) {
        return state->estimate.errors[other] * model->output_scaling[other].scale;
    }
    bool of_outputs = other == (model->estimator.positions > 0 ? model->n_outputs : 0);
    return part_filled(state, of_outputs ? model->predictor.n_needed
                                         : (double)model->estimator.reach);
}

SlideStatus slide_get(void *component, const uint32_t references[], size_t count, double values[],
                      const char *function) {
    unsigned modes = SLIDE_INITIALIZATION | SLIDE_STEPPING | SLIDE_TERMINATED;
    SlideInstance *instance = slide_enter(component, modes, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    if (count > 0 && (references == NULL || values == NULL)) {
        return slide_null(instance, function);
    }
    if (!known_references(instance, references, count, function)) {
        return SLIDE_ERROR;
    }
    const SlideState *state = &instance->state;
    if (slide_stream_fresh(state) && !state->head->current &&
        !slide_stream_hold(&instance->model, &instance->state)) {
        return slide_report(instance, SLIDE_DISCARD,
                            "%s: the outputs for the present inputs are not finite; set inputs "
                            "within their ranges",
                            function);
    }
    for (size_t i = 0; i < count; ++i) {
        if (is_estimate(&instance->model, references[i])) { /* found when they are read */
            slide_stream_estimate(&instance->model, &instance->state);
        }
        values[i] = references[i] == in_range_reference(&instance->model)
                        ? slide_stream_in_range(&instance->model, &instance->state)
                        : value_of(instance, references[i]);
    }
    return SLIDE_OK;
}

static SlideStatus check_settable(const SlideInstance *instance, uint32_t reference,
                                  const char *function) {
    const SlideModel *model = &instance->model;
    bool parameter = is_parameter(model, reference);
    if (reference >= model->n_inputs && !parameter) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: value reference %u is no input; only inputs, 0 to %u, and "
                            "parameters, from %u on, can be set; nothing was changed",
                            function, reference, (unsigned)model->n_inputs - 1,
                            (unsigned)prehistory_reference(model));
    }
    if (parameter && instance->state.head->mode == SLIDE_STEPPING) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: value reference %u is a parameter; set it before the end of "
                            "initialization mode; nothing was changed",
                            function, reference);
    }
    return SLIDE_OK;
}

static SlideStatus check_value(const SlideInstance *instance, uint32_t reference, double value,
                               const char *function) {
    const SlideModel *model = &instance->model;
    const uint32_t known = (uint32_t)prehistory_reference(model);
    if (reference == known) {
        return value == 0 || value == 1
                   ? SLIDE_OK
                   : slide_report(instance, SLIDE_DISCARD,
                                  "%s: prehistory_known (value reference %u) = %g; expected 0 or "
                                  "1; the former values are kept",
                                  function, reference, value);
    }
    size_t input = is_parameter(model, reference) ? reference - known - 1 : reference;
    return slide_input_usable(model, input, value)
               ? SLIDE_OK
               : slide_report(instance, SLIDE_DISCARD,
                              "%s: input with value reference %u = %g; expected a finite number "
                              "near the input's range; the former values are kept",
                              function, reference, value);
}

/* Check all values before the first is taken over. */
static SlideStatus check_inputs(const SlideInstance *instance, const uint32_t references[],
                                size_t count, const double values[], const char *function) {
    SlideStatus status = SLIDE_OK;
    for (size_t i = 0; status == SLIDE_OK && i < count; ++i) {
        status = check_settable(instance, references[i], function);
    }
    for (size_t i = 0; status == SLIDE_OK && i < count; ++i) {
        status = check_value(instance, references[i], values[i], function);
    }
    return status;
}

static void take_over(SlideInstance *instance, uint32_t reference, double value) {
    const uint32_t known = (uint32_t)prehistory_reference(&instance->model);
    SlideState *state = &instance->state;
    if (reference == known) {
        state->head->prehistory_known = value != 0;
    } else if (reference > known) {
        state->initial[reference - known - 1] = value;
    } else {
        state->inputs[reference] = value;
    }
}

SlideStatus slide_set(void *component, const uint32_t references[], size_t count,
                      const double values[], const char *function) {
    unsigned modes = SLIDE_INSTANTIATED | SLIDE_INITIALIZATION | SLIDE_STEPPING;
    SlideInstance *instance = slide_enter(component, modes, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    if (count > 0 && (references == NULL || values == NULL)) {
        return slide_null(instance, function);
    }
    if (!known_references(instance, references, count, function)) {
        return SLIDE_ERROR;
    }
    SlideStatus status = check_inputs(instance, references, count, values, function);
    if (status != SLIDE_OK) {
        return status;
    }
    for (size_t i = 0; i < count; ++i) {
        take_over(instance, references[i], values[i]);
    }
    if (slide_stream_fresh(&instance->state)) {
        instance->state.head->current = 0;
    }
    return SLIDE_OK;
}

SlideStatus slide_only_real(void *component, size_t count, const char *function) {
    SlideInstance *instance = slide_enter(component, SLIDE_ANY_MODE, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    return count == 0 ? SLIDE_OK
                      : slide_report(instance, SLIDE_ERROR,
                                     "%s: all variables of this FMU are of type Real (Float64)",
                                     function);
}
