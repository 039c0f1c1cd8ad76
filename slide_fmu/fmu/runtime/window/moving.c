#include "moving.h"

#include <math.h>
#include <string.h>

static const double SLACK = 1e-6; /* a part this much shorter than a sample step is none */

SlideParts slide_parts(const SlideHistoryShape *shape, double length, double sample_step,
                       uint32_t largest) {
    if (shape->ramp) {
        return (SlideParts){1, length, 0, 1};
    }
    double count = fmax(ceil(length / sample_step - SLACK), 1);
    uint32_t taken = count < largest ? (uint32_t)count : largest;
    return (SlideParts){taken, length - (taken - 1) * sample_step, sample_step, 0.5};
}

double slide_part_length(const SlideParts *parts, uint32_t part) {
    return part == 0 ? parts->first : parts->further;
}

double slide_part_time(const SlideParts *parts, uint32_t part) {
    double begin = part == 0 ? 0 : parts->first + (part - 1) * parts->further;
    return begin + parts->taken_at * slide_part_length(parts, part);
}

/* Of the director, a complex number z, with w = (dz/dt) time / z: e^w. */
static void growth(const double *z, const double *rates, double time, double *w, double *factor) {
    double square = z[0] * z[0] + z[1] * z[1];
    w[0] = (rates[0] * z[0] + rates[1] * z[1]) * time / square;
    w[1] = (rates[1] * z[0] - rates[0] * z[1]) * time / square;
    factor[0] = exp(w[0]) * cos(w[1]);
    factor[1] = exp(w[0]) * sin(w[1]);
}

static void multiply(const double *a, const double *b, double *product) {
    double first = a[0] * b[0] - a[1] * b[1];
    product[1] = a[0] * b[1] + a[1] * b[0];
    product[0] = first;
}

void slide_moved(const SlideHistoryShape *shape, const double *inputs, const double *rates,
                 double time, double *moved) {
    if (shape->director) {
        double w[2], factor[2];
        growth(inputs, rates, time, w, factor);
        multiply(inputs, factor, moved);
        return;
    }
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        moved[i] = inputs[i] + rates[i] * time;
    }
}

void slide_step_part(const SlideHistoryShape *shape, const SlideStepInputs *inputs, uint32_t part,
                     double *result) {
    if (inputs->rates == NULL) {
        memcpy(result, inputs->given, shape->n_inputs * sizeof *result);
    } else {
        slide_moved(shape, inputs->given, inputs->rates, slide_part_time(&inputs->parts, part),
                    result);
    }
}

void slide_step_sample(const SlideHistoryShape *shape, const SlideStepInputs *inputs,
                       uint32_t count, uint32_t left, double *sample) {
    slide_step_part(shape, inputs, shape->ramp ? 0 : count - 1 - left, sample);
    if (inputs->from != NULL) {
        slide_history_between(shape, inputs->from, sample, (double)left / count, sample);
    }
}
