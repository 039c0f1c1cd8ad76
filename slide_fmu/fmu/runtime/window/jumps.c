#include "jumps.h"

/* A change is a jump as far as it is larger than so many times those beside it: with 3, no sine of six samples or
 * more in a period has one. bound_statistics.py has the same number. */
static const double ABRUPT = 4;

enum { MOST_LATER = 4 }; /* a sample makes up for jumps that came at most so many before */

/* A communication step in which an input may jump, with those beside it. */
typedef struct {
    const double *end;     /* [n_inputs], the inputs at the end of the one after it */
    const double *rows[4]; /* the one after it, itself and the two before it: length, inputs at the begin; NULL
                              where there is none */
    double begin;          /* s, of itself */
} Step;

static double length_of(const Step *step) { return step->rows[1][0]; }

/* How much an input changes in the step of a place in the rows; 0 where there is none. */
static double change_in(const Step *step, size_t place, size_t input) {
    if (step->rows[place] == NULL) {
        return 0;
    }
    return (place == 0 ? step->end[input] : step->rows[place - 1][1 + input]) -
           step->rows[place][1 + input];
}

/* The jump of an input in the step. A change beside it counts by its rate, where it took less time. */
static double jump_in(const Step *step, size_t input) {
    const double change = change_in(step, 1, input);
    if (fabs(change) <= ABRUPT * fabs(change_in(step, 0, input))) {
        return 0; /* as mostly: the rest takes longer */
    }
    double beside = 0;
    for (size_t place = 0; place < 4; ++place) {
        if (place != 1 && step->rows[place] != NULL) {
            const double shorter = fmax(1, length_of(step) / step->rows[place][0]);
            beside = fmax(beside, fabs(change_in(step, place, input)) * shorter);
        }
    }
    return copysign(fmax(fabs(change) - ABRUPT * beside, 0), change);
}

/* What a jump by 1 leaves to a sample that ends so long (s) after the begin of its step; later: the part of
 * a jump at the end of its step that comes later than the samples say, twice.
 *
 * The slope of an input is a density over time. Through samples, that of a jump lies in the sample step in which
 * it begins and, where it has not ended with this, in the next. Two samples after it change by what lets the
 * first and second moments of the density be those of a change at a constant rate in the communication step. The
 * first of them is the one that ends when it is known that the change was a jump. */
static double left_to(const SlideHistoryShape *shape, const Step *step, double after, double *later) {
    const double h = shape->sample_step, slack = shape->slack, length = length_of(step);
    const double age = ceil((after - slack) / h) - 1; /* samples since the one in which it begins */
    const double first = after - age * h; /* when this one ends */
    const double known = fmax(ceil((length + step->rows[0][0] - first - slack) / h), 1);
    *later = age == known ? length / h : 0;
    if (length >= h - slack || (age != known && age != known + 1)) {
        return 0;
    }
    const double part = fmin(first / length, 1), span = length / h;
    const double middle = (0.5 * length - first) / h;
    const double moment = 0.5 - part - middle;
    const double second = 0.5 * (1.0 / 3 - middle * middle - span * span / 12);
    return age == known ? (known + 1) * moment - second : second - known * moment;
}

/* What the jumps in a step leave to a sample. */
static void add(const SlideReader *reader, const Step *step, double after, const SlideActing *acting) {
    const SlideHistoryShape *shape = reader->shape;
    for (size_t i = 0; i < shape->n_inputs; i += 1 + (size_t)shape->cosine[i]) {
        const double jump = shape->cosine[i] ? 0 : jump_in(step, i);
        if (jump != 0) {
            double later;
            acting->moments[i] += jump * left_to(shape, step, after, &later);
            acting->corrected[i] -= jump * reader->doubted * later;
        }
    }
}

/* To the step before. */
static void go_back(const SlideReader *reader, Step *step, uint64_t *oldest) {
    step->end = step->rows[0] + 1;
    for (size_t place = 0; place < 3; ++place) {
        step->rows[place] = step->rows[place + 1];
    }
    step->rows[3] = *oldest > 0 ? slide_history_step(reader, --*oldest) : NULL;
    step->begin -= step->rows[1] == NULL ? 0 : length_of(step);
}

void slide_jumps_add(const SlideReader *reader, double end, const SlideActing *acting) {
    const SlideHistoryShape *shape = reader->shape;
    const double h = shape->sample_step, slack = shape->slack;
    const double *newest = slide_history_step(reader, reader->at);
    const double *after = slide_history_step(reader, reader->at + 1);
    /* it goes back to the step in which the sample ends, and on */
    Step step = {after == NULL ? reader->history->end : after + 1, {newest}, reader->begin};
    uint64_t oldest = reader->at;
    for (size_t place = 1; place < 4; ++place) {
        step.rows[place] = oldest > 0 ? slide_history_step(reader, --oldest) : NULL;
    }
    for (step.begin -= step.rows[1] == NULL ? 0 : length_of(&step);
         step.rows[1] != NULL && step.begin > end - (MOST_LATER + 1) * h - slack;
         go_back(reader, &step, &oldest)) {
        if (end - step.begin > h + slack && length_of(&step) <= h + slack) {
            add(reader, &step, end - step.begin, acting);
        }
    }
}
