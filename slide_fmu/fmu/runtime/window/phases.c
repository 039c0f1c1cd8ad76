#include "phases.h"

#include "sampling.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* In sample steps: phases nearer to each other are one. */
static const double SLACK = 1e-5;

/* Where a phase takes in more samples than these at once, its outputs are interpolated instead, if that
 * happens too often. */
static const double MANY = 32;

/* What forecasts change counts as the mean of so many calls. */
static const double N_JUDGED = 16;

static bool is_whole(double samples, double slack) {
    return fabs(samples - nearbyint(samples)) <= slack;
}

uint64_t slide_phases_of(const SlideModel *model, double length) {
    for (uint64_t count = 1; count <= model->n_phases; ++count) {
        const double samples = (double)count * length / model->step;
        if (samples > SLACK && is_whole(samples, SLACK)) {
            return count;
        }
    }
    return 0;
}

void slide_phases_note_nothing(SlideState *state) {
    state->head->n_since = 0;
    state->head->n_looked = 0;
}

/* Is a time one at which a phase has its samples? Times have rounding errors. */
static bool fits(const SlideModel *model, const SlidePhase *phase, double time) {
    const double slack = SLACK + 8 * DBL_EPSILON * fabs(time) / model->step;
    return phase->head->used > 0 && is_whole((time - phase->head->end) / model->step, slack);
}

/* The place of an empty phase, or of that which was not needed for longest. */
static size_t vacant(const SlideModel *model, const SlideState *state) {
    size_t place = 0;
    for (size_t i = 1; i < model->n_phases; ++i) {
        place = state->phases[i].head->used < state->phases[place].head->used ? i : place;
    }
    return place;
}

/* The place of the phase of a time; else a vacant one. */
static size_t place_for(const SlideModel *model, const SlideState *state, double time) {
    for (size_t i = 0; i < model->n_phases; ++i) {
        if (fits(model, &state->phases[i], time)) {
            return i;
        }
    }
    return vacant(model, state);
}

/* Samples from a time on until another. */
static double samples_between(const SlideModel *model, double from, double to) {
    return nearbyint((to - from) / model->step);
}

/* Samples that are open, where so many of the newest end after the last communication point. */
static uint64_t n_open_of(const SlideModel *model, uint64_t n_ahead) {
    const uint64_t with_spread = n_ahead + SLIDE_SPREAD;
    if (model->n_unsettled == 0) {
        return n_ahead;
    }
    return with_spread > model->n_unsettled ? with_spread : model->n_unsettled;
}

/* Samples until a time that end after the last communication point. */
static uint64_t n_ahead_at(const SlideModel *model, const SlideState *state, double time) {
    const bool told = state->head->moved != 0 && !model->history.first_order;
    if (state->head->known != 0 && !told) {
        return 0; /* what was set is all; but what is set next may not lie where derivatives lead */
    }
    const double ahead = time - (slide_clock_time(&state->head->inner) - state->head->last_length);
    const double samples = fmax(ceil(ahead / model->step - SLACK), 0);
    return samples <= model->n_in ? (uint64_t)samples : model->n_in + 1;
}

void slide_phases_judge(double *mean, double change) {
    *mean += (change * change - *mean) / N_JUDGED;
}

/* How far the outputs that were given were off, when less was known of the inputs. Where a held input
 * changes within the samples of some phases only, this is about those. Where all were held, all was known:
 * what the next sample changes in those before it, it makes up for itself. */
static void judge(const SlideModel *model, SlideState *state, SlidePhase *phase, const float *given) {
    const bool held = model->n_unsettled > 0, known = held && phase->head->expected == 0;
    double *means = held ? phase->revised : state->ahead.forecast;
    if (!held && state->head->between) {
        return; /* what was expected is not in a phase then, but in the newest sample beside it */
    }
    for (size_t i = 0; i < model->n_outputs; ++i) {
        slide_phases_judge(&means[i], known ? 0 : (double)phase->given[i] - given[i]);
    }
}

/* Of the open samples, so many of the newest are not what they were: they lie from a place on in
 * model->taken, newest first. */
