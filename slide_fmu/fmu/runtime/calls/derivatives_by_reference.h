/* Derivatives between variables, by value reference; the functions of all versions of FMI call
 * these. */
#ifndef SLIDE_DERIVATIVES_BY_REFERENCE_H
#define SLIDE_DERIVATIVES_BY_REFERENCE_H

#include "instance.h"

/* Variables whose derivatives are wanted: scalar outputs, also those that tell about others, by
 * inputs. */
typedef struct {
    const uint32_t *unknowns;
    size_t n_unknowns;
    const uint32_t *knowns;
    size_t n_knowns;
} SlideDerivativePair;

/* Directional derivative: seed [n_knowns] to sensitivity [n_unknowns]; a known that is given twice
 * counts as the sum. Called in initialization, step mode or after the end. Errors are logged. */
SlideStatus slide_get_directional_derivative(void *component, const SlideDerivativePair *of,
                                            const double *seed, double *sensitivity,
                                            const char *function);

/* Adjoint derivative: seed [n_unknowns] to sensitivity [n_knowns]. */
SlideStatus slide_get_adjoint_derivative(void *component, const SlideDerivativePair *of,
                                        const double *seed, double *sensitivity,
                                        const char *function);

#endif
