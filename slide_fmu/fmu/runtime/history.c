#include "history.h"

#include <string.h>

enum { STEPS_PER_SAMPLE = 32 };
static const double SLACK = 1e-6; /* in sample steps */

SlideHistoryShape slide_history_shape(uint32_t n_inputs, uint32_t n_samples, double sample_step,
                                      bool ramp) {
    uint64_t capacity = STEPS_PER_SAMPLE * ((uint64_t)n_samples + 1);
    return (SlideHistoryShape){n_inputs, capacity, sample_step / STEPS_PER_SAMPLE,
                               SLACK * sample_step, ramp};
}

void slide_history_place(SlideHistory *history, const SlideHistoryShape *shape,
                         SlideArena *arena) {
    history->count = slide_place(arena, 1, sizeof *history->count);
    history->steps =
        slide_place(arena, (size_t)shape->capacity, (1 + (size_t)shape->n_inputs) * sizeof(double));
}

static double *step_at(const SlideHistoryShape *shape, const SlideHistory *history,
                       uint64_t index) {
    return history->steps + (index % shape->capacity) * (1 + (size_t)shape->n_inputs);
}

/* May a step be joined to the one before it? Held inputs that stay lose nothing by it. */
static bool joins(const SlideHistoryShape *shape, const double *before, const double *inputs) {
    bool same = memcmp(before + 1, inputs, shape->n_inputs * sizeof *inputs) == 0;
    return before[0] < shape->shortest || (same && !shape->ramp);
}

void slide_history_append(const SlideHistoryShape *shape, SlideHistory *history, double length,
                          const double *inputs) {
    uint64_t count = *history->count;
    if (count > 1 && joins(shape, step_at(shape, history, count - 1), inputs)) {
        count -= 1;
        length += step_at(shape, history, count)[0];
    }
    double *step = step_at(shape, history, count);
    step[0] = length;
    memcpy(step + 1, inputs, shape->n_inputs * sizeof *inputs);
    *history->count = count + 1;
}

const double *slide_history_newest(const SlideHistoryShape *shape, const SlideHistory *history) {
    return step_at(shape, history, *history->count - 1) + 1;
}

static uint64_t oldest(const SlideReader *reader) {
    uint64_t count = *reader->history->count, capacity = reader->shape->capacity;
    return count > capacity ? count - capacity : 0;
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

void slide_history_sample(SlideReader *reader, double begin, double end, double *inputs) {
    const SlideHistoryShape *shape = reader->shape;
    seek(reader, shape->ramp ? end : begin + shape->slack);
    const double *step = step_at(shape, reader->history, reader->at);
    const double *before = reader->at > oldest(reader)
                               ? step_at(shape, reader->history, reader->at - 1)
                               : step;
    double left = 0; /* part of the way to the step's inputs that is not done yet */
    if (shape->ramp) {
        left = 1 - within((end - reader->begin) / step[0], 0, 1);
    }
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        inputs[i] = step[1 + i] - left * (step[1 + i] - before[1 + i]);
    }
}
