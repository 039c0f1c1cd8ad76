/* Values of variables. */
#include "calls.h"
#include "variables.h"

#include <math.h>

/* Part of the inputs behind a result that were set in this run, or are known. */
static double part_filled(const SlideModel *model, const SlideState *state, uint64_t n_samples) {
    const double filled = slide_stream_filled(model, state) / (double)n_samples;
    const bool known = state->head->prehistory == SLIDE_INITIAL_HELD ||
                       state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN;
    return filled < 1 && !known ? filled : 1;
}

/* The same of the outputs: where those before the start are known, these have the state in which it was. */
static double outputs_filled(const SlideModel *model, const SlideState *state) {
    return state->head->prehistory == SLIDE_OUTPUTS_KNOWN
               ? 1
               : part_filled(model, state, model->predictor.memory_length);
}

/* Is the present sample, and what counts with it, known to the calibration and in its ranges? */
static bool in_domain(const SlideModel *model, SlideState *state) {
    return slide_stream_novelty(model, state) <= 1 &&
           slide_stream_in_range(model, state) && !slide_stream_doubtful(model, state);
}

/* Of an output, oldest first; block: all outputs, of slide_stream_block. Are they finite? */
static bool write_outputs(const SlideModel *model, const float *block, size_t output,
                          double values[]) {
    bool finite = true;
    const SlideScaling *scaling = &model->output_scaling[output];
    for (size_t sample = 0; sample < model->predictor.n_block; ++sample) {
        values[sample] = block[sample * model->n_outputs + output] * scaling->scale +
                         scaling->offset;
        finite = finite && isfinite(values[sample]);
    }
    return finite;
}

/* The values of a variable are so far apart in the state. */
static size_t apart(const SlideInstance *instance, SlideVariable variable) {
    return variable.kind == SLIDE_INITIAL_OUTPUT_WINDOW ? instance->model.n_outputs
                                                        : instance->model.n_inputs;
}

/* Where the state holds the values of a variable that is set, and of an output; NULL for others. */
static double *place_of(SlideInstance *instance, SlideVariable variable) {
    SlideState *state = &instance->state;
    switch (variable.kind) {
    case SLIDE_INPUT:
        return state->inputs + variable.index;
    case SLIDE_OUTPUT:
        return state->outputs + variable.index;
    case SLIDE_INITIAL_INPUT:
        return state->initial + variable.index;
    case SLIDE_INITIAL_WINDOW: /* oldest first */
        return state->window + variable.index;
    case SLIDE_INITIAL_OUTPUT_WINDOW:
        return state->window_outputs + variable.index;
    case SLIDE_PREHISTORY_KNOWN:
        return &state->head->prehistory;
    case SLIDE_INPUTS_AT_STEP_END:
    case SLIDE_INPUTS_HELD:
        return &state->head->known;
    case SLIDE_MODEL_PARAMETER:
        return state->parameters + variable.index;
    case SLIDE_CONFIDENCE:
        return &state->head->confidence;
    case SLIDE_ERROR_TOLERANCE:
        return state->tolerances + variable.index;
    default:
        return NULL;
    }
}

static bool of_bound(const SlideModel *model) { return model->bound.span_length > 0; }

/* An error estimate, in the output's unit: of known inputs, and what forecasts of them changed
 * lately. */
static double error_estimate(const SlideModel *model, SlideState *state, size_t output) {
    const double *errors = of_bound(model) ? slide_stream_bound(model, state)->estimates
                                           : slide_stream_estimate(model, state)->errors;
    const double forecast = state->ahead.forecast[output], known = errors[output];
    const double error = forecast > 0 ? sqrt(known * known + forecast) : known;
    return error * model->output_scaling[output].scale;
}

/* Do the outputs lie where the training had them? */
static bool outputs_in_range(const SlideModel *model, const SlideState *state) {
    for (uint32_t i = 0; i < model->n_outputs; ++i) {
        const double *range = model->output_ranges + 2 * (size_t)i;
        if (!(state->outputs[i] >= range[0] && state->outputs[i] <= range[1])) {
            return false;
        }
    }
    return true;
}

