#include "stream.h"

#include "interpolation.h"
#include "forecast_miss.h"
#include "phases.h"
#include "ranges.h"
#include "sampling.h"

#include "moving.h"

#include <math.h>
#include <string.h>

/* A step counts as longer than a sample by more than this part of it: 0.01667 s may be meant for 1/60 s. */
static const double LONGER = 5e-3;

/* Lengths that differ by this part of them are the same. */
static const double ROUNDING = 1e-6;

/* The results of what networks have seen, in physical units. */
static void give(const SlideModel *model, SlideState *state) {
    const SlidePhase *phase = slide_now(state);
    for (size_t i = 0; i < model->n_outputs; ++i) {
        const SlideScaling *scaling = &model->output_scaling[i];
        state->outputs[i] = phase->given[i] * scaling->scale + scaling->offset;
    }
    state->head->current = 1;
}

/* The parameters that are set are those behind the outputs. */
static void accept_parameters(const SlideModel *model, SlideState *state) {
    const size_t row = model->parameters.count * sizeof(double);
    slide_model_form(model, state->parameters);
    if (row == 0 || memcmp(state->acting, state->parameters, row) == 0) {
        return;
    }
    memcpy(state->acting, state->parameters, row);
    for (size_t place = 0; place <= model->n_phases; ++place) {
        state->phases[place].head->since = 0;
    }
    slide_start(model, state)->head->used = 0; /* it knows former ones only */
}

/* The network has the state that outputs show before the oldest of so many samples, and a state that
 * starts from zero before the newest of them, of which following ones change so many. */
static bool find_state(const SlideModel *model, const SlideState *state, SlidePhase *start,
                       uint64_t count, uint64_t n_changed) {
    const size_t n_inputs = model->n_inputs, n_outputs = model->n_outputs;
    const double *outputs =
        state->window_outputs + (size_t)(model->memory_length - count) * n_outputs;
    double *oldest = model->taken + (size_t)(count - 1) * n_inputs;
    for (size_t i = 1; i <= SLIDE_BEFORE; ++i) { /* counts for all before */
        memcpy(oldest + i * n_inputs, oldest, n_inputs * sizeof *oldest);
    }
    for (size_t i = 0; i < (size_t)count * n_outputs; ++i) {
        const SlideScaling *scaling = &model->output_scaling[i % n_outputs];
        model->known_values[i] = (outputs[i] - scaling->offset) * scaling->factor;
    }
    const SlideKnownOutputs known = {model->taken, model->known_values, count};
    return slide_first_state_find(&model->predictor, &model->first, &known,
                                  count - (n_changed > 0 ? n_changed : 1), &start->predictor);
}

/* What was before the first step, and the sample that the inputs that were set are: an open one, where
 * it is not known when the next comes. */
static bool see_start(const SlideModel *model, SlideState *state) {
    SlidePhase *start = slide_start(model, state);
    const double prehistory = state->head->prehistory;
    const bool forecasts = slide_stream_forecasts(model, state);
    const bool first_is_held = prehistory == SLIDE_FIRST_HELD && !forecasts;
    const bool reaches = prehistory != SLIDE_FIRST_HELD && forecasts;
    const uint64_t n_changed = model->n_unsettled > 0 ? SLIDE_SPREAD : 0; /* by the first steps */
    SlideSample rest = {model->taken, model->taken, false};
    uint64_t n_open = n_changed;
    bool done = true;
    slide_phase_clear(model, start, NULL); /* a run before this one may have left something */
    if (slide_window_is_known(state)) {
        const uint64_t count = slide_stream_n_before(model, state);
        slide_sampling_recall(model, state);
        slide_sample(model, state, count, 0);
        *state->history.count = 0;
        slide_phase_restart(model, start, slide_sample_taken(model, count - 1));
        done = prehistory != SLIDE_OUTPUTS_KNOWN ||
               find_state(model, state, start, count, n_changed);
        for (uint64_t left = count; done && left-- > 0;) {
            if (left + 1 == n_changed) {
                slide_phase_open(model, start);
            }
            done = slide_phase_take(model, start, slide_sample_taken(model, left), left == 0);
        }
    } else {
        slide_sampling_scale(model, slide_stream_prehistory(model, state), model->taken);
        rest.strays = !slide_in_range(model->taken, model->n_inputs, model->cosine);
        slide_phase_restart(model, start, rest);
        done = slide_phase_settle(model, start, rest, n_changed + (first_is_held ? 1 : 0));
        slide_phase_number_back(model, start, n_changed + (first_is_held ? 1 : 0));
        for (uint64_t left = n_changed; done && left-- > 0;) {
            if (left + 1 == n_changed) {
                slide_phase_open(model, start);
            }
            done = slide_phase_take(model, start, rest, left == 0);
        }
    }
    if (done && (first_is_held || reaches)) {
        slide_sampling_scale(model, state->inputs, model->taken);
        rest.strays = !slide_in_range(model->taken, model->n_inputs, model->cosine);
        if (n_open == 0) {
            slide_phase_open(model, start);
        }
        done = slide_phase_take(model, start, rest, true);
        n_open += 1;
    }
    if (prehistory == SLIDE_OUTPUTS_KNOWN && n_open > 0) { /* derivatives go on from there */
        model->predictor.family->keep(&model->predictor, &start->known,
                                      &state->before.predictor[state->head->before]);
    }
    start->head->n_open = n_open;
    start->head->used = done;
    start->head->end = first_is_held ? model->step : 0;
    return done;
}

