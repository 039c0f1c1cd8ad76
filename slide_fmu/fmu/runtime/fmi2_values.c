/* FMI 2.0: values of variables. References: inputs, outputs, error estimates, window_filled,
 * error_estimate_filled, truncation errors; estimates and their part only with an estimator,
 * truncation errors only of cells. See slide_fmu/fmu/model_description.py. */
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

static uint64_t count_outputs(const SlideModel *model) {
    bool measures = model->predictor.kind == SLIDE_STATE_SPACE;
    return count_filled_outputs(model) + (measures ? model->n_outputs : 0);
}

static bool known_references(const SlideInstance *instance, const fmi2ValueReference vr[],
                             size_t nvr, const char *function) {
    uint64_t count = instance->model.n_inputs + count_outputs(&instance->model);
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

/* Part of the inputs behind a result that were set in this run. */
static double part_filled(const SlideState *state, double n_samples) {
    double filled = state->head->filled / n_samples;
    return filled < 1 ? filled : 1;
}

static double value_of(const SlideInstance *instance, size_t reference) {
    const SlideModel *model = &instance->model;
    const SlideState *state = &instance->state;
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
        value[i] = value_of(instance, vr[i]);
    }
    return fmi2OK;
}

/* Check all values before the first is taken over. */
static fmi2Status check_inputs(const SlideInstance *instance, const fmi2ValueReference vr[],
                               size_t nvr, const fmi2Real value[]) {
    for (size_t i = 0; i < nvr; ++i) {
        if (vr[i] >= instance->model.n_inputs) {
            return slide_report(instance, fmi2Error,
                                "fmi2SetReal: value reference %u is an output; only inputs, 0 to "
                                "%u, can be set; nothing was changed",
                                vr[i], (unsigned)instance->model.n_inputs - 1);
        }
    }
    for (size_t i = 0; i < nvr; ++i) {
        if (!slide_input_usable(&instance->model, vr[i], value[i])) {
            return slide_report(instance, fmi2Discard,
                                "fmi2SetReal: input with value reference %u = %g; expected a "
                                "finite number near the input's range; the former values are kept",
                                vr[i], value[i]);
        }
    }
    return fmi2OK;
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
        instance->state.inputs[vr[i]] = value[i];
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
