/* Derivatives of outputs by inputs and by physical parameters, by value reference. */
#include "calls.h"
#include "variables.h"

#include <math.h>
#include <string.h>

static bool all_finite(const double *values, size_t count) {
    bool finite = true;
    for (size_t i = 0; i < count; ++i) {
        finite = finite && isfinite(values[i]);
    }
    return finite;
}

/* Are the arguments there and of the right sizes (one value for each scalar variable)? seeded and
 * n_results: numbers of variables. */
static SlideStatus check_arguments(const SlideInstance *instance, const SlideSensitivities *of,
                                   size_t seeded, size_t n_results) {
    if ((of->n_unknowns > 0 && of->unknowns == NULL) || (of->n_knowns > 0 && of->knowns == NULL) ||
        (seeded > 0 && of->seed == NULL) || (n_results > 0 && of->sensitivity == NULL)) {
        return slide_null(instance);
    }
    if (of->n_seed != seeded || of->n_sensitivity != n_results) {
        return slide_report(instance, SLIDE_ERROR,
                            "%llu seeds and %llu sensitivities; expected %llu and %llu, one for "
                            "each variable",
                            (unsigned long long)of->n_seed, (unsigned long long)of->n_sensitivity,
                            (unsigned long long)seeded, (unsigned long long)n_results);
    }
    bool by_parameters = false;
    for (size_t i = 0; i < of->n_knowns; ++i) {
        const SlideVariableKind kind = slide_variable(instance, of->knowns[i]).kind;
        by_parameters |= kind == SLIDE_MODEL_PARAMETER;
        if (kind != SLIDE_INPUT && kind != SLIDE_MODEL_PARAMETER) {
            return slide_report(instance, SLIDE_ERROR,
                                "known with value reference %u; expected inputs, 0 to %u, or "
                                "tunable parameters",
                                (unsigned)of->knowns[i], (unsigned)instance->model.n_inputs - 1);
        }
    }
    for (size_t i = 0; i < of->n_unknowns; ++i) {
        const SlideVariable unknown = slide_variable(instance, of->unknowns[i]);
        if (!unknown.is_output) {
            return slide_report(instance, SLIDE_ERROR,
                                "unknown with value reference %u; expected a scalar output",
                                (unsigned)of->unknowns[i]);
        }
        const bool of_bound =
            unknown.kind == SLIDE_ERROR_ESTIMATE && instance->model.bound.span_length > 0;
        if (of_bound || unknown.kind == SLIDE_ERROR_BOUND || unknown.kind == SLIDE_NOVELTY) {
            return slide_report(instance, SLIDE_ERROR,
                                "unknown with value reference %u, an error bound, the novelty or an error "
                                "estimate of the bound; "
                                "expected outputs that have derivatives: leave it out",
                                (unsigned)of->unknowns[i]);
        }
        if (by_parameters && unknown.kind == SLIDE_TRUNCATION_ERROR) {
            return slide_report(instance, SLIDE_ERROR,
                                "unknown with value reference %u, a truncation error, by tunable "
                                "parameters; expected outputs: differentiate it by inputs only",
                                (unsigned)of->unknowns[i]);
        }
    }
    return all_finite(of->seed, seeded)
               ? SLIDE_OK
               : slide_report(instance, SLIDE_ERROR, "a seed is not finite; expected numbers");
}

/* May the derivatives be formed now? Before the first step they are those of the start inputs. */
static SlideStatus prepare(SlideInstance *instance, const SlideSensitivities *of, size_t seeded,
                           size_t n_results) {
    SlideStatus status = check_arguments(instance, of, seeded, n_results);
    const SlideModel *model = &instance->model;
    memset(instance->derivative.direction, 0, model->n_inputs * sizeof(double));
    if (model->parameters.count > 0) {
        memset(instance->parameter_slopes.direction, 0, model->parameters.count * sizeof(double));
    }
    return status == SLIDE_OK ? slide_settle(instance) : status;
}

static SlideStatus check_result(const SlideInstance *instance, const SlideSensitivities *of) {
    return all_finite(of->sensitivity, of->n_sensitivity)
               ? SLIDE_OK
               : slide_report(instance, SLIDE_DISCARD,
                              "a derivative is not finite; expected smaller seeds and inputs "
                              "within their ranges");
}

/* The derivatives in the direction that the scratch holds; estimates cost most, and are formed
 * where they are wanted only. */
static void differentiate(SlideInstance *instance, const SlideSensitivities *of) {
    bool estimates = false;
    for (size_t i = 0; i < of->n_unknowns; ++i) {
        estimates |= slide_variable(instance, of->unknowns[i]).kind == SLIDE_ERROR_ESTIMATE;
    }
    if (estimates) {
        slide_stream_estimate(&instance->model, &instance->state);
    }
    slide_directional_derivative(&instance->model, &instance->state, &instance->derivative,
                                 estimates);
    if (instance->model.parameters.count > 0) {
        slide_parameter_slopes(&instance->model, &instance->state, &instance->parameter_slopes);
    }
}

/* The place of a known in the direction that the scratch holds. */
static double *direction_of(const SlideInstance *instance, uint32_t reference) {
    const SlideVariable variable = slide_variable(instance, reference);
    return variable.kind == SLIDE_MODEL_PARAMETER
               ? instance->parameter_slopes.direction + variable.index
               : instance->derivative.direction + variable.index;
}

/* What only tells about the window is constant between the inputs at which it jumps. */
static double slope_of(const SlideInstance *instance, uint32_t reference) {
    const SlideVariable variable = slide_variable(instance, reference);
    const double *slopes = instance->derivative.slopes + variable.index;
    const size_t n_outputs = instance->model.n_outputs;
    const bool follows = instance->model.parameters.count > 0;
    switch (variable.kind) {
    case SLIDE_OUTPUT:
        return slopes[SLIDE_OF_OUTPUTS * n_outputs] +
               (follows ? instance->parameter_slopes.slopes[variable.index] : 0);
    case SLIDE_TRUNCATION_ERROR:
        return slopes[SLIDE_OF_TRUNCATION_ERRORS * n_outputs];
    case SLIDE_ERROR_ESTIMATE:
        return slopes[SLIDE_OF_ESTIMATES * n_outputs];
    default:
        return 0;
    }
}

SlideStatus slide_get_directional_derivative(SlideInstance *instance,
                                             const SlideSensitivities *of) {
    SlideStatus status = prepare(instance, of, of->n_knowns, of->n_unknowns);
    if (status != SLIDE_OK) {
        return status;
    }
    for (size_t i = 0; i < of->n_knowns; ++i) {
        *direction_of(instance, of->knowns[i]) += of->seed[i];
    }
    differentiate(instance, of);
    for (size_t i = 0; i < of->n_unknowns; ++i) {
        of->sensitivity[i] = slope_of(instance, of->unknowns[i]);
    }
    return check_result(instance, of);
}

/* There are few inputs and parameters: from the directional derivative of each. */
SlideStatus slide_get_adjoint_derivative(SlideInstance *instance, const SlideSensitivities *of) {
    SlideStatus status = prepare(instance, of, of->n_unknowns, of->n_knowns);
    if (status != SLIDE_OK) {
        return status;
    }
    for (size_t i = 0; i < of->n_knowns; ++i) {
        double *direction = direction_of(instance, of->knowns[i]);
        *direction = 1;
        differentiate(instance, of);
        *direction = 0;
        of->sensitivity[i] = 0;
        for (size_t j = 0; j < of->n_unknowns; ++j) {
            of->sensitivity[i] += of->seed[j] * slope_of(instance, of->unknowns[j]);
        }
    }
    return check_result(instance, of);
}
