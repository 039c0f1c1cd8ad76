/* Signals of many records: sample by sample what the sets of features are (features/), formed once
 * for each sample of a record and several at a time. */
#include "record_kernel.h"

#include "record_chain.h"
#include "record_director.h"

#include <string.h>

/* An input or a signal from the first sample of a block on. */
static double *row(double *rows, size_t index) { return rows + index * SLIDE_ROOM + SLIDE_LEAD; }

/* What an input or signal changes in a step. */
static void form_changes(const SlidePoints *points, const double *of, double *changes) {
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
        for (size_t p = 0; features->n_signals > 2 * n && p < points->n_points; ++p) {
            second[p] = (input[p] - before[p]) - (before[p] - (before - records)[p]);
        }
    }
}

/* The turns of an angle, also in the sample before. */
static void form_turns(const Angle *angle, const SlidePoints *points, double *turns) {
    const size_t records = points->records, count = points->n_points + records;
    const double *x = row(points->inputs, angle->input) - records, *x_before = x - records;
    const double *y = x + SLIDE_ROOM, *y_before = x_before + SLIDE_ROOM;
    turns -= records;
    if (angle->director) {
        for (size_t p = 0; p < count; ++p) {
            turns[p] = angle_between(x_before[p], y_before[p], x[p], y[p]);
        }
        return;
    }
    for (size_t p = 0; p < count; ++p) {
        const double before = angle->middle + angle->half_range * x_before[p];
        turns[p] = wrapped_turn(angle->middle + angle->half_range * x[p] - before);
    }
}

static void form_directors(const SlideFeatures *features, const SlidePoints *points) {
    const Directors *directors = features->own;
    const size_t n = directors->n_angles, m = directors->n_others;
    for (size_t k = 0; k < n; ++k) {
        const Angle *angle = &directors->angles[k];
        double *turns = row(points->signals, 2 * n + k);
        form_direction(angle, row(points->inputs, angle->input), points->n_points,
                       row(points->signals, 2 * k));
        form_turns(angle, points, turns);
        form_changes(points, turns, row(points->signals, 3 * n + k));
    }
    for (size_t k = 0; k < m; ++k) {
        const double *input = row(points->inputs, directors->others[k]);
        memcpy(row(points->signals, 4 * n + k), input, points->n_points * sizeof *input);
        form_changes(points, input, row(points->signals, 4 * n + m + k));
    }
}

/* The changes of the wrench, in the axes of the base and in those that turn with the first joint. */
static void form_wrench_changes(const Chain *chain, const SlidePoints *points) {
    const size_t after_rates = chain->n_joints;
    const double *c = row(points->signals, after_rates + FRAME), *s = c + SLIDE_ROOM;
    for (size_t part = 0; part < 6; ++part) {
        form_changes(points, row(points->signals, WRENCH + part),
                     row(points->signals, WRENCH_CHANGE + part));
    }
    for (size_t part = 0; part < 6; part += 3) {
        const double *x = row(points->signals, WRENCH_CHANGE + part), *y = x + SLIDE_ROOM;
        double *turned = row(points->signals, after_rates + TURNED_WRENCH_CHANGE + part);
        for (size_t p = 0; p < points->n_points; ++p) {
            turned[p] = c[p] * x[p] + s[p] * y[p];
            (turned + SLIDE_ROOM)[p] = c[p] * y[p] - s[p] * x[p];
        }
        memcpy(turned + 2 * SLIDE_ROOM, y + SLIDE_ROOM, points->n_points * sizeof *y);
    }
}

/* The wrench is that of the sample before, too. */
static void form_chain(const SlideFeatures *features, const SlidePoints *points) {
    const Chain *chain = features->own;
    const size_t first = SLIDE_LEAD - points->records;
    for (size_t at = first; at < SLIDE_LEAD + points->n_points; at += SLIDE_MOTIONS) {
        follow_points(chain, points, at, chain->joints);
        write_loads(chain, chain->joints, points->signals + at, SLIDE_ROOM);
    }
    form_wrench_changes(chain, points);
}

void SLIDE_RECORD(signals)(const SlideFeatures *features, const SlidePoints *points) {
    if (features->set == &slide_chain_motion) {
        form_chain(features, points);
    } else if (features->set == &slide_director) {
        form_directors(features, points);
    } else {
        form_differences(features, points);
    }
}
