#include "state.h"

#include <math.h>
#include <string.h>

static void place_before(SlideBeforeStep *before, const SlideModel *model, SlideArena *arena) {
    size_t row = model->n_inputs * sizeof(double);
    before->given = slide_place(arena, 1, row);
    before->rates = slide_place(arena, 1, row);
    before->samples = slide_place(arena, SLIDE_BEFORE, row);
    before->told = slide_place(arena, model->n_inputs, sizeof *before->told);
    if (slide_is_recurrent(model->predictor.family)) {
        model->predictor.family->place_before(&before->predictor, &model->predictor, arena);
    }
}

void slide_state_place(SlideState *state, const SlideModel *model, SlideArena *arena) {
    size_t n_inputs = model->n_inputs, n_outputs = model->n_outputs, start, seen;
    state->head = slide_place(arena, 1, sizeof *state->head);
    start = arena->used - sizeof *state->head;
    state->inputs = slide_place(arena, n_inputs, sizeof(double));
    state->rates = slide_place(arena, n_inputs, sizeof(double));
    state->initial = slide_place(arena, n_inputs, sizeof(double));
    state->outputs = slide_place(arena, n_outputs, sizeof(double));
    state->parameters = slide_place(arena, model->parameters.count, sizeof(double));
    state->acting = slide_place(arena, model->parameters.count, sizeof(double));
    state->since = slide_place(arena, model->parameters.count > 0, sizeof(double));
    state->tolerances = slide_place(arena, model->bound.n_outputs, sizeof(double));
    state->strayed = slide_place(arena, 1, sizeof *state->strayed);
    seen = arena->used - sizeof *state->strayed;
    state->restarts = slide_place(arena, 1, sizeof *state->restarts);
    slide_samples_place(&state->samples, &model->samples, arena);
    model->predictor.family->place_state(&state->predictor, &model->predictor, arena);
    slide_estimate_place(&state->estimate, &model->estimator, arena);
    slide_bound_place_state(&state->bound, &model->bound, arena);
    state->seen_size = arena->used - seen;
    place_before(&state->before, model, arena);
    state->told = slide_place(arena, n_inputs, sizeof *state->told);
    state->goal = slide_place(arena, n_inputs, sizeof(double));
    slide_history_place(&state->history, &model->history, arena);
    state->before_steps = arena->used - start - slide_history_steps_size(&model->history);
    state->window = slide_place(arena, model->memory_length, n_inputs * sizeof(double));
    state->aside = slide_place(arena, state->seen_size, 1);
    state->size = arena->used - start;
    state->backup = slide_place(arena, state->before_steps + state->seen_size, 1);
}

void slide_state_reset(const SlideModel *model, SlideState *state) {
    memset(state->head, 0, state->size);
    state->head->at_step_end = model->at_step_end;
    state->head->confidence = SLIDE_USUAL_CONFIDENCE;
    memcpy(state->inputs, model->starts, model->n_inputs * sizeof(double));
    memcpy(state->initial, model->starts, model->n_inputs * sizeof(double));
    for (size_t i = 0; i < model->parameters.count; ++i) {
        state->parameters[i] = state->acting[i] = model->parameters.start[i];
        *state->since = INFINITY; /* as if they had been so for ever */
    }
    for (size_t i = 0; i < model->bound.n_outputs; ++i) {
        state->tolerances[i] = model->bound.tolerances[i] * model->output_scaling[i].scale;
    }
    for (size_t sample = 0; sample < model->memory_length; ++sample) {
        memcpy(state->window + sample * model->n_inputs, model->starts,
               model->n_inputs * sizeof(double));
    }
}

/* The steps of a block's history that results depend on: those of the samples, and the last step,
 * since derivatives do that again. A forecast looks back as many steps as it likes, however long. */
static SlideHistorySpan needed(const SlideModel *model, const SlideState *state,
                               const unsigned char *block) {
    SlideHead head;
    uint64_t counts[3];
    memcpy(&head, block, sizeof head);
    memcpy(counts, block + ((const char *)state->history.count - (const char *)state->head),
           sizeof counts);
    if (model->history.first_order && head.at_step_end == 0) {
        const uint64_t known = counts[1] < counts[2] ? counts[2] : counts[1];
        return slide_history_all(&model->history, counts[0] < known ? known : counts[0]);
    }
    return slide_history_since(&model->history, counts[0], block + state->before_steps,
                               head.last_length + (model->memory_length + 1) * model->step);
}

void slide_state_copy(const SlideModel *model, const SlideState *state, const void *from,
                      void *to) {
    const size_t steps = state->before_steps;
    const size_t after = steps + slide_history_steps_size(&model->history);
    const unsigned char *block = from;
    unsigned char *target = to;
    memcpy(target, block, steps);
    slide_history_copy(&model->history, needed(model, state, block), block + steps,
                       target + steps);
    memcpy(target + after, block + after, state->size - after);
}

const double *slide_stream_prehistory(const SlideModel *model, const SlideState *state) {
    if (state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN) {
        return state->window + (size_t)(model->memory_length - 1) * model->n_inputs;
    }
    return state->head->prehistory == SLIDE_FIRST_HELD ? state->inputs : state->initial;
}

const double *slide_stream_reached(const SlideModel *model, const SlideState *state) {
    return slide_stream_fresh(state) ? slide_stream_prehistory(model, state)
                                     : slide_history_newest(&model->history, &state->history);
}