bool slide_stream_hold(const SlideModel *model, SlideState *state) {
    accept_parameters(model, state);
    if (!see_start(model, state)) {
        return false;
    }
    slide_start(model, state)->head->since = INFINITY;
    state->head->now = model->n_phases;
    state->head->concluded = state->head->estimated = 0;
    give(model, state);
    return true;
}

/* Inputs whose derivatives the importer told move by these: where they get to. */
static void move_told(const SlideModel *model, SlideState *state) {
    const SlideMovingStep step = {state->before.given, state->before.rates,
                                  state->head->last_length};
    const bool *told = state->before.told;
    slide_move_on(&model->history, &step, model->inputs);
    for (size_t i = 0; i < model->n_inputs; ++i) {
        const bool of_angle = (model->cosine[i] && told[i + 1]) ||
                              (i > 0 && model->cosine[i - 1] && told[i - 1]);
        if (told[i] || of_angle) {
            state->history.end[i] = model->inputs[i];
            slide_history_moved(&model->history, &state->history, 0)[i] = SLIDE_TOLD;
        }
    }
}

/* Did a held input rest in the step before the newest one? */
static bool rested(const SlideModel *model, const SlideState *state, size_t input) {
    return !model->history.first_order &&
           slide_history_before(&model->history, &state->history)[1 + input] ==
               slide_history_newest(&model->history, &state->history)[1 + input];
}

/* Which inputs move smoothly in the newest step, as far as can be told, and did in the one before it,
 * now that its end is known: those that a forecast serves better than holding them. One that rested there
 * has not begun to: this may be a long rest. An angle of held inputs is held, unless its derivative is
 * told. */
static void tell_moving(const SlideModel *model, SlideState *state) {
    unsigned char *moved = slide_history_moved(&model->history, &state->history, 0);
    unsigned char *before = slide_history_moved(&model->history, &state->history, 1);
    const bool known = state->head->known != 0;
    for (size_t i = 0; i < model->n_inputs; ++i) {
        const bool may = model->history.first_order || (!known && !model->cosine[i]);
        moved[i] = may && state->forecast.moves[i]
                       ? SLIDE_MOVED
                       : SLIDE_HELD;
        if (before[i] != SLIDE_TOLD && (before[i] != SLIDE_HELD || !rested(model, state, i))) {
            before[i] = moved[i];
        }
        i += model->cosine[i];
    }
}

/* Do inputs do what samples do not show? Those that move in the training may jump; of held ones it may be
 * unclear whether they are smooth, or they may be samples of a fast or noisy signal; and in a step longer than
 * a sample they may do anything. */
