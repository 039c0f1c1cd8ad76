#include "history.h"

#include "jumps.h"

#include <math.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
static const double LARGEST_TURN = 3.141592654589793; /* a little more: rounding never decides */
static const double SLACK = 1e-6; /* in sample steps */

/* Largest ratio of the fourth to the second order of a smooth input; of a sine it is 0.03 (w h)^2. */
static const double SMOOTH = 0.25;

/* The same of one whose corrections are doubted in part only: of a sine with five samples in a period or more. */
static const double AS_A_SINE = 0.05;

/* Largest ratio of the fourth order to the bend of a sample before, where the second one passes zero. */
static const double SMOOTH_OF_MOST = 5e-3;

/* Of what an input changes by in a sample: a straight line bends so much by rounding. */
static const double SLIGHT = 1e-5;

enum {
    N_CURVE = 4, /* points of the polynomial between two of them */
    N_BENDS = 3, /* samples before one that show how much an input bends */
    N_JUMPS = 7  /* samples before one in which jumps count for it, and those that show that they are jumps */
};

SlideHistoryShape slide_history_shape(uint32_t n_inputs, uint32_t n_samples, double sample_step,
                                      uint32_t steps_per_sample, bool first_order, bool jumps,
                                      const bool *cosine, const double *low, const double *high) {
    /* a phase may end so many samples ago; held ones get something from one before and bend on */
    const uint64_t more = first_order ? (jumps ? N_JUMPS : 0) : 1 + N_BENDS;
    const uint64_t read = (uint64_t)n_samples + 2 + more;
    const uint64_t capacity = ((uint64_t)steps_per_sample + 1) * read;
    const double shortest = 2 * sample_step / steps_per_sample;
    const double reach = (double)read * sample_step;
    return (SlideHistoryShape){n_inputs, capacity,    shortest, SLACK * sample_step, sample_step,
                               reach,    first_order, jumps,    cosine, low, high};
}

static size_t step_size(const SlideHistoryShape *shape) {
    return (1 + (size_t)shape->n_inputs) * sizeof(double);
}

size_t slide_history_steps_size(const SlideHistoryShape *shape) {
    return (size_t)shape->capacity * step_size(shape);
}

void slide_history_place_end(SlideHistory *history, const SlideHistoryShape *shape,
                             SlideArena *arena) {
    history->count = slide_place(arena, 1, sizeof *history->count);
    history->end = slide_place(arena, shape->n_inputs, sizeof *history->end);
}

void slide_history_place(SlideHistory *history, const SlideHistoryShape *shape,
                         SlideArena *arena) {
    history->moved = slide_place(arena, (size_t)shape->capacity, shape->n_inputs);
    history->steps = slide_place(arena, (size_t)shape->capacity, step_size(shape));
}

static double *step_at(const SlideHistoryShape *shape, const SlideHistory *history,
                       uint64_t index) {
    return history->steps + (size_t)(index % shape->capacity) * (1 + (size_t)shape->n_inputs);
}

double *slide_history_newest(const SlideHistoryShape *shape, const SlideHistory *history) {
    return step_at(shape, history, *history->count - 1);
}

double *slide_history_before(const SlideHistoryShape *shape, const SlideHistory *history) {
    return step_at(shape, history, *history->count - 2);
}

static unsigned char *moved_at(const SlideHistoryShape *shape, const SlideHistory *history,
                               uint64_t index) {
    return history->moved + (size_t)(index % shape->capacity) * shape->n_inputs;
}

unsigned char *slide_history_moved(const SlideHistoryShape *shape, const SlideHistory *history,
                                   uint64_t age) {
    return moved_at(shape, history, *history->count - 1 - age);
}

double slide_history_length(const SlideHistoryShape *shape, const SlideHistory *history,
                            uint64_t age) {
    return step_at(shape, history, *history->count - 1 - age)[0];
}