static uint64_t n_changed(const SlideModel *model, const SlidePhase *phase, uint64_t from) {
    const size_t row = model->n_inputs;
    for (uint64_t left = phase->head->n_open; left-- > 0;) {
        const double *sample =
            slide_samples_at(&model->samples, &phase->samples, *phase->samples.count - 1 - left);
        if (memcmp(sample, model->taken + (from + left) * row, row * sizeof *sample) != 0) {
            return left + 1;
        }
    }
    return 0;
}

/* A phase goes on by samples that are in model->taken, newest first; then so many are open, of which
 * some may be open before. */
static bool take(const SlideModel *model, SlidePhase *phase, uint64_t count, uint64_t n_open) {
    slide_phase_know(model, phase, n_open > count ? n_open - count : 0);
    const uint64_t n_before = phase->head->n_open;
    for (uint64_t left = count; left-- > 0;) {
        if (left + 1 == n_open || (left + 1 == count && n_open > count && n_before == 0)) {
            slide_phase_open(model, phase);
        }
        if (!slide_phase_take(model, phase, slide_sample_taken(model, left), left == 0)) {
            return false;
        }
    }
    phase->head->n_open = n_open > count ? n_before + count : n_open;
    return true;
}

/* The open samples, which lie from a place on in model->taken, are what they are now. Where they
 * were right they stay. */
static bool renew(const SlideModel *model, SlideState *state, SlidePhase *phase, uint64_t from) {
    const uint64_t n_open = phase->head->n_open, changed = n_changed(model, phase, from);
    float *given = model->given;
    memcpy(given, phase->given, model->n_outputs * sizeof *given);
    const double end = phase->head->end;
    const uint64_t n_again = changed > 0 ? slide_phase_take_some_back(model, phase, changed) : 0;
    for (uint64_t left = n_again; left-- > 0;) {
        if (!slide_phase_take(model, phase, slide_sample_taken(model, from + left), left == 0)) {
            return false;
        }
    }
    phase->head->end = end;
    phase->head->n_open = n_open;
    if (from > 0) { /* new samples come; else no more is known than before */
        judge(model, state, phase, given);
    }
    return true;
}

/* Some inputs move in the newest step, which may end with other values. */
static bool expects(const SlideModel *model, const SlideState *state) {
    const unsigned char *moved = slide_history_moved(&model->history, &state->history, 0);
    for (size_t i = 0; i < model->n_inputs; ++i) {
        if (moved[i] != SLIDE_HELD) {
            return true;
        }
    }
    return false;
}

/* What derivatives need of the state before the samples that come after what is known. */
static void note_known(const SlideModel *model, SlideState *state, const SlidePhase *phase,
                       double time) {
    const SlideFamily *family = model->predictor.family;
    SlideHead *head = state->head;
    head->before = 1 - head->before;
    if (slide_is_recurrent(family)) {
        family->keep(&model->predictor, phase->head->n_open > 0 ? &phase->known : &phase->predictor,
                     &state->before.predictor[head->before]);
    }
    head->n_looked = 0;
    head->n_since = (uint64_t)samples_between(model, slide_phase_known_end(model, phase), time);
}

static SlidePhaseHead *head_before(const SlideState *state, const SlidePhase *phase) {
    return slide_before_step(state, phase->head);
}

/* What undoes the step besides its front and the state that was noted. */
static void note_open(const SlideModel *model, SlideState *state, const SlidePhase *phase) {
    const size_t row = model->n_inputs;
    SlideUndo *undo = &state->undo;
    undo->n_went_on += 1;
    undo->place = (size_t)(phase - state->phases);
    undo->resumed = phase->head->used <= state->head->n_steps;
    undo->n_samples = *phase->samples.count;
    if (model->n_unsettled > 0) {
        memcpy(undo->revised, phase->revised, model->n_outputs * sizeof *phase->revised);
        memcpy(undo->kept, phase->kept, model->n_kept * sizeof *phase->kept);
    }
    for (uint64_t left = phase->head->n_open; left-- > 0;) {
        const uint64_t number = *phase->samples.count - 1 - left;
        const size_t place = (size_t)(phase->head->n_open - 1 - left) * row;
        memcpy(undo->open + place, slide_samples_at(&model->samples, &phase->samples, number),
               row * sizeof(double));
        if (model->others.capacity > 0) {
            memcpy(undo->others + place, slide_samples_at(&model->others, &phase->others, number),
                   row * sizeof(double));
        }
    }
}