static void doubt(const SlideModel *model, SlideState *state) {
    const SlideHistoryShape *shape = &model->history;
    const double *step = slide_history_newest(shape, &state->history);
    const double *before = slide_history_before(shape, &state->history);
    const bool ends = shape->first_order && state->head->known != 0;
    const double *from = ends ? step + 1 : before + 1;
    const double *to = ends ? state->history.end : step + 1;
    const double length = ends ? state->head->last_length : state->head->length_before;
    const bool coarse = length > model->step * (1 + LONGER) &&
                        slide_forecast_differ(&model->forecast, shape, from, to);
    const bool held = !shape->first_order, known_held = held && state->head->known != 0;
    const bool hides = held && !known_held &&
                       slide_forecast_hides(&model->forecast, &state->forecast, model->n_inputs);
    const bool unclear = held && !known_held &&
                         slide_forecast_unclear(&model->forecast, &state->forecast, model->n_inputs);
    if (hides || unclear || (coarse && !known_held) ||
        (shape->first_order && model->forecast.n_candidates > 0 &&
         slide_forecast_jumps(&model->forecast, shape, from, to, length))) {
        state->head->doubt = slide_clock_time(&state->head->inner);
    }
}

/* All is known of the newest step. Where steps of one length make up a sample, samples are at their ends,
 * and no curve between these is needed. */
static void know(const SlideModel *model, SlideState *state) {
    const SlideHead *head = state->head;
    const SlideHistoryShape *shape = &model->history;
    const double parts = (double)head->n_phases * head->last_length / model->step;
    const bool sampled = head->length_before == head->last_length && fabs(parts - 1) <= ROUNDING;
    memcpy(state->history.end, state->before.given, model->n_inputs * sizeof(double));
    if (sampled || !shape->first_order) {
        *state->forecast.spacing = 0;
        memset(slide_history_moved(shape, &state->history, 0), SLIDE_HELD, model->n_inputs);
    } else {
        slide_forecast_see(&model->forecast, shape, &state->history, &state->forecast);
        tell_moving(model, state);
    }
    if (head->moved != 0) {
        move_told(model, state);
    }
}

/* What the inputs are by the end of the newest step: where they are held they stay, else they are
 * forecast. */
static void expect(const SlideModel *model, SlideState *state) {
    const SlideHistoryShape *shape = &model->history;
    memcpy(state->history.end, state->before.given, model->n_inputs * sizeof(double));
    slide_forecast_see(&model->forecast, shape, &state->history, &state->forecast);
    tell_moving(model, state);
    const unsigned char *moved = slide_history_moved(shape, &state->history, 0);
    slide_forecast(&model->forecast, shape, &state->forecast, model->inputs);
    for (size_t i = 0; i < model->n_inputs; ++i) {
        const size_t count = 1 + (size_t)model->cosine[i];
        if (moved[i] != SLIDE_HELD) {
            memcpy(state->history.end + i, model->inputs + i, count * sizeof(double));
        }
        i += count - 1;
    }
    if (state->head->moved != 0) {
        move_told(model, state);
    }
}

/* The end of the newest step. */
static void go_to_end(const SlideModel *model, SlideState *state) {
    if (state->head->known != 0) {
        know(model, state);
    } else {
        expect(model, state);
    }
    doubt(model, state);
}

/* The newest step begins with the inputs that are set, or with those reached before. */
static void append(const SlideModel *model, SlideState *state) {
    const SlideHistoryShape *shape = &model->history;
    const bool ends = shape->first_order && !slide_stream_forecasts(model, state);
    if (slide_stream_fresh(state)) {
        slide_sampling_recall(model, state);
        if (slide_stream_forecasts(model, state) &&
            state->head->prehistory != SLIDE_FIRST_HELD) {
            slide_history_append(shape, &state->history, model->step, state->history.end);
        }
    }
    for (size_t i = 0; i < model->n_inputs; ++i) {
        const bool expected = !ends && *state->history.count > 0;
        model->inputs[i] = ends ? state->history.end[i] : state->inputs[i];
        model->missed[i] = expected ? state->history.end[i] - state->inputs[i] : 0;
    }
    slide_history_append(shape, &state->history, state->head->last_length, model->inputs);
}

