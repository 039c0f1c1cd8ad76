#include "history.h"

#include <math.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
static const double LARGEST_TURN = 3.141592654589793; /* a little more: rounding never decides */
static const double SLACK = 1e-6; /* in sample steps */

static uint64_t capacity_for(uint32_t n_samples, uint32_t steps_per_sample) {
    return slide_power_of_two(((uint64_t)steps_per_sample + 1) * ((uint64_t)n_samples + 1));
}

SlideHistoryShape slide_history_shape(uint32_t n_inputs, uint32_t n_samples, double sample_step,
                                      bool first_order, const bool *cosine) {
    const uint64_t capacity = capacity_for(n_samples, SLIDE_STEPS_PER_SAMPLE);
    const double shortest = (first_order ? 2 : 1) * sample_step / SLIDE_STEPS_PER_SAMPLE;
    return (SlideHistoryShape){n_inputs, capacity,    shortest, SLACK * sample_step,
                               first_order, cosine};
}

static size_t bytes_of_step(uint32_t n_inputs) { return (1 + (size_t)n_inputs) * sizeof(double); }

static size_t step_size(const SlideHistoryShape *shape) { return bytes_of_step(shape->n_inputs); }

size_t slide_history_size_with(uint32_t n_inputs, uint32_t n_samples, uint32_t steps_per_sample) {
    return (size_t)capacity_for(n_samples, steps_per_sample) * bytes_of_step(n_inputs);
}

size_t slide_history_steps_size(const SlideHistoryShape *shape) {
    return (size_t)shape->capacity * step_size(shape);
}

void slide_history_place(SlideHistory *history, const SlideHistoryShape *shape,
                         SlideArena *arena) {
    history->count = slide_place(arena, 3, sizeof *history->count);
    history->before = slide_place(arena, 4, step_size(shape));
    history->steps = slide_place(arena, (size_t)shape->capacity, step_size(shape));
}

static double *step_at(const SlideHistoryShape *shape, const SlideHistory *history,
                       uint64_t index) {
    return history->steps + (index & (shape->capacity - 1)) * (1 + (size_t)shape->n_inputs);
}

/* Is a step joined to the one before it? Held inputs that stay lose nothing by it. */
static bool is_joined(const SlideHistoryShape *shape, const double *before, double length,
                      const double *inputs) {
    if (shape->first_order) {
        return before[0] + length <= shape->shortest;
    }
    return before[0] < shape->shortest ||
           memcmp(before + 1, inputs, shape->n_inputs * sizeof *inputs) == 0;
}

void slide_history_append(const SlideHistoryShape *shape, SlideHistory *history, double length,
                          const double *inputs, bool goes_on) {
    const uint64_t count = *history->count;
    double *step = step_at(shape, history, count - 1);
    if (count > 1 && !goes_on && is_joined(shape, step, length, inputs)) {
        length += step[0];
    } else {
        step = step_at(shape, history, count);
        *history->count = count + 1;
    }
    step[0] = length;
    memcpy(step + 1, inputs, shape->n_inputs * sizeof *inputs);
}

/* Of a mark: the newest step before it, and the place after that. */
static double *before_mark(const SlideHistoryShape *shape, const SlideHistory *history,
                           SlideMark mark) {
    return history->before + 2 * (size_t)mark * (1 + (size_t)shape->n_inputs);
}

void slide_history_begin(const SlideHistoryShape *shape, SlideHistory *history, SlideMark mark,
                         bool whole) {
    const uint64_t count = history->count[1 + mark] = history->count[0];
    double *before = before_mark(shape, history, mark);
    memset(before, 0, 2 * step_size(shape)); /* equal states are equal bytes */
    if (count > 0) {
        memcpy(before, step_at(shape, history, count - 1), step_size(shape));
    }
    if (whole && count >= shape->capacity) {
        memcpy(before + 1 + shape->n_inputs, step_at(shape, history, count), step_size(shape));
    }
}

void slide_history_go_back(const SlideHistoryShape *shape, SlideHistory *history, SlideMark mark) {
    const uint64_t count = history->count[0] = history->count[1 + mark];
    const double *before = before_mark(shape, history, mark);
    memcpy(step_at(shape, history, count - 1), before, step_size(shape));
    memcpy(step_at(shape, history, count), before + 1 + shape->n_inputs, step_size(shape));
}

static size_t offset_of(const SlideHistoryShape *shape, uint64_t index) {
    return (size_t)(index & (shape->capacity - 1)) * step_size(shape);
}

static uint64_t oldest_of(const SlideHistoryShape *shape, uint64_t count) {
    return count > shape->capacity ? count - shape->capacity : 0;
}

SlideHistorySpan slide_history_all(const SlideHistoryShape *shape, uint64_t count) {
    return (SlideHistorySpan){oldest_of(shape, count), count};
}

SlideHistorySpan slide_history_since(const SlideHistoryShape *shape, uint64_t count,
                                     const void *steps, double time) {
    const SlideHistorySpan all = slide_history_all(shape, count);
    SlideHistorySpan span = {count, count};
    for (double covered = 0, length; covered < time && span.first > all.first; covered += length) {
        span.first -= 1;
        memcpy(&length, (const unsigned char *)steps + offset_of(shape, span.first),
               sizeof length);
    }
    span.first -= span.first > all.first; /* inputs move on from those of the step before */
    return span;
}