/* Does the newest step, which ends with these inputs, go on from the one before as if both were one? Held
 * inputs that stay lose nothing by it. One that changes then may turn out to move smoothly from here on, which
 * counts where steps are not short. */
static bool is_joined(const SlideHistoryShape *shape, const SlideHistory *history,
                      const double *end) {
    const uint64_t newest = *history->count - 1;
    const double *before = step_at(shape, history, newest - 1);
    const double *step = step_at(shape, history, newest);
    if (before[0] + step[0] <= shape->shortest) {
        return true;
    }
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        const bool moved = shape->first_order || moved_at(shape, history, newest - 1)[i] ||
                           moved_at(shape, history, newest)[i];
        const bool changes = step[0] > shape->shortest && end[i] != step[1 + i];
        if (moved || before[1 + i] != step[1 + i] || changes) {
            return false;
        }
    }
    return true;
}

void slide_history_append(const SlideHistoryShape *shape, SlideHistory *history, double length,
                          const double *inputs) {
    if (*history->count > 2 && is_joined(shape, history, inputs)) {
        const double joined = slide_history_newest(shape, history)[0];
        *history->count -= 1;
        slide_history_newest(shape, history)[0] += joined;
    }
    double *step = step_at(shape, history, *history->count);
    step[0] = length;
    memcpy(step + 1, inputs, shape->n_inputs * sizeof *inputs);
    memset(moved_at(shape, history, *history->count), 0, shape->n_inputs);
    *history->count += 1;
}

void slide_history_place_undo(SlideHistoryUndo *undo, size_t n_inputs, SlideArena *arena) {
    undo->steps = slide_place(arena, 2, (1 + n_inputs) * sizeof *undo->steps);
    undo->moved = slide_place(arena, SLIDE_TOLD_LATER, n_inputs);
}

void slide_history_prepare(const SlideHistoryShape *shape, const SlideHistory *history,
                           const SlideHistoryUndo *undo) {
    const uint64_t count = *history->count;
    for (uint64_t age = 0; age < 2 && age < count; ++age) {
        memcpy(undo->steps + age * (1 + (size_t)shape->n_inputs),
               step_at(shape, history, count - 1 - age), step_size(shape));
    }
    for (uint64_t age = 0; age < SLIDE_TOLD_LATER && age < count; ++age) {
        memcpy(undo->moved + age * shape->n_inputs, slide_history_moved(shape, history, age),
               shape->n_inputs);
    }
}

void slide_history_undo(const SlideHistoryShape *shape, const SlideHistoryUndo *undo,
                        SlideHistory *history) {
    const uint64_t count = *history->count;
    for (uint64_t age = 0; age < 2 && age < count; ++age) {
        memcpy(step_at(shape, history, count - 1 - age),
               undo->steps + age * (1 + (size_t)shape->n_inputs), step_size(shape));
    }
    for (uint64_t age = 0; age < SLIDE_TOLD_LATER && age < count; ++age) {
        memcpy(slide_history_moved(shape, history, age), undo->moved + age * shape->n_inputs,
               shape->n_inputs);
    }
}

void slide_history_take_back(const SlideHistoryShape *shape, SlideHistory *history) {
    const double *newest = slide_history_newest(shape, history);
    memcpy(history->end, newest + 1, shape->n_inputs * sizeof *history->end);
    *history->count -= 1;
}

static uint64_t oldest_of(const SlideHistoryShape *shape, uint64_t count) {
    return count > shape->capacity ? count - shape->capacity : 0;
}

SlideHistorySpan slide_history_needed(const SlideHistoryShape *shape, uint64_t count,
                                      const void *steps) {
    const uint64_t oldest = oldest_of(shape, count);
    SlideHistorySpan span = {count - (count > 0), count};
    for (double covered = 0, length; covered < shape->reach && span.first > oldest;
         covered += length) {
        span.first -= 1;
        memcpy(&length,
               (const unsigned char *)steps + (span.first % shape->capacity) * step_size(shape),
               sizeof length);
    }
    /* a curve looks back at two steps more */
    span.first = span.first < oldest + N_CURVE - 2 ? oldest : span.first - (N_CURVE - 2);
    return span;
}