/* A step begins. The derivatives of the inputs count for this step only. */
static void begin(const SlideModel *model, SlideState *state, double length) {
    SlideHead *head = state->head;
    const size_t row = model->n_inputs * sizeof(double);
    head->length_before = head->last_length;
    if (length != head->last_length) {
        head->n_phases = slide_phases_of(model, length);
    }
    head->last_length = length;
    slide_clock_advance(&head->inner, slide_clock_time(&head->inner), length);
    head->credit = fmin(head->credit + 1.0 / model->predictor.n_samples, SLIDE_MOST_CREDIT);
    head->between = slide_interpolation_serves(model, state);
    memcpy(state->before.given, state->inputs, row);
    head->moved = head->moving;
    if (head->moving) {
        memcpy(state->before.rates, state->rates, row);
        memcpy(state->before.told, state->told, model->n_inputs * sizeof *state->told);
        memset(state->rates, 0, row);
        memset(state->told, 0, model->n_inputs * sizeof *state->told);
        head->moving = 0;
    }
    append(model, state);
    head->forecast = 1 - head->forecast;
    slide_forecast_copy(&state->forecast, &state->before.forecast[head->forecast]);
    memcpy(state->before.moved, slide_history_moved(&model->history, &state->history, 1),
           model->n_inputs);
}

/* What forecasts go by is what it was when the newest step began. */
static void begin_again(const SlideModel *model, SlideState *state) {
    slide_forecast_copy(&state->before.forecast[state->head->forecast], &state->forecast);
    memcpy(slide_history_moved(&model->history, &state->history, 1), state->before.moved,
           model->n_inputs);
}

void slide_stream_set_again(const SlideModel *model, SlideState *state, const double *inputs) {
    const size_t row = model->n_inputs * sizeof(double);
    const bool first = slide_stream_first_held(state);
    const bool ends = model->history.first_order && !slide_stream_forecasts(model, state);
    const double doubt = state->head->doubt;
    memcpy(state->before.given, inputs, row);
    if (first) {
        memcpy(slide_history_before(&model->history, &state->history) + 1, inputs, row);
    }
    if (first || !ends) {
        memcpy(slide_history_newest(&model->history, &state->history) + 1, inputs, row);
    }
    begin_again(model, state);
    go_to_end(model, state);
    state->head->doubt = doubt; /* it is about the inputs that the step had */
}

/* What networks have seen goes on to the present; between phases, outputs come into
 * model->candidate. */
static bool reach(const SlideModel *model, SlideState *state) {
    size_t place = 0;
    bool done =
        state->head->between
            ? slide_interpolation_reach(model, state, &place, model->candidate)
            : slide_phases_reach(model, state, slide_clock_time(&state->head->inner), 0, &place);
    state->head->now = place;
    if (done && !state->head->between && state->head->n_phases > 1) {
        done = slide_forecast_miss_surprise(model, state);
    }
    if (model->n_unsettled > 0) {
        memcpy(state->ahead.forecast, slide_now(state)->revised,
               model->n_outputs * sizeof(double));
    }
    return done;
}

/* A held input that began to change some steps ago turns out to move smoothly, as a ramp after a rest:
 * so it did in those steps. Steps that were joined are fewer than the points that changed: the first
 * longer one may be the rest. */
static void tell_back(const SlideModel *model, SlideState *state, size_t input) {
    const SlideHistoryShape *shape = &model->history;
    const uint64_t n_changes = slide_forecast_n_changes(&state->forecast, input);
    const uint64_t count = *state->history.count;
    bool joined = false;
    for (uint64_t age = 1; age < n_changes && age < SLIDE_TOLD_LATER && age + 1 < count; ++age) {
        const double length = slide_history_length(shape, &state->history, age);
        unsigned char *moved = slide_history_moved(shape, &state->history, age) + input;
        joined = joined || length <= shape->shortest;
        if (joined && length > shape->shortest) {
            break;
        }
        *moved = *moved == SLIDE_HELD ? SLIDE_MOVED : *moved;
    }
    /* the step before them, in which it began to, if it is no rest */
    const double newest = slide_history_length(shape, &state->history, 0);
    if (!joined && n_changes < SLIDE_TOLD_LATER && n_changes + 1 < count &&
        fabs(slide_history_length(shape, &state->history, n_changes) - newest) <= ROUNDING * newest &&
        slide_forecast_begins(&state->forecast, input, n_changes)) {
        unsigned char *moved = slide_history_moved(shape, &state->history, n_changes) + input;
        *moved = *moved == SLIDE_HELD ? SLIDE_MOVED : *moved;
    }
}