void slide_history_copy(const SlideHistoryShape *shape, SlideHistorySpan span, const void *from,
                        void *to) {
    const size_t first = offset_of(shape, span.first);
    const size_t size = (size_t)(span.end - span.first) * step_size(shape);
    const size_t to_end = slide_history_steps_size(shape) - first;
    const size_t until_end = size < to_end ? size : to_end;
    memcpy((unsigned char *)to + first, (const unsigned char *)from + first, until_end);
    memcpy(to, from, size - until_end);
}

/* Turned back from its end, which is exact. */
static void on_arc(const double *from, const double *to, double left, double *director) {
    double turn = atan2(to[1], to[0]) - atan2(from[1], from[0]);
    turn -= 2 * PI * ceil((turn - LARGEST_TURN) / (2 * PI));
    double length = 1 - left * (1 - hypot(from[0], from[1]) / hypot(to[0], to[1]));
    double c = length * cos(left * turn), s = length * sin(left * turn);
    double first = c * to[0] + s * to[1];
    director[1] = c * to[1] - s * to[0];
    director[0] = first;
}

void slide_history_between(const SlideHistoryShape *shape, const double *from, const double *to,
                           double left, double *inputs) {
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        if (shape->cosine[i]) {
            on_arc(from + i, to + i, left, inputs + i);
            ++i;
        } else {
            inputs[i] = to[i] - left * (to[i] - from[i]);
        }
    }
}

const double *slide_history_newest(const SlideHistoryShape *shape, const SlideHistory *history) {
    return step_at(shape, history, *history->count - 1) + 1;
}

static uint64_t oldest(const SlideReader *reader) {
    return oldest_of(reader->shape, *reader->history->count);
}

SlideReader slide_history_reader(const SlideHistoryShape *shape, const SlideHistory *history) {
    uint64_t newest = *history->count - 1;
    return (SlideReader){shape, history, newest, -step_at(shape, history, newest)[0]};
}

/* To the last step that begins at a time or before it, or to the oldest. */
static void seek(SlideReader *reader, double time) {
    uint64_t newest = *reader->history->count - 1;
    while (reader->begin > time && reader->at > oldest(reader)) {
        reader->at -= 1;
        reader->begin -= step_at(reader->shape, reader->history, reader->at)[0];
    }
    while (reader->at < newest) {
        double end = reader->begin + step_at(reader->shape, reader->history, reader->at)[0];
        if (!(end <= time)) {
            return;
        }
        reader->at += 1;
        reader->begin = end;
    }
}

static double within(double value, double low, double high) {
    return value < low ? low : (value > high ? high : value);
}

/* The inputs before the step read last; of the oldest one, its own. */
static const double *inputs_before(const SlideReader *reader) {
    uint64_t before = reader->at > oldest(reader) ? reader->at - 1 : reader->at;
    return step_at(reader->shape, reader->history, before) + 1;
}

/* The part of the step read last that is left at a time. */
static double part_left(const SlideReader *reader, double time) {
    double length = step_at(reader->shape, reader->history, reader->at)[0];
    return 1 - within((time - reader->begin) / length, 0, 1);
}

/* The end of the step read last. */
static double end_of(const SlideReader *reader) {
    return reader->begin + step_at(reader->shape, reader->history, reader->at)[0];
}

/* What is held where a sample begins; if others follow within it, their mean over time, but for
 * directors, whose mean may have no direction. */
static void sample_held(SlideReader *reader, double begin, double end, double *inputs) {
    const SlideHistoryShape *shape = reader->shape;
    const uint64_t newest = *reader->history->count - 1;
    seek(reader, begin + shape->slack);
    memcpy(inputs, step_at(shape, reader->history, reader->at) + 1,
           shape->n_inputs * sizeof *inputs);
    while (reader->at < newest && end_of(reader) < end - shape->slack) {
        const double *before = step_at(shape, reader->history, reader->at) + 1;
        reader->begin = end_of(reader);
        reader->at += 1;
        const double *now = step_at(shape, reader->history, reader->at) + 1;
        const double part = (end - reader->begin) / (end - begin);
        for (size_t i = 0; i < shape->n_inputs; ++i) {
            const bool of_angle = shape->cosine[i] || (i > 0 && shape->cosine[i - 1]);
            inputs[i] += of_angle ? 0 : part * (now[i] - before[i]);
        }
    }
}

void slide_history_sample(SlideReader *reader, double begin, double end, double *inputs) {
    const SlideHistoryShape *shape = reader->shape;
    if (!shape->first_order) {
        sample_held(reader, begin, end, inputs);
        return;
    }
    seek(reader, end);
    slide_history_between(shape, inputs_before(reader),
                          step_at(shape, reader->history, reader->at) + 1, part_left(reader, end),
                          inputs);
}

/* Are the inputs of a step others than those of the step before? */
static bool changed(const SlideHistoryShape *shape, const SlideHistory *history, uint64_t step) {
    return memcmp(step_at(shape, history, step) + 1, step_at(shape, history, step - 1) + 1,
                  shape->n_inputs * sizeof(double)) != 0;
}

double slide_history_since_mixed(const SlideHistoryShape *shape, const SlideHistory *history,
                                 double sample_step, double n_samples) {
    double time = 0, samples = 0;
    const double slack = shape->slack / sample_step;
    for (uint64_t step = *history->count; step-- > oldest_of(shape, *history->count) + 1;) {
        time += step_at(shape, history, step)[0];
        samples = time / sample_step;
        if (samples >= n_samples) {
            break;
        }
        if (changed(shape, history, step) && fabs(samples - nearbyint(samples)) > slack) {
            return samples;
        }
    }
    return INFINITY;
}
