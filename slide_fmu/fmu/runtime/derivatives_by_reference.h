/* Derivatives between variables, by value reference; the functions of all versions of FMI call
 * these. */
#ifndef SLIDE_DERIVATIVES_BY_REFERENCE_H
#define SLIDE_DERIVATIVES_BY_REFERENCE_H

#include "instance.h"

/* Variables whose derivatives are wanted: outputs that the surrogate predicts, by inputs. */
typedef struct {
    const fmi2ValueReference *unknowns;
    size_t n_unknowns;
    const fmi2ValueReference *knowns;
    size_t n_knowns;
} SlideDerivativePair;

/* Directional derivative: seed [n_knowns] to sensitivity [n_unknowns]; a known that is given twice
 * counts as the sum. Called in initialization, step mode or after the end. Errors are logged. */
fmi2Status slide_get_directional_derivative(fmi2Component c, const SlideDerivativePair *of,
                                            const double *seed, double *sensitivity,
                                            const char *function);

/* Adjoint derivative: seed [n_unknowns] to sensitivity [n_knowns]. */
fmi2Status slide_get_adjoint_derivative(fmi2Component c, const SlideDerivativePair *of,
                                        const double *seed, double *sensitivity,
                                        const char *function);

#endif