/* Phases look at such steps again, as far as their samples are open. */
static void tell_later(const SlideModel *model, SlideState *state) {
    const unsigned char *moved = slide_history_moved(&model->history, &state->history, 0);
    bool told = false;
    for (size_t i = 0; model->n_unsettled > 0 && i < model->n_inputs; ++i) {
        if (moved[i] == SLIDE_MOVED && state->before.moved[i] == SLIDE_HELD) {
            tell_back(model, state, i);
            told = true;
        }
    }
    for (size_t place = 0; told && place < model->n_phases; ++place) {
        state->phases[place].head->kept = 0;
        state->phases[place].head->expected = 1;
    }
}

/* The outputs at the end of the newest step. */
static bool finish(const SlideModel *model, SlideState *state) {
    go_to_end(model, state);
    tell_later(model, state);
    if (!reach(model, state)) {
        return false;
    }
    state->head->n_steps += 1;
    give(model, state);
    for (size_t i = 0; state->head->between && i < model->n_outputs; ++i) {
        const SlideScaling *scaling = &model->output_scaling[i];
        state->outputs[i] = model->candidate[i] * scaling->scale + scaling->offset;
    }
    return true;
}

/* What undoes a step that fails. */
static void prepare(const SlideModel *model, SlideState *state) {
    memcpy(state->undo.front, state->head, state->front);
    slide_history_prepare(&model->history, &state->history, &state->undo.history);
    state->undo.n_went_on = 0;
}

/* Back to before a step that failed. */
static void undo(const SlideModel *model, SlideState *state) {
    slide_forecast_copy(&state->before.forecast[state->head->forecast], &state->forecast);
    slide_phases_undo(model, state);
    slide_history_undo(&model->history, &state->undo.history, &state->history);
    slide_model_form(model, state->acting);
    if (slide_stream_fresh(state)) {
        state->head->current = 0;
    } else if (slide_now(state)->head->used == 0) { /* it is found again */
        const double credit = state->head->credit;
        const double *forecast = slide_before_step(state, state->ahead.forecast);
        state->head->n_steps -= 1;
        reach(model, state);
        state->head->n_steps += 1;
        slide_phases_note_nothing(state);
        memcpy(state->ahead.forecast, forecast, model->n_outputs * sizeof(double));
        state->head->credit = credit;
        state->head->concluded = state->head->estimated = 0;
    }
}

bool slide_stream_step(const SlideModel *model, SlideState *state, double length) {
    if (slide_stream_fresh(state) && !slide_stream_hold(model, state)) {
        return false;
    }
    prepare(model, state);
    accept_parameters(model, state);
    begin(model, state, length);
    if (!finish(model, state)) {
        undo(model, state);
        return false;
    }
    return true;
}

bool slide_stream_go_on(const SlideModel *model, SlideState *state) {
    SlideHead *head = state->head;
    begin_again(model, state);
    head->n_steps -= 1; /* both are one */
    head->concluded = head->estimated = 0;
    head->last_length = (nearbyint(head->last_length / model->step) + 1) * model->step;
    slide_clock_advance(&head->inner, slide_clock_time(&head->inner), model->step);
    slide_history_newest(&model->history, &state->history)[0] = head->last_length;
    return finish(model, state);
}

double slide_stream_filled(const SlideModel *model, const SlideState *state) {
    const double samples = slide_clock_time(&state->head->inner) / model->step;
    const double nearest = nearbyint(samples);
    return fabs(samples - nearest) <= 1e-6 * fmax(nearest, 1) ? nearest : samples;
}

bool slide_stream_in_range(const SlideModel *model, SlideState *state) {
    const SlidePhase *phase = slide_now(state);
    const uint64_t behind = *phase->samples.count - phase->head->strayed;
    const uint64_t memory = model->predictor.memory_length;
    const double since = slide_clock_time(&state->head->inner) - state->head->outside;
    return (phase->head->strayed == 0 || behind >= memory) && since >= memory * model->step;
}

bool slide_stream_doubtful(const SlideModel *model, const SlideState *state) {
    const double since = slide_clock_time(&state->head->inner) - state->head->doubt;
    const bool open = !model->history.first_order && state->head->known == 0 &&
                      slide_forecast_begins_to_change(&state->forecast, model->n_inputs);
    return open || since < model->predictor.memory_length * model->step;
}

