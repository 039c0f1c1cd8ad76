/* Derivatives of the activations of the kernels (kernel.h). */
#ifndef SLIDE_ACTIVATION_SLOPE_H
#define SLIDE_ACTIVATION_SLOPE_H

#include <math.h>
#include <stdint.h>

static inline double slide_gelu_slope(double x) {
    const double root = 0.79788456080286536, cubic = 0.044715; /* sqrt(2 / pi) */
    double t = tanh(root * (x + cubic * x * x * x));
    return 0.5 * (1 + t) + 0.5 * x * (1 - t * t) * root * (1 + 3 * cubic * x * x);
}

/* The derivative where the argument is x; of a kink, that to its left. */
static inline double slide_activation_slope(uint32_t activation, double x) {
    double t;
    switch (activation) {
    case 1:
        return x > 0 ? 1 : 0;
    case 2:
        return x > 0 ? 1 : exp(x);
    case 3:
        t = tanh(x);
        return 1 - t * t;
    case 4:
        return slide_gelu_slope(x);
    case 5:
        return 3 * x * x;
    default:
        return 1;
    }
}

#endif
