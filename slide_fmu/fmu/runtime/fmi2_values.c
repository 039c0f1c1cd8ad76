/* FMI 2.0: values of variables. References: inputs, outputs, error estimates, window_filled,
 * error_estimate_filled, truncation errors, inputs_in_range; parameters: prehistory_known, initial
 * inputs. Estimates and their part only with an estimator, truncation errors only of cells. See
 * slide_fmu/fmu/model_description.py. */
#include "instance.h"

/* Outputs come with a variable that tells how much of their inputs is filled, and so do error
 * estimates. */
static uint64_t count_filled_outputs(const SlideModel *model) {
    return ((uint64_t)model->n_outputs + 1) * (model->estimator.positions > 0 ? 2 : 1);
}

static bool is_estimate(const SlideModel *model, fmi2ValueReference reference) {
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

static bool is_parameter(const SlideModel *model, fmi2ValueReference reference) {
    return reference >= prehistory_reference(model);
}

static bool known_references(const SlideInstance *instance, const fmi2ValueReference vr[],
                             size_t nvr, const char *function) {
    uint64_t count = count_references(&instance->model);
    for (size_t i = 0; i < nvr; ++i) {
        if (vr[i] >= count) {
            slide_report(instance, fmi2Error,
                         "%s: value reference %u; expected less than %llu; nothing was changed",
                         function, vr[i], (unsigned long long)count);
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
    if (is_parameter(model, (fmi2ValueReference)reference)) {
        return parameter(model, state, reference);
    }
    if (reference < model->n_inputs) {
        return state->inputs[reference];
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
    if (is_estimate(model, (fmi2ValueReference)reference)) {
        return state->estimate.errors[other] * model->output_scaling[other].scale;
    }
    bool of_outputs = other == (model->estimator.positions > 0 ? model->n_outputs : 0);
    return part_filled(state, of_outputs ? model->predictor.n_needed
                                         : (double)model->estimator.reach);
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                       fmi2Real value[]) {
    unsigned modes = SLIDE_INITIALIZATION | SLIDE_STEPPING | SLIDE_TERMINATED;
    SlideInstance *instance = slide_enter(c, modes, __func__);
    if (instance == NULL) {
        return fmi2Error;
    }
    if (nvr > 0 && (vr == NULL || value == NULL)) {
        return slide_null(instance, __func__);
    }
    if (!known_references(instance, vr, nvr, __func__)) {
        return fmi2Error;
    }
    const SlideState *state = &instance->state;
    if (slide_stream_fresh(state) && !state->head->current &&
        !slide_stream_hold(&instance->model, &instance->state)) {
        return slide_report(instance, fmi2Discard,
                            "fmi2GetReal: the outputs for the present inputs are not finite; set "
                            "inputs within their ranges");
    }
    for (size_t i = 0; i < nvr; ++i) {
        if (is_estimate(&instance->model, vr[i])) { /* found when they are read */
            slide_stream_estimate(&instance->model, &instance->state);
        }
        value[i] = vr[i] == in_range_reference(&instance->model)
                       ? slide_stream_in_range(&instance->model, &instance->state)
                       : value_of(instance, vr[i]);
    }
    return fmi2OK;
}

static fmi2Status check_settable(const SlideInstance *instance, fmi2ValueReference reference) {
    const SlideModel *model = &instance->model;
    bool parameter = is_parameter(model, reference);
    if (reference >= model->n_inputs && !parameter) {
        return slide_report(instance, fmi2Error,
                            "fmi2SetReal: value reference %u is an output; only inputs, 0 to %u, "
                            "and parameters, from %u on, can be set; nothing was changed",
                            reference, (unsigned)model->n_inputs - 1,
                            (unsigned)prehistory_reference(model));
    }
    if (parameter && instance->state.head->mode == SLIDE_STEPPING) {
        return slide_report(instance, fmi2Error,
                            "fmi2SetReal: value reference %u is a parameter; set it before "
                            "fmi2ExitInitializationMode; nothing was changed",
                            reference);
    }
    return fmi2OK;
}

static fmi2Status check_value(const SlideInstance *instance, fmi2ValueReference reference,
                              double value) {
    const SlideModel *model = &instance->model;
    const fmi2ValueReference known = (fmi2ValueReference)prehistory_reference(model);
    if (reference == known) {
        return value == 0 || value == 1
                   ? fmi2OK
                   : slide_report(instance, fmi2Discard,
                                  "fmi2SetReal: prehistory_known (value reference %u) = %g; "
                                  "expected 0 or 1; the former values are kept",
                                  reference, value);
    }
    size_t input = is_parameter(model, reference) ? reference - known - 1 : reference;
    return slide_input_usable(model, input, value)
               ? fmi2OK
               : slide_report(instance, fmi2Discard,
                              "fmi2SetReal: input with value reference %u = %g; expected a finite "
                              "number near the input's range; the former values are kept",
                              reference, value);
}

/* Check all values before the first is taken over. */
static fmi2Status check_inputs(const SlideInstance *instance, const fmi2ValueReference vr[],
                               size_t nvr, const fmi2Real value[]) {
    fmi2Status status = fmi2OK;
    for (size_t i = 0; status == fmi2OK && i < nvr; ++i) {
        status = check_settable(instance, vr[i]);
    }
    for (size_t i = 0; status == fmi2OK && i < nvr; ++i) {
        status = check_value(instance, vr[i], value[i]);
    }
    return status;
}

static void take_over(SlideInstance *instance, fmi2ValueReference reference, double value) {
    const fmi2ValueReference known = (fmi2ValueReference)prehistory_reference(&instance->model);
    SlideState *state = &instance->state;
    if (reference == known) {
        state->head->prehistory_known = value != 0;
    } else if (reference > known) {
        state->initial[reference - known - 1] = value;
    } else {
        state->inputs[reference] = value;
    }
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                       const fmi2Real value[]) {
    unsigned modes = SLIDE_INSTANTIATED | SLIDE_INITIALIZATION | SLIDE_STEPPING;
    SlideInstance *instance = slide_enter(c, modes, __func__);
    if (instance == NULL) {
        return fmi2Error;
    }
    if (nvr > 0 && (vr == NULL || value == NULL)) {
        return slide_null(instance, __func__);
    }
    if (!known_references(instance, vr, nvr, __func__)) {
        return fmi2Error;
    }
    fmi2Status status = check_inputs(instance, vr, nvr, value);
    if (status != fmi2OK) {
        return status;
    }
    for (size_t i = 0; i < nvr; ++i) {
        take_over(instance, vr[i], value[i]);
    }
    if (slide_stream_fresh(&instance->state)) {
        instance->state.head->current = 0;
    }
    return fmi2OK;
}

/* There are no variables of other types; asking for none of them is fine. */
static fmi2Status only_real(fmi2Component c, size_t nvr, const char *function) {
    SlideInstance *instance = slide_enter(c, SLIDE_ANY_MODE, function);
    if (instance == NULL) {
        return fmi2Error;
    }
    return nvr == 0 ? fmi2OK
                    : slide_report(instance, fmi2Error,
                                   "%s: all variables of this FMU are of type Real", function);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          fmi2Integer value[]) {
    (void)vr;
    (void)value;
    return only_real(c, nvr, __func__);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          fmi2Boolean value[]) {
    (void)vr;
    (void)value;
    return only_real(c, nvr, __func__);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                         fmi2String value[]) {
    (void)vr;
    (void)value;
    return only_real(c, nvr, __func__);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          const fmi2Integer value[]) {
    (void)vr;
    (void)value;
    return only_real(c, nvr, __func__);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          const fmi2Boolean value[]) {
    (void)vr;
    (void)value;
    return only_real(c, nvr, __func__);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                         const fmi2String value[]) {
    (void)vr;
    (void)value;
    return only_real(c, nvr, __func__);
}
