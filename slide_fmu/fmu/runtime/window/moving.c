#include "moving.h"

#include <math.h>
#include <string.h>

static const double SLACK = 1e-6; /* a part this much shorter than a sample step is none */

SlideParts slide_parts(const SlideHistoryShape *shape, double length, double sample_step,
                       uint32_t largest) {
    if (shape->first_order) {
        return (SlideParts){1, length, 0, 1};
    }
    double count = fmax(ceil(length / sample_step - SLACK), 1);
    uint32_t taken = count < largest ? (uint32_t)count : largest;
    return (SlideParts){taken, length - (taken - 1) * sample_step, sample_step, 0.5};
}

double slide_part_length(const SlideParts *parts, uint32_t part) {
    return part == 0 ? parts->first : parts->further;
}

/* The time since the begin of the step at which the value of a part is taken. */
static double part_time(const SlideParts *parts, uint32_t part) {
    double begin = part == 0 ? 0 : parts->first + (part - 1) * parts->further;
    return begin + parts->taken_at * slide_part_length(parts, part);
}

/* Of a director, a complex number z, with w = (dz/dt) time / z: z e^w. */
static void turn_on(const double *z, const double *rates, double time, double *moved) {
    const double square = z[0] * z[0] + z[1] * z[1];
    const double growth = exp((rates[0] * z[0] + rates[1] * z[1]) * time / square);
    const double turn = (rates[1] * z[0] - rates[0] * z[1]) * time / square;
    const double c = growth * cos(turn), s = growth * sin(turn);
    moved[0] = z[0] * c - z[1] * s;
    moved[1] = z[0] * s + z[1] * c;
}

void slide_step_part(const SlideHistoryShape *shape, const SlideStepInputs *inputs, uint32_t part,
                     double *result) {
    const double *given = inputs->given, *rates = inputs->rates;
    const double time = part_time(&inputs->parts, part);
    if (rates == NULL) {
        memcpy(result, given, shape->n_inputs * sizeof *result);
        return;
    }
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        if (shape->cosine[i]) {
            turn_on(given + i, rates + i, time, result + i);
            ++i;
        } else {
            result[i] = given[i] + rates[i] * time;
        }
    }
}

void slide_step_sample(const SlideHistoryShape *shape, const SlideStepInputs *inputs,
                       uint32_t count, uint32_t left, double *sample) {
    slide_step_part(shape, inputs, shape->first_order ? 0 : count - 1 - left, sample);
    if (inputs->from != NULL) {
        slide_history_between(shape, inputs->from, sample, (double)left / count, sample);
    }
}
