/* FMI 3.0: derivatives of outputs by inputs (derivative.h says of what). */
#include "derivatives_by_reference.h"
#include "fmi3.h"

/* All variables are scalars: each has one seed or sensitivity. */
static bool counts_agree(fmi3Instance c, size_t seeded, size_t n_seed, size_t found,
                         size_t n_sensitivity, const char *function) {
    const SlideInstance *instance = c;
    bool agree = n_seed == seeded && n_sensitivity == found;
    if (instance != NULL && !agree) {
        slide_report(instance, SLIDE_ERROR,
                     "%s: %llu seeds and %llu sensitivities; expected %llu and %llu, one for each "
                     "variable",
                     function, (unsigned long long)n_seed, (unsigned long long)n_sensitivity,
                     (unsigned long long)seeded, (unsigned long long)found);
    }
    return agree;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                        size_t n_unknowns, const fmi3ValueReference knowns[],
                                        size_t n_knowns, const fmi3Float64 seed[], size_t n_seed,
                                        fmi3Float64 sensitivity[], size_t n_sensitivity) {
    const SlideDerivativePair of = {unknowns, n_unknowns, knowns, n_knowns};
    if (!counts_agree(instance, n_knowns, n_seed, n_unknowns, n_sensitivity, __func__)) {
        return fmi3Error;
    }
    return (fmi3Status)slide_get_directional_derivative(instance, &of, seed, sensitivity, __func__);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                    size_t n_unknowns, const fmi3ValueReference knowns[],
                                    size_t n_knowns, const fmi3Float64 seed[], size_t n_seed,
                                    fmi3Float64 sensitivity[], size_t n_sensitivity) {
    const SlideDerivativePair of = {unknowns, n_unknowns, knowns, n_knowns};
    if (!counts_agree(instance, n_unknowns, n_seed, n_knowns, n_sensitivity, __func__)) {
        return fmi3Error;
    }
    return (fmi3Status)slide_get_adjoint_derivative(instance, &of, seed, sensitivity, __func__);
}
