#include "derivatives_by_reference.h"

#include "derivative.h"
#include "variables.h"

#include <math.h>
#include <string.h>

static bool has_derivatives(SlideVariable variable) {
    switch (variable.kind) {
    case SLIDE_OUTPUT:
    case SLIDE_ERROR_ESTIMATE:
    case SLIDE_WINDOW_FILLED:
    case SLIDE_ESTIMATE_FILLED:
    case SLIDE_TRUNCATION_ERROR:
    case SLIDE_IN_RANGE:
        return true;
    default:
        return false;
    }
}

static SlideStatus check_references(const SlideInstance *instance, const SlideDerivativePair *of,
                                   const char *function) {
    for (size_t i = 0; i < of->n_knowns; ++i) {
        if (slide_variable(instance, of->knowns[i]).kind != SLIDE_INPUT) {
            return slide_report(instance, SLIDE_ERROR,
                                "%s: known with value reference %u; expected inputs, 0 to %u",
                                function, of->knowns[i], (unsigned)instance->model.n_inputs - 1);
        }
    }
    for (size_t i = 0; i < of->n_unknowns; ++i) {
        if (!has_derivatives(slide_variable(instance, of->unknowns[i]))) {
            return slide_report(instance, SLIDE_ERROR,
                                "%s: unknown with value reference %u; expected a scalar output",
                                function, of->unknowns[i]);
        }
    }
    return SLIDE_OK;
}

/* What only tells about the window is constant between the inputs at which it jumps. */
static double slope_of(const SlideInstance *instance, uint32_t reference, const double *slopes) {
    const SlideVariable variable = slide_variable(instance, reference);
    const size_t n_outputs = instance->model.n_outputs;
    switch (variable.kind) {
    case SLIDE_OUTPUT:
        return slopes[SLIDE_OF_OUTPUTS * n_outputs + variable.index];
    case SLIDE_TRUNCATION_ERROR:
        return slopes[SLIDE_OF_TRUNCATION_ERRORS * n_outputs + variable.index];
    case SLIDE_ERROR_ESTIMATE:
        return slopes[SLIDE_OF_ESTIMATES * n_outputs + variable.index];
    default:
        return 0;
    }
}

/* The derivatives in the direction that the scratch holds; estimates cost most, and are formed
 * where they are wanted only. */
static const double *differentiate(SlideInstance *instance, const SlideDerivativePair *of) {
    const SlideModel *model = &instance->model;
    double *slopes = model->derivative.slopes;
    bool estimates = false;
    for (size_t i = 0; i < of->n_unknowns; ++i) {
        estimates |= slide_variable(instance, of->unknowns[i]).kind == SLIDE_ERROR_ESTIMATE;
    }
    if (estimates) {
        slide_stream_estimate(model, &instance->state);
    }
    slide_directional_derivative(model, &instance->state, model->derivative.direction, estimates,
                                 slopes);
    return slopes;
}

static bool all_finite(const double *values, size_t count) {
    bool finite = true;
    for (size_t i = 0; i < count; ++i) {
        finite = finite && isfinite(values[i]);
    }
    return finite;
}

/* May the derivatives be formed now? Before the first step they are those of the start inputs. */
static SlideStatus prepare(SlideInstance *instance, const SlideDerivativePair *of,
                          const double *seed, size_t n_seed, const char *function) {
    SlideState *state = &instance->state;
    SlideStatus status = check_references(instance, of, function);
    if (status != SLIDE_OK) {
        return status;
    }
    if (!all_finite(seed, n_seed)) {
        return slide_report(instance, SLIDE_ERROR, "%s: a seed is not finite; expected numbers",
                            function);
    }
    if (slide_stream_fresh(state) && !state->head->current &&
        !slide_stream_hold(&instance->model, state)) {
        return slide_report(instance, SLIDE_DISCARD,
                            "%s: the outputs for the present inputs are not finite; set inputs "
                            "within their ranges",
                            function);
    }
    return SLIDE_OK;
}

static SlideInstance *enter(void *component, const SlideDerivativePair *of, bool seeds_missing,
                            bool results_missing, const char *function) {
    SlideInstance *instance =
        slide_enter(component, SLIDE_INITIALIZATION | SLIDE_STEPPING | SLIDE_TERMINATED, function);
    bool missing = (of->n_unknowns > 0 && of->unknowns == NULL) ||
                   (of->n_knowns > 0 && of->knowns == NULL) || seeds_missing || results_missing;
    if (instance != NULL && missing) {
        slide_null(instance, function);
        return NULL;
    }
    return instance;
}

static SlideStatus check_finite(const SlideInstance *instance, const double *sensitivity,
                                size_t count, const char *function) {
    return all_finite(sensitivity, count)
               ? SLIDE_OK
               : slide_report(instance, SLIDE_DISCARD,
                              "%s: a derivative is not finite; expected smaller seeds and inputs "
                              "within their ranges",
                              function);
}

SlideStatus slide_get_directional_derivative(void *component, const SlideDerivativePair *of,
                                            const double *seed, double *sensitivity,
                                            const char *function) {
    SlideInstance *instance = enter(component, of, of->n_knowns > 0 && seed == NULL,
                                    of->n_unknowns > 0 && sensitivity == NULL, function);
    SlideStatus status =
        instance == NULL ? SLIDE_ERROR : prepare(instance, of, seed, of->n_knowns, function);
    if (status != SLIDE_OK) {
        return status;
    }
    double *direction = instance->model.derivative.direction;
    memset(direction, 0, instance->model.n_inputs * sizeof *direction);
    for (size_t i = 0; i < of->n_knowns; ++i) {
        direction[slide_variable(instance, of->knowns[i]).index] += seed[i];
    }
    const double *slopes = differentiate(instance, of);
    for (size_t i = 0; i < of->n_unknowns; ++i) {
        sensitivity[i] = slope_of(instance, of->unknowns[i], slopes);
    }
    return check_finite(instance, sensitivity, of->n_unknowns, function);
}

/* There are few inputs: from the directional derivative of each. */
SlideStatus slide_get_adjoint_derivative(void *component, const SlideDerivativePair *of,
                                        const double *seed, double *sensitivity,
                                        const char *function) {
    SlideInstance *instance = enter(component, of, of->n_unknowns > 0 && seed == NULL,
                                    of->n_knowns > 0 && sensitivity == NULL, function);
    SlideStatus status =
        instance == NULL ? SLIDE_ERROR : prepare(instance, of, seed, of->n_unknowns, function);
    if (status != SLIDE_OK) {
        return status;
    }
    double *direction = instance->model.derivative.direction;
    memset(direction, 0, instance->model.n_inputs * sizeof *direction);
    for (size_t i = 0; i < of->n_knowns; ++i) {
        const size_t input = slide_variable(instance, of->knowns[i]).index;
        direction[input] = 1;
        const double *slopes = differentiate(instance, of);
        direction[input] = 0;
        sensitivity[i] = 0;
        for (size_t j = 0; j < of->n_unknowns; ++j) {
            sensitivity[i] += seed[j] * slope_of(instance, of->unknowns[j], slopes);
        }
    }
    return check_finite(instance, sensitivity, of->n_knowns, function);
}