/* The phase that went on is what it was; its head is that already. */
static bool restore(const SlideModel *model, SlideState *state) {
    const SlideUndo *undo = &state->undo;
    SlidePhase *phase = &state->phases[undo->place];
    const SlidePhaseHead head = *phase->head;
    bool done = true;
    slide_phase_restore(model, phase, undo->n_samples,
                        &state->before.predictor[1 - state->head->before]); /* the one just noted */
    for (uint64_t i = 0; done && i < head.n_open; ++i) {
        if (i == 0) {
            slide_phase_open(model, phase);
        }
        const double *inputs = undo->open + i * model->n_inputs;
        const SlideSample sample = {
            inputs, model->others.capacity > 0 ? undo->others + i * model->n_inputs : inputs,
            false}; /* the head tells below what strayed */
        done = slide_phase_take(model, phase, sample, i + 1 == head.n_open);
    }
    *phase->head = head;
    if (model->n_unsettled > 0) {
        memcpy(phase->revised, undo->revised, model->n_outputs * sizeof *phase->revised);
        memcpy(phase->kept, undo->kept, model->n_kept * sizeof *phase->kept);
    }
    return done;
}

void slide_phases_undo(const SlideModel *model, SlideState *state) {
    const SlideUndo *undo = &state->undo;
    const bool several = undo->n_went_on > 1; /* between phases: of each, only one state was kept */
    const bool resumed = undo->n_went_on == 1 && undo->resumed;
    for (size_t place = 0; place < model->n_phases; ++place) {
        SlidePhase *phase = &state->phases[place];
        if (phase->head->used > state->head->n_steps && !(resumed && place == undo->place)) {
            head_before(state, phase)->used = 0;
        }
    }
    memcpy(state->head, undo->front, state->front);
    if (resumed && !restore(model, state)) {
        state->phases[undo->place].head->used = 0;
    }
    if (several) {
        slide_phases_note_nothing(state);
    }
}

/* A phase goes on to a time, by samples that come after those that it has. Open ones stay where they
 * end until then, and are known now. */
static bool go_on(const SlideModel *model, SlideState *state, SlidePhase *phase, double time,
                  uint64_t least_open) {
    const double now = slide_clock_time(&state->head->inner);
    note_known(model, state, phase, time);
    const bool ahead = model->n_unsettled == 0 && n_ahead_at(model, state, phase->head->end) > 0;
    if (phase->head->n_open > 0 && (ahead || samples_between(model, phase->head->end, time) < 0)) {
        slide_phase_take_back(model, phase);
    }
    const uint64_t n_again = phase->head->n_open;
    const uint64_t n_taken = (uint64_t)samples_between(model, phase->head->end, time);
    const uint64_t n_ahead = n_ahead_at(model, state, time);
    const uint64_t n_open = n_open_of(model, n_ahead > least_open ? n_ahead : least_open);
    const bool kept =
        slide_sample_phase(model, state, phase, n_again + n_taken, n_open, fmax(now - time, 0));
    const bool done = (n_again == 0 || renew(model, state, phase, n_taken)) &&
                      take(model, phase, n_taken, n_open);
    if (n_taken > 0) { /* else its samples end where they did, or tiny steps would drag it along */
        phase->head->end = time;
    }
    phase->head->expected = expects(model, state);
    phase->head->kept = kept && phase->head->n_open == n_open ? *phase->samples.count : 0;
    return done;
}

/* A phase begins with what was before the first step. */
static bool begin(const SlideModel *model, SlideState *state, SlidePhase *phase, double time,
                  uint64_t least_open) {
    const SlidePhase *start = slide_start(model, state);
    slide_phase_copy(model, start, phase);
    state->undo.n_went_on += 1;
    state->undo.resumed = false;
    if (phase->head->n_open > 0) {
        slide_phase_take_back(model, phase);
    }
    /* where nothing moved before, samples need not end at the start */
    const double samples = ceil((time - phase->head->end) / model->step - SLACK);
    phase->head->end = time - model->step * fmax(samples, 0);
    return go_on(model, state, phase, time, least_open);
}

