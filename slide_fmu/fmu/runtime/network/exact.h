/* Networks in double precision, written plainly, for differences of results that lie near each
 * other: in single precision their rounding would be most of the difference. Weights, features and
 * layout are those of the networks that run in steps. */
#ifndef SLIDE_EXACT_H
#define SLIDE_EXACT_H

#include <stddef.h>
#include <stdint.h>

/* Activations in place, with the numbers of those of the kernels. */
void slide_activate_exact(uint32_t activation, double *x, size_t count);

#endif
