/* Values of variables. */
#include "calls.h"
#include "variables.h"

#include <math.h>

/* Part of the inputs behind a result that were set in this run, or are known. */
static double part_filled(const SlideState *state, double n_samples) {
    double filled = state->head->filled / n_samples;
    return filled < 1 && state->head->prehistory == SLIDE_FIRST_HELD ? filled : 1;
}

/* Of an output, oldest first; block: all outputs, of slide_stream_block. Are they finite? */
static bool write_outputs(const SlideModel *model, const float *block, size_t output,
                          double values[]) {
    bool finite = true;
    const SlideScaling *scaling = &model->output_scaling[output];
    for (size_t sample = 0; sample < model->n_block; ++sample) {
        values[sample] = block[sample * model->n_outputs + output] * scaling->scale +
                         scaling->offset;
        finite = finite && isfinite(values[sample]);
    }
    return finite;
}

/* Of an input before the start, oldest first. */
static void write_initial_window(const SlideModel *model, const SlideState *state, size_t input,
                                 double values[]) {
    for (size_t sample = 0; sample < model->n_sampled; ++sample) {
        values[sample] = state->window[sample * model->n_inputs + input];
    }
}

/* All values of a variable; block: NULL, or what slide_stream_block gave. Error estimates are found
 * when they are read. False when values of an array are not finite. */
static bool read_variable(SlideInstance *instance, SlideVariable variable, const float **block,
                          double values[]) {
    const SlideModel *model = &instance->model;
    SlideState *state = &instance->state;
    const size_t i = variable.index;
    switch (variable.kind) { /* no default: the compiler tells of a kind that is missing */
    case SLIDE_INPUT:
        values[0] = state->inputs[i];
        break;
    case SLIDE_OUTPUT:
        values[0] = state->outputs[i];
        break;
    case SLIDE_ERROR_ESTIMATE:
        slide_stream_estimate(model, state);
        values[0] = state->estimate.errors[i] * model->output_scaling[i].scale;
        break;
    case SLIDE_WINDOW_FILLED:
        values[0] = part_filled(state, model->predictor.n_needed);
        break;
    case SLIDE_ESTIMATE_FILLED:
        values[0] = part_filled(state, (double)model->estimator.reach);
        break;
    case SLIDE_TRUNCATION_ERROR:
        values[0] = state->predictor.cells.errors[i] * model->output_scaling[i].scale;
        break;
    case SLIDE_IN_RANGE:
        values[0] = slide_stream_in_range(model, state);
        break;
    case SLIDE_PREHISTORY_KNOWN:
        values[0] = state->head->prehistory;
        break;
    case SLIDE_INITIAL_INPUT:
        values[0] = state->initial[i];
        break;
    case SLIDE_TIME:
        values[0] = slide_clock_time(&state->head->clock);
        break;
    case SLIDE_OUTPUT_WINDOW:
        *block = *block == NULL ? slide_stream_block(model, state) : *block;
        return write_outputs(model, *block, i, values);
    case SLIDE_INITIAL_WINDOW:
        write_initial_window(model, state, i, values);
        break;
    case SLIDE_KINDS:
        break;
    }
    return true;
}

/* Is a variable there, and of the type of the function? */
static bool is_known(const SlideInstance *instance, uint32_t reference, SlideVariable variable,
                     SlideType type, const char *function) {
    static const char *const types[] = {"Real (Float64)", "Boolean"};
    if (variable.kind == SLIDE_KINDS) {
        slide_report(instance, SLIDE_ERROR,
                     "%s: no variable has the value reference %u; expected one of "
                     "modelDescription.xml; nothing was changed",
                     function, reference);
    } else if (variable.type != type) {
        slide_report(instance, SLIDE_ERROR,
                     "%s: the variable with value reference %u is of type %s; expected %s; nothing "
                     "was changed",
                     function, reference, types[variable.type], types[type]);
    }
    return variable.kind != SLIDE_KINDS && variable.type == type;
}

/* Are all references known, and are there as many values as the variables have? */
static bool arguments_agree(const SlideInstance *instance, const SlideValues *of,
                            const char *function) {
    const SlideType type = of->form == SLIDE_DOUBLES ? SLIDE_REAL : SLIDE_BOOLEAN;
    uint64_t n_expected = 0;
    for (size_t i = 0; i < of->n_references; ++i) {
        SlideVariable variable = slide_variable(instance, of->references[i]);
        if (!is_known(instance, of->references[i], variable, type, function)) {
            return false;
        }
        n_expected += variable.size;
    }
    if (of->n_values != n_expected) {
        slide_report(instance, SLIDE_ERROR,
                     "%s: %llu values for %llu variables; expected %llu, one for each, but of an "
                     "array all; nothing was changed",
                     function, (unsigned long long)of->n_values,
                     (unsigned long long)of->n_references, (unsigned long long)n_expected);
    }
    return of->n_values == n_expected;
}

/* The instance, where a function may be called and its arguments agree. */
static SlideInstance *enter(void *component, unsigned modes, const SlideValues *of,
                            const void *values, const char *function) {
    SlideInstance *instance = slide_enter(component, modes, function);
    if (instance == NULL) {
        return NULL;
    }
    if (of->n_references > 0 && (of->references == NULL || values == NULL)) {
        slide_null(instance, function);
        return NULL;
    }
    return arguments_agree(instance, of, function) ? instance : NULL;
}

/* A Boolean, in the form that the standard gives it. */
static void store_truth(const SlideValues *of, void *values, size_t at, bool truth) {
    if (of->form == SLIDE_INTS) {
        ((int *)values)[at] = truth;
    } else {
        ((bool *)values)[at] = truth;
    }
}

