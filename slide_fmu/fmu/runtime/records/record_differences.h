/* Changes of many samples at once, and the set of features that consists of them. */
#ifndef SLIDE_RECORD_DIFFERENCES_H
#define SLIDE_RECORD_DIFFERENCES_H

#include "record_kernel.h"

#include <string.h>

/* An input or a signal from the first sample of a block on. */
static double *row(double *rows, size_t index) { return rows + index * SLIDE_ROOM + SLIDE_LEAD; }

/* What an input or signal changes in a step. */
SLIDE_CALLED void form_changes(const SlidePoints *points, const double *of, double *changes) {
    SLIDE_EACH
    for (size_t p = 0; p < points->n_points; ++p) {
        changes[p] = of[p] - (of - points->records)[p];
    }
}

static void form_differences(const SlideFeatures *features, const SlidePoints *points) {
    const size_t n = features->n_inputs, records = points->records;
    for (size_t i = 0; i < n; ++i) {
        const double *input = row(points->inputs, i), *before = input - records;
        memcpy(row(points->signals, i), input, points->n_points * sizeof *input);
        if (features->n_signals > n) {
            form_changes(points, input, row(points->signals, n + i));
        }
        double *second = row(points->signals, 2 * n + i);
        SLIDE_EACH
        for (size_t p = 0; features->n_signals > 2 * n && p < points->n_points; ++p) {
            second[p] = (input[p] - before[p]) - (before[p] - (before - records)[p]);
        }
    }
}

/* Add what weights of numbers, of their changes or of the changes of these (order 0 to 2) give to
 * the gradient by the numbers. */
SLIDE_CALLED void pull_changes(const SlidePoints *points, int order, const double *weights,
                         double *gradient) {
    static const double factors[3][3] = {{1, 0, 0}, {1, -1, 0}, {1, -2, 1}};
    for (int age = 0; age <= order; ++age) {
        double *to = gradient - (size_t)age * points->records;
        SLIDE_EACH
        for (size_t p = 0; p < points->n_points; ++p) {
            to[p] += factors[order][age] * weights[p];
        }
    }
}

static void pull_differences(const SlideFeatures *features, const SlidePoints *points) {
    const size_t n = features->n_inputs;
    for (size_t i = 0; i < features->n_signals; ++i) {
        pull_changes(points, (int)(i / n), row(points->of_signals, i),
                     row(points->of_inputs, i % n));
    }
}

#endif
