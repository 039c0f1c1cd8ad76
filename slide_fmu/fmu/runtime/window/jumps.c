#include "jumps.h"

/* A change is a jump as far as it is larger than so many times those beside it: with 3, no sine of six samples or
 * more in a period has one. bound_statistics.py has the same number. */
static const double ABRUPT = 4;

enum { MOST_LATER = 4 }; /* a sample makes up for jumps that came at most so many before */

/* A communication step in which an input may jump. */
typedef struct {
    const SlideReader *reader;
    uint64_t number;
    double begin, length, next; /* s: its begin, its length and that of the step after it */
} Step;

static double jump_in(const Step *step, size_t input) {
    const SlideReader *reader = step->reader;
    const double change = slide_history_change(reader, step->number, input, NULL);
    double beside = 0;
    for (uint64_t back = 0; change != 0 && back <= 3; ++back) {
        double length = 0;
        if (back != 1 && step->number + 1 >= back) { /* the step after it, and two before */
            const double other =
                fabs(slide_history_change(reader, step->number + 1 - back, input, &length));
            beside = fmax(beside, length > 0 ? other * fmax(1, step->length / length) : 0);
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
static double left_to(const Step *step, double after, double *later) {
    const double h = step->reader->shape->sample_step, slack = step->reader->shape->slack;
    const double age = ceil((after - slack) / h) - 1; /* samples since the one in which it begins */
    const double first = after - age * h; /* when this one ends */
    const double known = fmax(ceil((step->length + step->next - first - slack) / h), 1);
    *later = age == known ? step->length / h : 0;
    if (step->length >= h - slack || (age != known && age != known + 1)) {
        return 0;
    }
    const double part = fmin(first / step->length, 1), span = step->length / h;
    const double middle = (0.5 * step->length - first) / h;
    const double moment = 0.5 - part - middle;
    const double second = 0.5 * (1.0 / 3 - middle * middle - span * span / 12);
    return age == known ? (known + 1) * moment - second : second - known * moment;
}

void slide_jumps_add(const SlideReader *reader, double end, const SlideActing *acting) {
    const SlideHistoryShape *shape = reader->shape;
    const double h = shape->sample_step, slack = shape->slack;
    Step step = {.reader = reader, .number = reader->at, .begin = reader->begin, .next = 0};
    step.length = slide_history_steps_length(reader, step.number);
    while (step.begin > end - (MOST_LATER + 1) * h - slack && step.number > 0) {
        step.next = step.length;
        step.number -= 1;
        step.length = slide_history_steps_length(reader, step.number);
        if (step.length == 0) {
            return; /* no step is kept that is older */
        }
        step.begin -= step.length;
        const double after = end - step.begin;
        if (after <= h + slack || step.length > h + slack) {
            continue;
        }
        double later;
        const double left = left_to(&step, after, &later);
        for (size_t i = 0; (left != 0 || later != 0) && i < shape->n_inputs; ++i) {
            if (shape->cosine[i]) {
                ++i;
                continue;
            }
            const double jump = jump_in(&step, i);
            acting->moments[i] += left * jump;
            acting->corrected[i] -= reader->doubted * later * jump;
        }
    }
}
