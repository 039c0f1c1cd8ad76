#include "moving.h"

#include <math.h>

static const double SLACK = 1e-6; /* a part this much shorter than a sample step is none */

/* Of a director, a complex number z, with w = (dz/dt) time / z: z e^w. */
static void turn_on(const double *z, const double *rates, double time, double *moved) {
    const double square = z[0] * z[0] + z[1] * z[1];
    const double growth = exp((rates[0] * z[0] + rates[1] * z[1]) * time / square);
    const double turn = (rates[1] * z[0] - rates[0] * z[1]) * time / square;
    const double c = growth * cos(turn), s = growth * sin(turn);
    moved[0] = z[0] * c - z[1] * s;
    moved[1] = z[0] * s + z[1] * c;
}

void slide_move_on(const SlideHistoryShape *shape, const SlideMovingStep *step, double time,
                   double *inputs) {
    const double *given = step->given, *rates = step->rates;
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        if (shape->cosine[i]) {
            turn_on(given + i, rates + i, time, inputs + i);
            ++i;
        } else {
            inputs[i] = given[i] + rates[i] * time;
        }
    }
}

void slide_append_moving(const SlideHistoryShape *shape, SlideHistory *history,
                         const SlideMovingStep *step, double *inputs) {
    const double whole = fmax(ceil(step->length / step->sample_step - SLACK), 1);
    const uint32_t held = whole < step->largest ? (uint32_t)whole : step->largest;
    const uint32_t count = shape->first_order ? 1 : held;
    const double first = step->length - (count - 1) * step->sample_step;
    for (uint32_t part = 0; part < count; ++part) {
        const double length = part == 0 ? first : step->sample_step;
        const double begin = part == 0 ? 0 : first + (part - 1) * step->sample_step;
        slide_move_on(shape, step, begin + (shape->first_order ? 1 : 0.5) * length, inputs);
        slide_history_append(shape, history, length, inputs, part > 0);
    }
}