/* An error bound, in the output's unit. */
static double error_bound(const SlideModel *model, SlideState *state, size_t output,
                          double confidence) {
    return slide_bound_of(&model->bound, slide_stream_bound(model, state), output, confidence,
                          state->ahead.forecast[output]) *
           model->output_scaling[output].scale;
}

/* Are the past, the inputs and the outputs known, and are the errors within their tolerances by the
 * usual bound? */
static bool trusted(const SlideModel *model, SlideState *state) {
    if (part_filled(model, state, model->bound.filling_length) < 1 || !in_domain(model, state) ||
        (model->has_output_ranges && !outputs_in_range(model, state))) {
        return false;
    }
    for (uint32_t i = 0; i < model->n_outputs; ++i) {
        if (!(error_bound(model, state, i, SLIDE_USUAL_CONFIDENCE) <= state->tolerances[i])) {
            return false;
        }
    }
    return true;
}

/* All values of a variable; block: NULL, or what slide_stream_block gave. Error estimates
 * and bounds are found when they are read. False when values of an array are not finite. */
static bool read_variable(SlideInstance *instance, SlideVariable variable, const float **block,
                          double values[]) {
    const SlideModel *model = &instance->model;
    SlideState *state = &instance->state;
    const size_t i = variable.index;
    switch (variable.kind) { /* no default: the compiler tells of a kind that is missing */
    case SLIDE_INPUT:
    case SLIDE_OUTPUT:
    case SLIDE_INITIAL_INPUT:
    case SLIDE_INITIAL_WINDOW:
    case SLIDE_INITIAL_OUTPUT_WINDOW:
    case SLIDE_PREHISTORY_KNOWN:
    case SLIDE_INPUTS_AT_STEP_END:
    case SLIDE_INPUTS_HELD:
    case SLIDE_MODEL_PARAMETER:
    case SLIDE_CONFIDENCE:
    case SLIDE_ERROR_TOLERANCE:
        for (size_t sample = 0; sample < variable.size; ++sample) {
            values[sample] = place_of(instance, variable)[sample * apart(instance, variable)];
        }
        break;
    case SLIDE_ERROR_ESTIMATE:
        values[0] = error_estimate(model, state, i);
        break;
    case SLIDE_WINDOW_FILLED:
        values[0] = outputs_filled(model, state);
        break;
    case SLIDE_ESTIMATE_FILLED:
        values[0] = part_filled(model, state,
                                of_bound(model) ? model->bound.span_length
                                                : model->estimator.memory_length);
        break;
    case SLIDE_TRUNCATION_ERROR:
        values[0] = model->predictor.family->truncation_errors(&slide_now(state)->predictor)[i] *
                    model->output_scaling[i].scale;
        break;
    case SLIDE_PARAMETERS_SETTLED:
        values[0] = fmin(slide_now(state)->head->since / model->predictor.memory_length, 1);
        break;
    case SLIDE_ERROR_BOUND:
        values[0] = error_bound(model, state, i, state->head->confidence);
        break;
    case SLIDE_IN_DOMAIN:
        values[0] = in_domain(model, state);
        break;
    case SLIDE_NOVELTY:
        values[0] = slide_stream_novelty(model, state);
        break;
    case SLIDE_BOUND_FILLED:
        values[0] = part_filled(model, state, model->bound.filling_length);
        break;
    case SLIDE_IN_RANGE:
        values[0] = slide_stream_in_range(model, state);
        break;
    case SLIDE_OUTPUTS_IN_RANGE:
        values[0] = outputs_in_range(model, state);
        break;
    case SLIDE_TRUSTED:
        values[0] = trusted(model, state);
        break;
    case SLIDE_TIME:
        values[0] = slide_clock_time(&state->head->clock);
        break;
    case SLIDE_OUTPUT_WINDOW:
        *block = *block == NULL ? slide_stream_block(model, state) : *block;
        return write_outputs(model, *block, i, values);
    case SLIDE_KINDS:
        break;
    }
    return true;
}

