#include "state.h"

#include <math.h>
#include <string.h>

static void place_before(SlideBeforeStep *before, const SlideModel *model, SlideArena *arena) {
    size_t row = model->n_inputs * sizeof(double);
    before->given = slide_place(arena, 1, row);
    before->moved = slide_place(arena, model->n_inputs, 1);
    slide_forecast_place_state(&before->forecast[0], &model->forecast, model->n_inputs, arena);
    slide_forecast_place_state(&before->forecast[1], &model->forecast, model->n_inputs, arena);
    before->rates = slide_place(arena, 1, row);
    before->told = slide_place(arena, model->n_inputs, sizeof *before->told);
    if (slide_is_recurrent(model->predictor.family)) {
        model->predictor.family->place_before(&before->predictor[0], &model->predictor, arena);
        model->predictor.family->place_before(&before->predictor[1], &model->predictor, arena);
    }
}

static void place_ahead(SlideAhead *ahead, const SlideModel *model, SlideArena *arena) {
    slide_estimate_place(&ahead->estimate, &model->estimator, arena);
    slide_bound_place_state(&ahead->bound, &model->bound, arena);
    ahead->forecast = slide_place(arena, model->n_outputs, sizeof *ahead->forecast);
}

void slide_state_place(SlideState *state, const SlideModel *model, SlideArena *arena) {
    size_t n_inputs = model->n_inputs, n_outputs = model->n_outputs, start;
    state->head = slide_place(arena, 1, sizeof *state->head);
    start = arena->used - sizeof *state->head;
    state->inputs = slide_place(arena, n_inputs, sizeof(double));
    state->rates = slide_place(arena, n_inputs, sizeof(double));
    state->told = slide_place(arena, n_inputs, sizeof *state->told);
    state->initial = slide_place(arena, n_inputs, sizeof(double));
    state->outputs = slide_place(arena, n_outputs, sizeof(double));
    state->parameters = slide_place(arena, model->parameters.count, sizeof(double));
    state->acting = slide_place(arena, model->parameters.count, sizeof(double));
    state->tolerances = slide_place(arena, model->bound.n_outputs, sizeof(double));
    place_before(&state->before, model, arena);
    slide_forecast_place_state(&state->forecast, &model->forecast, model->n_inputs, arena);
    place_ahead(&state->ahead, model, arena);
    state->window = slide_place(arena, model->memory_length, n_inputs * sizeof(double));
    for (size_t phase = 0; phase <= model->n_phases; ++phase) {
        slide_seen_place(&state->seen[phase], model, arena);
    }
    slide_history_place(&state->history, &model->history, arena);
    state->size = arena->used - start;
    state->before_steps = state->size - slide_history_steps_size(&model->history);
}

void slide_state_reset(const SlideModel *model, SlideState *state) {
    memset(state->head, 0, state->size);
    state->head->known = model->at_step_end;
    state->head->confidence = SLIDE_USUAL_CONFIDENCE;
    state->head->credit = SLIDE_MOST_CREDIT;
    state->head->doubt = -INFINITY;
    state->head->outside = -INFINITY;
    memcpy(state->inputs, model->starts, model->n_inputs * sizeof(double));
    memcpy(state->initial, model->starts, model->n_inputs * sizeof(double));
    for (size_t i = 0; i < model->parameters.count; ++i) {
        state->parameters[i] = state->acting[i] = model->parameters.start[i];
    }
    for (size_t i = 0; i < model->bound.n_outputs; ++i) {
        state->tolerances[i] = model->bound.tolerances[i] * model->output_scaling[i].scale;
    }
    for (size_t sample = 0; sample < model->memory_length; ++sample) {
        memcpy(state->window + sample * model->n_inputs, model->starts,
               model->n_inputs * sizeof(double));
    }
}

/* Where a part of the state lies in its block. */
static size_t place_in(const SlideState *state, const void *part) {
    return (size_t)((const unsigned char *)part - (const unsigned char *)state->head);
}

/* What was seen, but of an empty one its head only. */
static void copy_seen(const SlideState *state, const SlideSeen *seen, size_t size,
                      const unsigned char *from, unsigned char *to) {
    const size_t place = place_in(state, seen->head);
    SlideSeenHead head;
    memcpy(&head, from + place, sizeof head);
    memcpy(to + place, from + place, head.used > 0 ? size : sizeof head);
}

void slide_state_copy(const SlideModel *model, const SlideState *state, const void *from,
                      void *to) {
    const unsigned char *block = from;
    unsigned char *target = to;
    const size_t steps = state->before_steps, size = slide_seen_size(model);
    const size_t first = place_in(state, state->seen[0].head);
    const size_t history = place_in(state, state->history.count);
    uint64_t count;
    memcpy(&count, block + history, sizeof count);
    memcpy(target, block, first);
    for (size_t phase = 0; phase <= model->n_phases; ++phase) {
        copy_seen(state, &state->seen[phase], size, block, target);
    }
    memcpy(target + history, block + history, steps - history);
    slide_history_copy(&model->history, slide_history_needed(&model->history, count, block + steps),
                       block + steps, target + steps);
}

/* Steps and samples in a state are far below this. */
static const uint64_t LARGEST_COUNT = (uint64_t)1 << 62;

static uint64_t counter_in(const SlideState *state, const unsigned char *block, const void *part) {
    uint64_t count;
    memcpy(&count, block + place_in(state, part), sizeof count);
    return count;
}

static bool is_seen_sound(const SlideModel *model, const SlideState *state, const SlideSeen *seen,
                          const unsigned char *block) {
    SlideSeenHead head;
    memcpy(&head, block + place_in(state, seen->head), sizeof head);
    const uint64_t count = counter_in(state, block, seen->samples.count);
    return head.used == 0 ||
           (head.n_open <= model->most_open && head.used < LARGEST_COUNT && count < LARGEST_COUNT &&
            count + 1 + model->n_unsettled >= model->samples.capacity);
}

bool slide_state_is_sound(const SlideModel *model, const SlideState *state, const void *block) {
    SlideHead head;
    memcpy(&head, block, sizeof head);
    const uint64_t n_steps = counter_in(state, block, state->history.count);
    bool sound = isfinite(slide_clock_time(&head.clock)) &&
                 isfinite(slide_clock_time(&head.inner)) && isfinite(head.last_length) &&
                 isfinite(head.credit) &&
                 head.now <= model->n_phases && head.before <= 1 && head.forecast <= 1 &&
                 head.n_since <= 2 * (uint64_t)model->most_open && head.n_looked <= model->n_redone &&
                 n_steps < LARGEST_COUNT &&
                 (n_steps > 0) == (head.n_steps > 0) &&
                 counter_in(state, block, state->forecast.scored) < LARGEST_COUNT;
    for (size_t phase = 0; sound && phase <= model->n_phases; ++phase) {
        sound = is_seen_sound(model, state, &state->seen[phase], block);
    }
    return sound;
}

const double *slide_stream_prehistory(const SlideModel *model, const SlideState *state) {
    if (state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN) {
        return state->window + (size_t)(model->memory_length - 1) * model->n_inputs;
    }
    return state->head->prehistory == SLIDE_FIRST_HELD ? state->inputs : state->initial;
}

const double *slide_stream_reached(const SlideModel *model, const SlideState *state) {
    return slide_stream_fresh(state) ? slide_stream_prehistory(model, state) : state->history.end;
}