const float *slide_stream_block(const SlideModel *model, SlideState *state) {
    const SlidePhase *phase = slide_now(state);
    return model->predictor.family->block(&model->predictor, model->kernel, &phase->predictor,
                                          *phase->samples.count - 1);
}

/* What is estimate before the open samples stays when they are taken back: else each step would have to
 * find all of it again. */
const SlideEstimate *slide_stream_estimate(const SlideModel *model, SlideState *state) {
    SlidePhase *phase = slide_now(state);
    const uint64_t n_known = slide_phase_n_known(model, phase), count = *phase->samples.count;
    SlideEstimate *ahead = &state->ahead.estimate, *estimate = count > n_known + 1 ? ahead : &phase->estimate;
    if (state->head->estimated == state->head->n_steps + 1) {
        return estimate;
    }
    slide_estimate_form(&model->estimator, model->kernel, &model->samples, &phase->samples, n_known,
                        estimate == ahead ? n_known : count, &phase->estimate);
    if (estimate == ahead) {
        memcpy(ahead->known, phase->estimate.known, ahead->evaluated);
        slide_estimate_form(&model->estimator, model->kernel, &model->samples, &phase->samples,
                            count, count, ahead);
    }
    state->head->estimated = state->head->n_steps + 1;
    return estimate;
}

/* At least until sample 0: a phase that ends before it has what was before the start, and in the place
 * of sample 0 that which the start has there. */
static void bound_until(const SlideModel *model, const SlidePhase *phase, uint64_t count,
                        SlideBoundState *bound) {
    const uint64_t least = model->samples.capacity;
    const bool apart = model->others.capacity > 0;
    slide_bound_catch_up(&model->bound, model->kernel, &model->samples,
                         apart ? &phase->others : &phase->samples, count > least ? count : least,
                         bound);
}

static void conclude(const SlideModel *model, SlideState *state, SlideBoundState *bound) {
    const SlideBound *shape = &model->bound;
    const SlideEstimate *estimate =
        shape->n_expected > 0 ? slide_stream_estimate(model, state) : NULL;
    for (size_t i = 0; i < shape->n_expected; ++i) {
        shape->expected[i] = estimate->newest[i];
    }
    slide_bound_conclude(shape, model->kernel, bound);
}

const SlideBoundState *slide_stream_bound(const SlideModel *model, SlideState *state) {
    SlidePhase *phase = slide_now(state);
    SlideBoundState *ahead = &state->ahead.bound;
    if (state->head->concluded == state->head->n_steps + 1) {
        return ahead;
    }
    bound_until(model, phase, slide_phase_n_known(model, phase), &phase->bound);
    if (phase->head->n_open == 0) {
        conclude(model, state, &phase->bound);
        return &phase->bound;
    }
    float *predicted = ahead->predicted;
    memcpy(ahead->known, phase->bound.known, ahead->evaluated);
    ahead->predicted = phase->bound.predicted;
    bound_until(model, phase, *phase->samples.count, ahead);
    ahead->predicted = predicted;
    conclude(model, state, ahead);
    slide_bound_take_back(&model->bound, &phase->bound, *phase->samples.count);
    state->head->concluded = state->head->n_steps + 1;
    return ahead;
}

/* Is this one of the phases behind the outputs of now? */
static bool is_behind(const SlideState *state, const SlidePhase *phase) {
    return state->head->n_steps > 0 && phase->head->used == state->head->n_steps;
}

double slide_stream_novelty(const SlideModel *model, SlideState *state) {
    double largest = *slide_stream_bound(model, state)->novelty;
    for (size_t i = 0; i < model->n_phases && state->head->between; ++i) {
        SlidePhase *phase = &state->phases[i];
        const uint64_t n_known = *phase->samples.count - phase->head->n_open;
        const bool has_any = n_known >= model->samples.capacity; /* samples with numbers */
        if (i != state->head->now && is_behind(state, phase) && has_any) {
            bound_until(model, phase, n_known, &phase->bound);
            largest = fmax(largest, slide_bound_novelty(&model->bound, &phase->bound));
        }
    }
    return largest;
}