/* Is a variable there, and of the type of the function? */
static SlideStatus check_variable(const SlideInstance *instance, unsigned reference,
                                  SlideVariable variable, SlideType type) {
    static const char *const types[] = {"Real (Float64)", "Boolean"};
    if (variable.kind == SLIDE_KINDS) {
        return slide_report(instance, SLIDE_ERROR,
                            "no variable has the value reference %u; expected one of "
                            "modelDescription.xml; nothing was changed",
                            reference);
    }
    return variable.type == type
               ? SLIDE_OK
               : slide_report(instance, SLIDE_ERROR,
                              "the variable with value reference %u is of type %s; expected %s; "
                              "nothing was changed",
                              reference, types[variable.type], types[type]);
}

/* Are all references known, and are there as many values as the variables have? */
static SlideStatus check_arguments(const SlideInstance *instance, const SlideValues *of,
                                   const void *values) {
    const SlideType type = of->form == SLIDE_DOUBLES ? SLIDE_REAL : SLIDE_BOOLEAN;
    SlideStatus status = SLIDE_OK;
    uint64_t n_expected = 0;
    if (of->n_references > 0 && (of->references == NULL || values == NULL)) {
        return slide_null(instance);
    }
    for (size_t i = 0; status == SLIDE_OK && i < of->n_references; ++i) {
        const SlideVariable variable = slide_variable(instance, of->references[i]);
        status = check_variable(instance, of->references[i], variable, type);
        n_expected += variable.size;
    }
    if (status == SLIDE_OK && of->n_values != n_expected) {
        status = slide_report(instance, SLIDE_ERROR,
                              "%llu values for %llu variables; expected %llu, one for each, but "
                              "of an array all; nothing was changed",
                              (unsigned long long)of->n_values,
                              (unsigned long long)of->n_references,
                              (unsigned long long)n_expected);
    }
    return status;
}

/* A Boolean, in the form that the standard gives it. */
static void store_truth(const SlideValues *of, void *values, size_t at, bool truth) {
    if (of->form == SLIDE_INTS) {
        ((int *)values)[at] = truth;
    } else {
        ((bool *)values)[at] = truth;
    }
}

SlideStatus slide_check_start(const SlideInstance *instance) {
    return slide_stream_lacks_outputs(&instance->model, &instance->state)
               ? slide_report(instance, SLIDE_ERROR,
                              "prehistory_known = 3, and initial_<output>_window has no number; "
                              "expected the outputs before the start, and NaN only where one is not "
                              "known; nothing was changed")
               : SLIDE_OK;
}

SlideStatus slide_settle(SlideInstance *instance) {
    SlideState *state = &instance->state;
    if (slide_stream_fresh(state) && slide_check_start(instance) != SLIDE_OK) {
        return SLIDE_ERROR;
    }
    const bool settled = !slide_stream_fresh(state) || state->head->current ||
                         slide_stream_hold(&instance->model, state);
    return settled ? SLIDE_OK
                   : slide_report(instance, SLIDE_DISCARD,
                                  "the outputs for the present inputs are not finite; set inputs "
                                  "within their ranges");
}

SlideStatus slide_get(SlideInstance *instance, const SlideValues *of, void *values) {
    SlideStatus status = check_arguments(instance, of, values);
    status = status == SLIDE_OK ? slide_settle(instance) : status;
    if (status != SLIDE_OK) {
        return status;
    }
    const float *block = NULL; /* evaluated once for all outputs */
    for (size_t i = 0, at = 0; i < of->n_references; ++i) {
        const SlideVariable variable = slide_variable(instance, of->references[i]);
        double truth = 0;
        double *place = variable.type == SLIDE_REAL ? (double *)values + at : &truth;
        if (!read_variable(instance, variable, &block, place)) {
            return slide_report(instance, SLIDE_DISCARD,
                                "the array with value reference %u holds numbers that are not "
                                "finite; set inputs within their ranges",
                                (unsigned)of->references[i]);
        }
        if (variable.type == SLIDE_BOOLEAN) {
            store_truth(of, values, at, truth != 0);
        }
        at += variable.size;
    }
    return SLIDE_OK;
}