SlideStatus slide_get(void *component, const SlideValues *of, void *values, const char *function) {
    const unsigned modes =
        SLIDE_INITIALIZATION | SLIDE_STEPPING | SLIDE_BETWEEN | SLIDE_TERMINATED;
    SlideInstance *instance = enter(component, modes, of, values, function);
    if (instance == NULL) {
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
    const float *block = NULL; /* evaluated once for all outputs */
    for (size_t i = 0, at = 0; i < of->n_references; ++i) {
        const SlideVariable variable = slide_variable(instance, of->references[i]);
        double truth = 0;
        double *place = variable.type == SLIDE_REAL ? (double *)values + at : &truth;
        if (!read_variable(instance, variable, &block, place)) {
            return slide_report(instance, SLIDE_DISCARD,
                                "%s: the array with value reference %u holds numbers that are not "
                                "finite; set inputs within their ranges",
                                function, of->references[i]);
        }
        if (variable.type == SLIDE_BOOLEAN) {
            store_truth(of, values, at, truth != 0);
        }
        at += variable.size;
    }
    return SLIDE_OK;
}

static SlideStatus check_settable(const SlideInstance *instance, uint32_t reference,
                                  const char *function) {
    SlideVariable variable = slide_variable(instance, reference);
    if (variable.kind != SLIDE_INPUT && !variable.is_parameter) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: value reference %u is no input; only inputs, 0 to %u, and "
                            "parameters can be set; nothing was changed",
                            function, reference, (unsigned)instance->model.n_inputs - 1);
    }
    if (variable.is_parameter &&
        (instance->state.head->mode & (SLIDE_STEPPING | SLIDE_BETWEEN)) != 0) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: value reference %u is a parameter; set it before the end of "
                            "initialization mode; nothing was changed",
                            function, reference);
    }
    return SLIDE_OK;
}

/* values: all of the variable. */
static SlideStatus check_values(const SlideInstance *instance, uint32_t reference,
                                const double values[], const char *function) {
    const SlideVariable variable = slide_variable(instance, reference);
    if (variable.kind == SLIDE_PREHISTORY_KNOWN) {
        const uint32_t most = instance->has_more ? SLIDE_INITIAL_WINDOW_KNOWN : SLIDE_INITIAL_HELD;
        bool known = values[0] >= 0 && values[0] <= most && values[0] == nearbyint(values[0]);
        return known ? SLIDE_OK
                     : slide_report(instance, SLIDE_DISCARD,
                                    "%s: prehistory_known (value reference %u) = %g; expected 0 "
                                    "%s; the former values are kept",
                                    function, reference, values[0],
                                    instance->has_more ? "to 2" : "or 1");
    }
    for (size_t i = 0; i < variable.size; ++i) {
        if (!slide_input_usable(&instance->model, variable.index, values[i])) {
            return slide_report(instance, SLIDE_DISCARD,
                                "%s: input with value reference %u = %g; expected a finite number "
                                "near the input's range; the former values are kept",
                                function, reference, values[i]);
        }
    }
    return SLIDE_OK;
}

/* Check all values before the first is taken over. */
static SlideStatus check_inputs(const SlideInstance *instance, const SlideValues *of,
                                const double values[], const char *function) {
    SlideStatus status = SLIDE_OK;
    for (size_t i = 0; status == SLIDE_OK && i < of->n_references; ++i) {
        status = check_settable(instance, of->references[i], function);
    }
    for (size_t i = 0; status == SLIDE_OK && i < of->n_references; ++i) {
        status = check_values(instance, of->references[i], values, function);
        values += slide_variable(instance, of->references[i]).size;
    }
    return status;
}

static void take_over(SlideInstance *instance, SlideVariable variable, const double values[]) {
    SlideState *state = &instance->state;
    const size_t n_inputs = instance->model.n_inputs;
    switch (variable.kind) {
    case SLIDE_PREHISTORY_KNOWN:
        state->head->prehistory = (uint32_t)values[0];
        break;
    case SLIDE_INITIAL_INPUT:
        state->initial[variable.index] = values[0];
        break;
    case SLIDE_INITIAL_WINDOW:
        for (size_t sample = 0; sample < instance->model.n_sampled; ++sample) {
            state->window[sample * n_inputs + variable.index] = values[sample];
        }
        break;
    default:
        state->inputs[variable.index] = values[0];
    }
}

SlideStatus slide_set(void *component, const SlideValues *of, const void *values,
                      const char *function) {
    SlideInstance *instance = enter(component, SLIDE_SETTABLE, of, values, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    const double *numbers = values; /* what can be set is Real */
    SlideStatus status = check_inputs(instance, of, numbers, function);
    if (status != SLIDE_OK) {
        return status;
    }
    for (size_t i = 0; i < of->n_references; ++i) {
        SlideVariable variable = slide_variable(instance, of->references[i]);
        take_over(instance, variable, numbers);
        numbers += variable.size;
    }
    if (slide_stream_fresh(&instance->state)) {
        instance->state.head->current = 0;
    }
    instance->watcher.was_set = true;
    return SLIDE_OK;
}

SlideStatus slide_none_of_type(void *component, size_t count, const char *function) {
    SlideInstance *instance = slide_enter(component, SLIDE_ANY_MODE, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    return count == 0 ? SLIDE_OK
                      : slide_report(instance, SLIDE_ERROR,
                                     "%s: no variable of this FMU is of this type; expected Real "
                                     "(Float64) or Boolean",
                                     function);
}
