#include "exact.h"

#include <math.h>

static double activated(uint32_t activation, double x) {
    switch (activation) {
    case 1:
        return x < 0 ? 0 : x;
    case 2:
        return x <= 0 ? expm1(x) : x;
    case 3:
        return tanh(x);
    case 4: /* with sqrt(2 / pi) */
        return 0.5 * x * (1 + tanh(0.79788456080286536 * (x + 0.044715 * x * x * x)));
    case 5:
        return x * x * x;
    default:
        return x;
    }
}

void slide_activate_exact(uint32_t activation, double *x, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        x[i] = activated(activation, x[i]);
    }
}