static SlideStatus check_settable(const SlideInstance *instance, unsigned reference) {
    SlideVariable variable = slide_variable(instance, reference);
    if (variable.kind != SLIDE_INPUT && !variable.is_parameter) {
        return slide_report(instance, SLIDE_ERROR,
                            "value reference %u is no input; only inputs, 0 to %u, and parameters "
                            "can be set; nothing was changed",
                            reference, (unsigned)instance->model.n_inputs - 1);
    }
    const unsigned running = SLIDE_STEPPING | SLIDE_BETWEEN;
    const bool tunable = variable.kind == SLIDE_MODEL_PARAMETER ||
                         variable.kind == SLIDE_CONFIDENCE ||
                         variable.kind == SLIDE_ERROR_TOLERANCE;
    const unsigned closed = tunable ? SLIDE_BETWEEN : running;
    if (variable.is_parameter && (instance->state.head->mode & closed) != 0) {
        return slide_report(instance, SLIDE_ERROR,
                            "value reference %u is a parameter; set it %s; nothing was changed",
                            reference,
                            closed == running ? "before the end of initialization mode"
                                              : "between communication steps");
    }
    return SLIDE_OK;
}

/* Outputs before the start may be unknown. */
static SlideStatus check_outputs(const SlideInstance *instance, unsigned reference,
                                 SlideVariable variable, const double values[]) {
    const SlideScaling *scaling = &instance->model.output_scaling[variable.index];
    for (size_t i = 0; i < variable.size; ++i) {
        if (!isnan(values[i]) && !isfinite((float)((values[i] - scaling->offset) * scaling->factor))) {
            return slide_report(instance, SLIDE_DISCARD,
                                "initial window of an output, with value reference %u = %g; expected "
                                "finite numbers near the output's range, and NaN where it is not "
                                "known; the former values are kept",
                                reference, values[i]);
        }
    }
    return SLIDE_OK;
}