void slide_history_copy(const SlideHistoryShape *shape, SlideHistorySpan span, const void *from,
                        void *to) {
    const size_t first = (size_t)(span.first % shape->capacity) * step_size(shape);
    const size_t size = (size_t)(span.end - span.first) * step_size(shape);
    const size_t to_end = slide_history_steps_size(shape) - first;
    const size_t until_end = size < to_end ? size : to_end;
    memcpy((unsigned char *)to + first, (const unsigned char *)from + first, until_end);
    memcpy(to, from, size - until_end);
}

/* Turned back from its end, which is exact. */
static void on_arc(const double *from, const double *to, double left, double *director) {
    double turn = slide_change_to(true, from, to);
    turn -= 2 * PI * ceil((turn - LARGEST_TURN) / (2 * PI));
    double length = 1 - left * (1 - hypot(from[0], from[1]) / hypot(to[0], to[1]));
    double c = length * cos(left * turn), s = length * sin(left * turn);
    double first = c * to[0] + s * to[1];
    director[1] = c * to[1] - s * to[0];
    director[0] = first;
}

/* One input, or both of a director: gives how many. */
static size_t between(const SlideHistoryShape *shape, size_t input, const double *from,
                      const double *to, double left, double *inputs) {
    if (shape->cosine[input]) {
        on_arc(from + input, to + input, left, inputs + input);
        return 2;
    }
    inputs[input] = to[input] - left * (to[input] - from[input]);
    return 1;
}

void slide_history_between(const SlideHistoryShape *shape, const double *from, const double *to,
                           double left, double *inputs) {
    for (size_t i = 0; i < shape->n_inputs;) {
        i += between(shape, i, from, to, left, inputs);
    }
}

static uint64_t oldest(const SlideReader *reader) {
    return oldest_of(reader->shape, *reader->history->count);
}

SlideReader slide_history_reader(const SlideHistoryShape *shape, const SlideHistory *history) {
    uint64_t newest = *history->count - 1;
    return (SlideReader){shape, history, newest, -step_at(shape, history, newest)[0], false, 1};
}

const double *slide_history_step(const SlideReader *reader, uint64_t step) {
    const bool kept = step >= oldest(reader) && step < *reader->history->count;
    return kept ? step_at(reader->shape, reader->history, step) : NULL;
}

static const double *step_read(const SlideReader *reader) {
    return step_at(reader->shape, reader->history, reader->at);
}

/* The end of the step read last. */
static double end_of(const SlideReader *reader) { return reader->begin + step_read(reader)[0]; }

/* To the last step that begins at a time or before it, or to the oldest. */
static void seek(SlideReader *reader, double time) {
    uint64_t newest = *reader->history->count - 1;
    while (reader->begin > time && reader->at > oldest(reader)) {
        reader->at -= 1;
        reader->begin -= step_read(reader)[0];
    }
    while (reader->at < newest && end_of(reader) <= time) {
        reader->begin = end_of(reader);
        reader->at += 1;
    }
}

/* The inputs at the end of a step. */
static const double *inputs_after(const SlideReader *reader, uint64_t step) {
    return step + 1 == *reader->history->count
               ? reader->history->end
               : step_at(reader->shape, reader->history, step + 1) + 1;
}

static bool has_moved(const SlideReader *reader, uint64_t step, size_t input) {
    return moved_at(reader->shape, reader->history, step)[input] != SLIDE_HELD;
}

/* Weights of the points of a polynomial, both ends of a step and those before it, at a time. */
typedef struct {
    double time;
    double times[N_CURVE];            /* of the points, the end of the step first */
    double weights[N_CURVE][N_CURVE]; /* of as many points as the row says, and one */
    bool formed[N_CURVE];             /* is a row there? */
} Curve;

