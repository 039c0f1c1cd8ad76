#include "state.h"

#include <math.h>
#include <string.h>

/* What most steps change, but for large parts. */
static void place_front(SlideState *state, const SlideModel *model, SlideArena *arena) {
    const size_t n_inputs = model->n_inputs, n_outputs = model->n_outputs;
    SlideBeforeStep *before = &state->before;
    state->head = slide_place(arena, 1, sizeof *state->head);
    const size_t start = arena->used - sizeof *state->head;
    SlidePhaseHead *heads = slide_place(arena, model->n_phases + 1, sizeof *heads);
    for (size_t place = 0; place <= model->n_phases; ++place) {
        state->phases[place].head = heads == NULL ? NULL : heads + place;
    }
    state->rates = slide_place(arena, n_inputs, sizeof(double));
    state->told = slide_place(arena, n_inputs, sizeof *state->told);
    state->acting = slide_place(arena, model->parameters.count, sizeof(double));
    before->given = slide_place(arena, n_inputs, sizeof(double));
    before->moved = slide_place(arena, n_inputs, 1);
    before->rates = slide_place(arena, n_inputs, sizeof(double));
    before->told = slide_place(arena, n_inputs, sizeof *before->told);
    state->ahead.forecast = slide_place(arena, n_outputs, sizeof(double));
    slide_history_place_end(&state->history, &model->history, arena);
    state->front = arena->used - start;
}

static void place_before(SlideBeforeStep *before, const SlideModel *model, SlideArena *arena) {
    slide_forecast_place_state(&before->forecast[0], &model->forecast, model->n_inputs, arena);
    slide_forecast_place_state(&before->forecast[1], &model->forecast, model->n_inputs, arena);
    if (slide_is_recurrent(model->predictor.family)) {
        model->predictor.family->place_before(&before->predictor[0], &model->predictor, arena);
        model->predictor.family->place_before(&before->predictor[1], &model->predictor, arena);
    }
}

static void place_undo(SlideState *state, const SlideModel *model, SlideArena *arena) {
    const size_t row = model->n_inputs * sizeof(double);
    SlideUndo *undo = &state->undo;
    undo->front = slide_place(arena, state->front, 1);
    slide_history_place_undo(&undo->history, model->n_inputs, arena);
    undo->revised = slide_place(arena, model->n_outputs, sizeof(double));
    undo->kept = slide_place(arena, model->n_kept, sizeof(double));
    undo->open = slide_place(arena, model->most_open, row);
    undo->others = slide_place(arena, model->others.capacity > 0 ? model->most_open : 0, row);
}

void slide_state_place(SlideState *state, const SlideModel *model, SlideArena *arena) {
    const size_t n_inputs = model->n_inputs, n_outputs = model->n_outputs;
    place_front(state, model, arena);
    const size_t start = arena->used - state->front;
    state->inputs = slide_place(arena, n_inputs, sizeof(double));
    state->initial = slide_place(arena, n_inputs, sizeof(double));
    state->outputs = slide_place(arena, n_outputs, sizeof(double));
    state->parameters = slide_place(arena, model->parameters.count, sizeof(double));
    state->tolerances = slide_place(arena, model->bound.n_outputs, sizeof(double));
    place_before(&state->before, model, arena);
    slide_forecast_place_state(&state->forecast, &model->forecast, model->n_inputs, arena);
    slide_estimate_place(&state->ahead.estimate, &model->estimator, arena);
    slide_bound_place_state(&state->ahead.bound, &model->bound, arena);
    state->window = slide_place(arena, model->memory_length, n_inputs * sizeof(double));
    state->window_outputs = slide_place(arena, slide_shows_state(model) ? model->memory_length : 0,
                                        n_outputs * sizeof(double));
    for (size_t place = 0; place <= model->n_phases; ++place) {
        slide_phase_place(&state->phases[place], model, arena);
    }
    slide_history_place(&state->history, &model->history, arena);
    state->size = arena->used - start;
    state->before_steps = state->size - slide_history_steps_size(&model->history);
    place_undo(state, model, arena);
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
    const size_t n_known = slide_shows_state(model) ? model->memory_length * model->n_outputs : 0;
    for (size_t i = 0; i < n_known; ++i) {
        state->window_outputs[i] = NAN;
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

/* A head in a copy of a block, at any alignment. */
static SlidePhaseHead head_in(const SlideState *state, const SlidePhase *phase,
                             const unsigned char *block) {
    SlidePhaseHead head;
    memcpy(&head, block + place_in(state, phase->head), sizeof head);
    return head;
}

void slide_state_copy(const SlideModel *model, const SlideState *state, const void *from,
                      void *to) {
    const unsigned char *block = from;
    unsigned char *target = to;
    const size_t steps = state->before_steps;
    const size_t first = place_in(state, state->phases[0].samples.count);
    const size_t moved = place_in(state, state->history.moved);
    uint64_t count;
    memcpy(&count, block + place_in(state, state->history.count), sizeof count);
    memcpy(target, block, first);
    for (size_t place = 0; place <= model->n_phases; ++place) {
        const SlidePhase *phase = &state->phases[place];
        const size_t begin = place_in(state, phase->samples.count);
        if (head_in(state, phase, block).used > 0) {
            memcpy(target + begin, block + begin, slide_phase_size(model));
        }
    }
    memcpy(target + moved, block + moved, steps - moved);
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

static bool is_phase_sound(const SlideModel *model, const SlideState *state, const SlidePhase *phase,
                          const unsigned char *block) {
    const SlidePhaseHead head = head_in(state, phase, block);
    const uint64_t count = counter_in(state, block, phase->samples.count);
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
    for (size_t place = 0; sound && place <= model->n_phases; ++place) {
        sound = is_phase_sound(model, state, &state->phases[place], block);
    }
    return sound;
}

/* Samples from the first one on of which an output is known; 0: none is. */
static uint64_t n_with_outputs(const SlideModel *model, const SlideState *state) {
    const size_t count = model->memory_length * model->n_outputs;
    size_t first = 0;
    while (first < count && isnan(state->window_outputs[first])) {
        ++first;
    }
    return model->memory_length - first / model->n_outputs;
}

bool slide_stream_lacks_outputs(const SlideModel *model, const SlideState *state) {
    return state->head->prehistory == SLIDE_OUTPUTS_KNOWN && n_with_outputs(model, state) == 0;
}

/* Where outputs are known, not more samples than the state is kept for, and at least those that following
 * ones change. */
uint64_t slide_stream_n_before(const SlideModel *model, const SlideState *state) {
    if (state->head->prehistory != SLIDE_OUTPUTS_KNOWN) {
        return slide_window_is_known(state) ? model->memory_length : 1;
    }
    const uint64_t known = n_with_outputs(model, state), most = model->predictor.n_samples;
    const uint64_t count = known < most ? known : most;
    const uint64_t least =
        SLIDE_UNSETTLED < model->memory_length ? SLIDE_UNSETTLED : model->memory_length;
    return count > least ? count : least;
}

const double *slide_stream_prehistory(const SlideModel *model, const SlideState *state) {
    if (slide_window_is_known(state)) {
        return state->window + (size_t)(model->memory_length - 1) * model->n_inputs;
    }
    return state->head->prehistory == SLIDE_FIRST_HELD ? state->inputs : state->initial;
}

const double *slide_stream_reached(const SlideModel *model, const SlideState *state) {
    return slide_stream_fresh(state) ? slide_stream_prehistory(model, state) : state->history.end;
}
