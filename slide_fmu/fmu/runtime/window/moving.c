#include "moving.h"

#include <math.h>

/* Of a director, a complex number z, with w = (dz/dt) time / z: z e^w. */
static void turn_on(const double *z, const double *rates, double time, double *moved) {
    const double square = z[0] * z[0] + z[1] * z[1];
    const double growth = exp((rates[0] * z[0] + rates[1] * z[1]) * time / square);
    const double turn = (rates[1] * z[0] - rates[0] * z[1]) * time / square;
    const double c = growth * cos(turn), s = growth * sin(turn);
    moved[0] = z[0] * c - z[1] * s;
    moved[1] = z[0] * s + z[1] * c;
}

void slide_move_on(const SlideHistoryShape *shape, const SlideMovingStep *step, double *inputs) {
    const double *given = step->given, *rates = step->rates;
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        if (shape->cosine[i]) {
            turn_on(given + i, rates + i, step->length, inputs + i);
            ++i;
        } else {
            inputs[i] = given[i] + rates[i] * step->length;
        }
    }
}