static Curve curve_at(const SlideReader *reader, double time) {
    Curve curve = {.time = time};
    curve.times[0] = end_of(reader);
    curve.times[1] = reader->begin;
    for (size_t i = 2; i < N_CURVE && reader->at + 1 >= oldest(reader) + i; ++i) {
        const double *before = step_at(reader->shape, reader->history, reader->at + 1 - i);
        curve.times[i] = curve.times[i - 1] - before[0];
    }
    return curve;
}

static const double *weights_of(Curve *curve, size_t count) {
    double *weights = curve->weights[count - 1];
    for (size_t i = 0; !curve->formed[count - 1] && i < count; ++i) {
        double above = 1, below = 1;
        for (size_t j = 0; j < count; ++j) {
            above *= j == i ? 1 : curve->time - curve->times[j];
            below *= j == i ? 1 : curve->times[i] - curve->times[j];
        }
        weights[i] = above / below;
    }
    curve->formed[count - 1] = true;
    return weights;
}

/* How far one input that moves within the step read last is behind the end of the step: on the
 * polynomial through both its ends and up to two points before, as far as the input moved between
 * them. */
static double behind_on_curve(const SlideReader *reader, size_t input, Curve *curve) {
    double values[N_CURVE], sum = 0;
    const double *last = step_read(reader) + 1;
    const bool of_angle = reader->shape->cosine[input];
    uint64_t step = reader->at;
    size_t count = 2;
    values[1] = slide_change_to(of_angle, last + input, inputs_after(reader, step) + input);
    for (; count < N_CURVE && step > oldest(reader) && has_moved(reader, step - 1, input); ++count) {
        step -= 1;
        const double *before = step_at(reader->shape, reader->history, step) + 1;
        values[count] = values[count - 1] + slide_change_to(of_angle, before + input, last + input);
        last = before;
    }
    const double *weights = weights_of(curve, count);
    for (size_t i = 1; i < count; ++i) {
        sum += weights[i] * values[i];
    }
    return sum;
}

/* One input, or both of a director, in the step read last, in which it moves. */
static void on_curve(const SlideReader *reader, size_t input, Curve *curve, double *inputs) {
    const double *end = inputs_after(reader, reader->at) + input;
    const double behind = behind_on_curve(reader, input, curve);
    if (reader->shape->cosine[input]) {
        const double c = cos(behind), s = sin(behind), first = end[0];
        inputs[0] = c * first + s * end[1];
        inputs[1] = c * end[1] - s * first;
    } else {
        inputs[0] = end[0] - behind;
    }
}

void slide_history_at(SlideReader *reader, double time, double *inputs) {
    const SlideHistoryShape *shape = reader->shape;
    seek(reader, time);
    const double *begin = step_read(reader) + 1, *end = inputs_after(reader, reader->at);
    const double past = time - reader->begin, length = step_read(reader)[0];
    const double left = slide_within(1 - past / length, 0, 1);
    if (past <= shape->slack) {
        memcpy(inputs, begin, shape->n_inputs * sizeof *inputs);
        return;
    }
    if (length - past <= shape->slack) {
        memcpy(inputs, end, shape->n_inputs * sizeof *inputs);
        return;
    }
    Curve curve = curve_at(reader, time);
    for (size_t i = 0; i < shape->n_inputs;) {
        if (has_moved(reader, reader->at, i)) {
            on_curve(reader, i, &curve, inputs + i);
            if (!shape->cosine[i]) { /* through a point at the end of its range it does not leave this */
                inputs[i] = slide_within(inputs[i], fmin(fmin(begin[i], end[i]), shape->low[i]),
                                   fmax(fmax(begin[i], end[i]), shape->high[i]));
            }
            i += 1 + shape->cosine[i];
        } else if (shape->first_order) {
            i += between(shape, i, begin, end, left, inputs);
        } else {
            inputs[i] = begin[i];
            i += 1;
        }
    }
}