/* May a phase begin with what was before the first step? */
static bool may_begin(const SlideModel *model, SlideState *state, double time) {
    const SlidePhase *start = slide_start(model, state);
    const double samples = (time - slide_phase_known_end(model, start)) / model->step;
    const bool steady = !slide_window_is_known(state);
    return start->head->used > 0 && samples <= model->most_open && (steady || is_whole(samples, SLACK));
}

/* A phase sees all samples anew that anything depends on. After a step that is longer than the
 * window it has seen nothing that is known: then it fits no further time. */
static bool see_all(const SlideModel *model, SlideState *state, SlidePhase *phase, double time,
                    uint64_t least_open) {
    const double now = slide_clock_time(&state->head->inner);
    const uint64_t n_ahead = n_ahead_at(model, state, time);
    const bool lasts = n_ahead <= model->n_in;
    const uint64_t n_late = !lasts ? 0 : n_ahead > least_open ? n_ahead : least_open;
    const uint64_t n_open = lasts ? n_open_of(model, n_late) : 0;
    const uint64_t count = model->memory_length + n_open;
    /* the bound compares what the predictor gave after all of them */
    const uint64_t n_whole = model->predictor.n_samples + n_late;
    const uint64_t n_looked = model->bound.memory_length > 0 ? count
                              : n_whole > n_open             ? n_whole
                                                             : n_open;
    if (phase != slide_now(state)) {
        slide_phase_clear(model, phase, slide_now(state));
    }
    if (model->n_unsettled > 0) { /* until it has its own */
        memcpy(phase->revised, state->ahead.forecast, model->n_outputs * sizeof *phase->revised);
    }
    slide_sample(model, state, count, fmax(now - time, 0));
    slide_phase_restart(model, phase, slide_sample_taken(model, count - 1));
    for (uint64_t left = count; left-- > n_looked;) {
        slide_phase_pass(model, phase, slide_sample_taken(model, left));
    }
    const bool done = take(model, phase, n_looked < count ? n_looked : count, n_open);
    phase->head->end = lasts ? time : NAN;
    phase->head->expected = expects(model, state);
    slide_phases_note_nothing(state);
    state->head->n_looked = n_looked < count ? n_looked : count;
    return done;
}

/* Does a phase go on to a time? */
static bool leads_to(const SlideModel *model, const SlidePhase *phase, double time,
                     uint64_t least_open) {
    const double ahead = samples_between(model, slide_phase_known_end(model, phase), time);
    return fits(model, phase, time) && ahead >= (double)least_open && ahead <= model->most_open;
}

/* Samples that a phase takes in until a time. */
static double n_taken_until(const SlideModel *model, const SlidePhase *phase, double time) {
    return (time - slide_phase_known_end(model, phase)) / model->step;
}

bool slide_phases_have(const SlideModel *model, SlideState *state, double time) {
    const SlidePhase *phase = &state->phases[place_for(model, state, time)];
    return (fits(model, phase, time) && n_taken_until(model, phase, time) <= MANY) ||
           (may_begin(model, state, time) &&
            n_taken_until(model, slide_start(model, state), time) <= MANY);
}

bool slide_phases_reach(const SlideModel *model, SlideState *state, double time,
                        uint64_t least_open, size_t *place) {
    *place = place_for(model, state, time);
    SlidePhase *phase = &state->phases[*place];
    const bool fitting = fits(model, phase, time);
    bool done, costs;
    if (leads_to(model, phase, time, least_open)) {
        costs = n_taken_until(model, phase, time) > MANY;
        note_open(model, state, phase);
        done = go_on(model, state, phase, time, least_open);
    } else if (may_begin(model, state, time)) {
        costs = n_taken_until(model, slide_start(model, state), time) > MANY;
        done = begin(model, state, phase, time, least_open);
    } else { /* elsewhere, so that the phase is there when this fails */
        costs = !fitting;
        *place = vacant(model, state);
        done = see_all(model, state, &state->phases[*place], time, least_open);
        phase->head->used = done && fitting ? 0 : phase->head->used;
    }
    state->head->credit -= costs ? fmin(state->head->credit, 1) : 0;
    state->phases[*place].head->used = state->head->n_steps + 1;
    return done;
}
