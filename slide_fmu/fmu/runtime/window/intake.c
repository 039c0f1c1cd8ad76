#include "intake.h"

#include "aside.h"

#include "moving.h"

#include <math.h>
#include <string.h>

void slide_intake_recall(const SlideModel *model, SlideState *state) {
    const bool window = state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN;
    const size_t n_inputs = model->n_inputs, count = window ? model->memory_length : 1;
    const double *rows = window ? state->window : slide_stream_prehistory(model, state);
    for (size_t sample = 0; sample < count; ++sample) {
        slide_history_append(&model->history, &state->history, model->step,
                             rows + sample * n_inputs, true);
    }
}

/* The step under inputs whose derivatives are known. */
static SlideMovingStep moving_step(const SlideModel *model, const SlideState *state) {
    return (SlideMovingStep){state->head->last_length, state->inputs, state->before.rates,
                             model->step, model->memory_length + 1};
}

/* The step becomes the newest of the history. Beyond the samples that any result depends on, one
 * part of a step whose inputs move stands for all. */
static void append(const SlideModel *model, SlideState *state) {
    const double length = state->head->last_length;
    if (state->head->moved != 0) {
        const SlideMovingStep step = moving_step(model, state);
        slide_append_moving(&model->history, &state->history, &step, model->inputs);
    } else {
        slide_history_append(&model->history, &state->history, length, state->inputs, false);
    }
}

void slide_intake_sample(const SlideModel *model, const SlideState *state, uint32_t count,
                         const double *from) {
    const double *to = slide_history_newest(&model->history, &state->history);
    SlideReader reader = slide_history_reader(&model->history, &state->history);
    for (uint32_t left = count; left-- > 0;) {
        if (from != NULL) {
            slide_history_between(&model->history, from, to, (double)left / count, model->inputs);
        } else {
            double begin = -((double)left + 1) * model->step, end = -(double)left * model->step;
            slide_history_sample(&reader, begin, end, model->inputs);
        }
        slide_intake_scale(model, model->inputs, model->taken + left * model->n_inputs);
    }
}

uint32_t slide_intake_whole(const SlideModel *model, double length) {
    double count = nearbyint(length / model->step);
    bool whole = length == count * model->step && count > 0 && count <= model->n_in;
    return whole ? (uint32_t)count : 0;
}

SlideIntake slide_intake_step(const SlideModel *model, SlideState *state) {
    const bool first = slide_stream_fresh(state);
    const bool settled = first && state->head->prehistory == SLIDE_FIRST_HELD;
    const bool held = settled && !state->head->moved; /* slide_stream_hold took in one sample */
    const uint32_t n_whole = slide_intake_whole(model, state->head->last_length);
    const double *from = slide_stream_reached(model, state);
    const uint32_t n_resumed = slide_aside_resumed(model, state);
    SlideIntake intake = {n_whole, n_whole == 0 && n_resumed == 0 && !held, settled, 0};
    if (n_resumed > 0) {
        intake.count = n_resumed;
    } else if (intake.anew) {
        intake.count = model->memory_length;
    } else if (held && n_whole > 0) {
        intake.count = n_whole - 1;
    }
    if (first && !held) {
        slide_intake_recall(model, state);
    }
    append(model, state); /* a step of whole samples is joined to none under a first-order hold */
    slide_intake_sample(model, state, intake.count,
                        model->history.first_order && n_whole > 0 ? from : NULL);
    return intake;
}

/* A step on whose way the inputs move evenly becomes the newest of the history. */
static SlideIntake move_to(const SlideModel *model, SlideState *state, double length,
                           const double *inputs) {
    const double *from = slide_stream_reached(model, state);
    SlideIntake intake = {.count = slide_intake_whole(model, length)};
    intake.anew = intake.count == 0;
    intake.count = intake.anew ? model->memory_length : intake.count;
    slide_history_append(&model->history, &state->history, length, inputs, false);
    slide_intake_sample(model, state, intake.count, intake.anew ? NULL : from);
    return intake;
}

SlideIntake slide_intake_end(const SlideModel *model, SlideState *state) {
    const bool first = slide_stream_fresh(state);
    if (first) {
        slide_intake_recall(model, state);
    }
    if (first && state->head->prehistory == SLIDE_FIRST_HELD) {
        return (SlideIntake){.settled = true};
    }
    return move_to(model, state, state->head->reached_length, state->inputs);
}

/* Where the importer told derivatives, inputs move by these. */
static void move_told(const SlideModel *model, SlideState *state) {
    const SlideMovingStep step = moving_step(model, state);
    const bool *told = state->before.told;
    slide_move_on(&model->history, &step, step.length, model->inputs);
    for (size_t i = 0; i < model->n_inputs; ++i) {
        const bool of_angle = (model->cosine[i] && told[i + 1]) ||
                              (i > 0 && model->cosine[i - 1] && told[i - 1]);
        if (told[i] || of_angle) {
            state->goal[i] = model->inputs[i];
        }
    }
}

SlideIntake slide_intake_forecast(const SlideModel *model, SlideState *state) {
    const double length = state->head->last_length;
    slide_history_begin(&model->history, &state->history, SLIDE_MARK_FORECAST, true);
    slide_forecast(&model->forecast, &model->history, &state->history, length, state->goal);
    if (state->head->moved != 0) {
        move_told(model, state);
    }
    return move_to(model, state, length, state->goal);
}

/* Both, one after the other. */
static SlideIntake take_in_both(const SlideModel *model, SlideState *state) {
    const size_t n_inputs = model->n_inputs;
    const SlideIntake end = slide_intake_end(model, state);
    if (state->head->last_length == 0) { /* there was no step yet */
        return end;
    }
    const uint32_t n_whole = slide_intake_whole(model, state->head->last_length);
    memmove(model->taken + n_whole * n_inputs, model->taken,
            end.count * n_inputs * sizeof(double));
    SlideIntake intake = slide_intake_forecast(model, state);
    if (!intake.anew) {
        intake = (SlideIntake){end.count + n_whole, end.anew, end.settled, n_whole};
    }
    return intake;
}

SlideIntake slide_stream_take_in(const SlideModel *model, SlideState *state) {
    return slide_stream_forecasts(model, state) ? take_in_both(model, state)
                                                : slide_intake_step(model, state);
}