/* A copy of the reader at a time. */
static SlideReader sought(const SlideReader *reader, double time) {
    SlideReader other = *reader;
    seek(&other, time);
    return other;
}

/* What an input is at a time within a sample in all of which it moves. */
static double moving_at(const SlideReader *reader, size_t input, double time) {
    const SlideReader other = sought(reader, fmin(time, -reader->shape->slack));
    Curve curve = curve_at(&other, time);
    double value;
    on_curve(&other, input, &curve, &value);
    return value;
}

/* How an input goes over a sample. */
typedef struct {
    double mean;    /* over time, linear where it moves */
    double moments[SLIDE_MOMENTS]; /* SlideActing.moments */
    bool all_moves; /* does it move in all of the sample? */
} Course;

static Course course_of(const SlideReader *reader, size_t input, double begin, double end) {
    const double slack = reader->shape->slack;
    SlideReader part = sought(reader, begin + slack);
    Course course = {0, {0}, true};
    const double middle = 0.5 * (begin + end);
    for (double from = begin; from < end - slack;) {
        const bool last = part.at + 1 == *part.history->count;
        const double to = last ? end : fmin(end_of(&part), end), now = step_read(&part)[1 + input];
        double value = now, rise = 0;
        if (has_moved(&part, part.at, input)) {
            const double length = step_read(&part)[0];
            const double left = 1 - (0.5 * (from + to) - part.begin) / length;
            const double after = inputs_after(&part, part.at)[input];
            value = after - slide_within(left, 0, 1) * (after - now);
            rise = (after - now) * (to - from) / length;
        } else {
            course.all_moves = false;
        }
        const double share = (to - from) / (end - begin);
        course.mean += share * value;
        const double late = (0.5 * (from + to) - middle) / (end - begin);
        const double around = late * late + share * share / 12, own = share * share / 12;
        course.moments[0] += share * (value * late + own * rise / share);
        course.moments[1] += share * (value * around + 2 * own * late * rise / share);
        course.moments[2] += share * (value * late * (late * late + 3 * own) +
                                      own * rise / share * (3 * late * late + 1.8 * own));
        from = to;
        if (!last) {
            part.begin = end_of(&part);
            part.at += 1;
        }
    }
    course.moments[1] -= course.mean / 12;
    return course;
}

/* How much does an input bend in one of the samples before, at most? */
static double most_before(const SlideReader *reader, size_t input, double begin, double end) {
    const double half = 0.5 * (end - begin);
    double after = moving_at(reader, input, begin), most = 0;
    for (int age = 1; age <= N_BENDS; ++age) {
        const double middle = moving_at(reader, input, begin - (2 * age - 1) * half);
        const double before = moving_at(reader, input, begin - 2 * age * half);
        most = fmax(most, fabs(before - 2 * middle + after));
        after = before;
    }
    return most;
}

/* What must be held for a sample to have the effect of an input that moves in all of it. A hold makes
 * a sine of the angular frequency w smaller by sin(x) / x, x = w h / 2; so what is held is the Taylor
 * series of x / sin(x) in derivatives at the middle: u - h^2 / 24 u_2 + 7 h^4 / 5760 u_4. The last term
 * only where four steps show it. False where an input is not so smooth. */