/* values: all of the variable. */
static SlideStatus check_values(const SlideInstance *instance, unsigned reference,
                                const double values[]) {
    const SlideVariable variable = slide_variable(instance, reference);
    if (variable.kind == SLIDE_PREHISTORY_KNOWN) {
        const bool shows = slide_shows_state(&instance->model);
        const uint32_t of_arrays = shows ? SLIDE_OUTPUTS_KNOWN : SLIDE_INITIAL_WINDOW_KNOWN;
        const uint32_t most = instance->has_more ? of_arrays : SLIDE_INITIAL_HELD;
        bool known = values[0] >= 0 && values[0] <= most && values[0] == nearbyint(values[0]);
        return known ? SLIDE_OK
                     : slide_report(instance, SLIDE_DISCARD,
                                    "prehistory_known (value reference %u) = %g; expected 0 %s; "
                                    "the former values are kept",
                                    reference, values[0],
                                    !instance->has_more ? "or 1"
                                    : shows             ? "to 3"
                                                        : "to 2");
    }
    if (variable.kind == SLIDE_INPUTS_AT_STEP_END || variable.kind == SLIDE_INPUTS_HELD) {
        const bool held = variable.kind == SLIDE_INPUTS_HELD;
        return values[0] == 0 || values[0] == 1
                   ? SLIDE_OK
                   : slide_report(instance, SLIDE_DISCARD,
                                  "inputs_%s (value reference %u) = %g; expected 0 or 1; "
                                  "the former values are kept",
                                  held ? "held" : "at_step_end", reference, values[0]);
    }
    if (variable.kind == SLIDE_MODEL_PARAMETER) {
        const SlideParameters *parameters = &instance->model.parameters;
        const size_t i = variable.index;
        return slide_parameter_in_range(parameters, i, values[0])
                   ? SLIDE_OK
                   : slide_report(instance, SLIDE_DISCARD,
                                  "parameter with value reference %u = %g; expected %g to %g, the "
                                  "range that the surrogate has learnt: outside, errors grow "
                                  "fast; the former values are kept",
                                  reference, values[0], parameters->low[i], parameters->high[i]);
    }
    if (variable.kind == SLIDE_CONFIDENCE) {
        return values[0] >= SLIDE_LEAST_CONFIDENCE && values[0] <= SLIDE_LARGEST_CONFIDENCE
                   ? SLIDE_OK
                   : slide_report(instance, SLIDE_DISCARD,
                                  "confidence (value reference %u) = %.9g; expected %g to %g, for "
                                  "which error bounds are calibrated; the former values are kept",
                                  reference, values[0], SLIDE_LEAST_CONFIDENCE,
                                  SLIDE_LARGEST_CONFIDENCE);
    }
    if (variable.kind == SLIDE_ERROR_TOLERANCE) {
        return values[0] >= 0 && isfinite(values[0])
                   ? SLIDE_OK
                   : slide_report(instance, SLIDE_DISCARD,
                                  "error tolerance (value reference %u) = %g; expected a finite "
                                  "number that is not negative, in the output's unit; the former "
                                  "values are kept",
                                  reference, values[0]);
    }
    if (variable.kind == SLIDE_INITIAL_OUTPUT_WINDOW) {
        return check_outputs(instance, reference, variable, values);
    }
    for (size_t i = 0; i < variable.size; ++i) { /* finite as the networks see them */
        if (!isfinite((float)slide_scaled(&instance->model, variable.index, values[i]))) {
            return slide_report(instance, SLIDE_DISCARD,
                                "input with value reference %u = %g; expected a finite number "
                                "near the input's range; the former values are kept",
                                reference, values[i]);
        }
    }
    return SLIDE_OK;
}

/* Who watches a step is asked which inputs were set on the way. An angle has two. */
static void mark_set(const SlideInstance *instance, size_t input) {
    const bool *cosine = instance->model.cosine;
    bool *set = instance->watcher.set;
    if (set != NULL) {
        set[input] = set[input + cosine[input]] = true;
        set[input - (input > 0 && cosine[input - 1])] = true;
    }
}

/* All values are checked before the first is taken over. */
SlideStatus slide_set(SlideInstance *instance, const SlideValues *of, const void *values) {
    SlideStatus status = check_arguments(instance, of, values);
    for (size_t i = 0; status == SLIDE_OK && i < of->n_references; ++i) {
        status = check_settable(instance, of->references[i]);
    }
    const double *numbers = values; /* what can be set is Real */
    for (size_t i = 0; status == SLIDE_OK && i < of->n_references; ++i) {
        status = check_values(instance, of->references[i], numbers);
        numbers += slide_variable(instance, of->references[i]).size;
    }
    if (status != SLIDE_OK) {
        return status;
    }
    numbers = values;
    for (size_t i = 0; i < of->n_references; ++i) {
        const SlideVariable variable = slide_variable(instance, of->references[i]);
        double *place = place_of(instance, variable);
        if (variable.kind == SLIDE_INPUT) {
            mark_set(instance, variable.index);
        }
        for (size_t sample = 0; sample < variable.size; ++sample, ++numbers) {
            place[sample * apart(instance, variable)] =
                variable.kind == SLIDE_MODEL_PARAMETER
                    ? slide_parameter_within(&instance->model.parameters, variable.index, *numbers)
                    : *numbers;
        }
    }
    if (slide_stream_fresh(&instance->state)) {
        instance->state.head->current = 0;
    }
    return SLIDE_OK;
}

SlideStatus slide_none_of_type(SlideInstance *instance, size_t count) {
    return count == 0 ? SLIDE_OK
                      : slide_report(instance, SLIDE_ERROR,
                                     "no variable of this FMU is of this type; expected Real "
                                     "(Float64) or Boolean");
}