static bool held_for(const SlideReader *reader, size_t input, double begin, double end, double *held,
                     double *corrected, double edges[2]) {
    const double quarter = 0.25 * (end - begin);
    const double first = moving_at(reader, input, begin), last = moving_at(reader, input, end);
    const double middle = moving_at(reader, input, begin + 2 * quarter);
    const double bend = first - 2 * middle + last;
    double correction = -bend / 6, part = 1;
    const double most = most_before(reader, input, begin, end), slight = SLIGHT * fabs(last - first);
    bool smooth = fabs(bend) <= 2 * fmax(most, slight); /* else it may have a kink */
    edges[0] = (4 * middle - 3 * first - last) / 12;
    edges[1] = (3 * last - 4 * middle + first) / 12;
    if (step_read(reader)[0] <= quarter + reader->shape->slack) {
        const double before = moving_at(reader, input, begin + quarter);
        const double after = moving_at(reader, input, end - quarter);
        const double fourth = 14 * (first - 4 * before + 6 * middle - 4 * after + last) / 45;
        const double second = (16 * (before + after) - first - last - 30 * middle) / 18;
        smooth = fabs(fourth) <= fmax(fmax(SMOOTH * fabs(second), SMOOTH_OF_MOST * most), slight);
        correction = smooth ? fourth - second : correction;
        /* else a sample may be a line from end to end, as of a table, or part of a pulse */
        part = fabs(fourth) <= AS_A_SINE * fabs(second) ? reader->doubted : 1;
        edges[0] = (48 * before - 25 * first - 36 * middle + 16 * after - 3 * last) / 36;
        edges[1] = (25 * last - 48 * after + 36 * middle - 16 * before + 3 * first) / 36;
    }
    *held = middle + correction;
    *corrected = part * correction;
    return smooth;
}

static void sample_of(const SlideReader *reader, size_t input, double begin, double end,
                      const SlideActing *acting) {
    const Course course = course_of(reader, input, begin, end);
    const bool may = course.all_moves && !reader->straight;
    double held = course.mean, corrected = 0, edges[2] = {0, 0};
    const bool smooth = may && held_for(reader, input, begin, end, &held, &corrected, edges);
    acting->inputs[input] = smooth ? held : course.mean;
    acting->corrected[input] = smooth ? corrected : held - course.mean;
    for (size_t order = 0; order < SLIDE_MOMENTS; ++order) {
        acting->moments[order * reader->shape->n_inputs + input] = smooth ? 0 : course.moments[order];
    }
    acting->edges[input] = smooth ? edges[0] : 0;
    acting->edges[reader->shape->n_inputs + input] = smooth ? edges[1] : 0;
}

/* Inputs of which some steps may move. */
static void sample_held(SlideReader *reader, double begin, double end,
                        const SlideActing *acting) {
    const SlideHistoryShape *shape = reader->shape;
    double *inputs = acting->inputs;
    seek(reader, begin + shape->slack);
    const double *now = step_read(reader) + 1;
    if (end_of(reader) >= end - shape->slack) { /* one step, mostly held */
        memcpy(inputs, now, shape->n_inputs * sizeof *inputs);
    }
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        const bool moves = has_moved(reader, reader->at, i);
        if (shape->cosine[i]) {
            const double left = 1 - (0.5 * (begin + end) - reader->begin) / step_read(reader)[0];
            memcpy(inputs + i, now + i, 2 * sizeof *inputs);
            if (moves) { /* it has no mean, but a middle */
                on_arc(now + i, inputs_after(reader, reader->at) + i, slide_within(left, 0, 1),
                       inputs + i);
            }
            ++i;
        } else if (moves || end_of(reader) < end - shape->slack) {
            sample_of(reader, i, begin, end, acting);
        }
    }
}

void slide_history_sample(SlideReader *reader, double begin, double end, const SlideActing *acting) {
    const size_t row = reader->shape->n_inputs * sizeof(double);
    memset(acting->corrected, 0, row);
    memset(acting->moments, 0, SLIDE_MOMENTS * row);
    memset(acting->edges, 0, 2 * row);
    if (reader->shape->first_order) {
        slide_history_at(reader, end, acting->inputs);
        if (reader->shape->jumps) {
            slide_jumps_add(reader, end, acting);
        }
    } else {
        sample_held(reader, begin, end, acting);
    }
}
