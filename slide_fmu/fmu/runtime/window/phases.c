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
static bool fits(const SlideModel *model, const SlideSeen *seen, double time) {
    const double slack = SLACK + 8 * DBL_EPSILON * fabs(time) / model->step;
    return seen->head->used > 0 && is_whole((time - seen->head->end) / model->step, slack);
}

/* The place of an empty phase, or of that which was not needed for longest. */
static size_t vacant(const SlideModel *model, const SlideState *state) {
    size_t place = 0;
    for (size_t i = 1; i < model->n_phases; ++i) {
        place = state->seen[i].head->used < state->seen[place].head->used ? i : place;
    }
    return place;
}

/* The place of the phase of a time; else a vacant one. */
static size_t place_for(const SlideModel *model, const SlideState *state, double time) {
    for (size_t i = 0; i < model->n_phases; ++i) {
        if (fits(model, &state->seen[i], time)) {
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
static void judge(const SlideModel *model, SlideState *state, SlideSeen *seen, const float *given) {
    const bool held = model->n_unsettled > 0, known = held && seen->head->expected == 0;
    double *means = held ? seen->revised : state->ahead.forecast;
    if (!held && state->head->between) {
        return; /* what was expected is not in a phase then, but in the newest sample beside it */
    }
    for (size_t i = 0; i < model->n_outputs; ++i) {
        slide_phases_judge(&means[i], known ? 0 : (double)seen->given[i] - given[i]);
    }
}

/* Of the open samples, so many of the newest are not what they were: they lie from a place on in
 * model->taken, newest first. */
static uint64_t n_changed(const SlideModel *model, const SlideSeen *seen, uint64_t from) {
    const size_t row = model->n_inputs;
    for (uint64_t left = seen->head->n_open; left-- > 0;) {
        const double *sample =
            slide_samples_at(&model->samples, &seen->samples, *seen->samples.count - 1 - left);
        if (memcmp(sample, model->taken + (from + left) * row, row * sizeof *sample) != 0) {
            return left + 1;
        }
    }
    return 0;
}

/* A phase goes on by samples that are in model->taken, newest first; then so many are open, of which
 * some may be open before. */
static bool take(const SlideModel *model, SlideSeen *seen, uint64_t count, uint64_t n_open) {
    slide_seen_know(model, seen, n_open > count ? n_open - count : 0);
    const uint64_t n_before = seen->head->n_open;
    for (uint64_t left = count; left-- > 0;) {
        if (left + 1 == n_open || (left + 1 == count && n_open > count && n_before == 0)) {
            slide_seen_open(model, seen);
        }
        if (!slide_seen_take(model, seen, slide_sample_taken(model, left), left == 0)) {
            return false;
        }
    }
    seen->head->n_open = n_open > count ? n_before + count : n_open;
    return true;
}

/* The open samples, which lie from a place on in model->taken, are what they are now. Where they
 * were right they stay. */
static bool renew(const SlideModel *model, SlideState *state, SlideSeen *seen, uint64_t from) {
    const uint64_t n_open = seen->head->n_open, changed = n_changed(model, seen, from);
    float *given = model->given;
    memcpy(given, seen->given, model->n_outputs * sizeof *given);
    const double end = seen->head->end;
    const uint64_t n_again = changed > 0 ? slide_seen_take_some_back(model, seen, changed) : 0;
    for (uint64_t left = n_again; left-- > 0;) {
        if (!slide_seen_take(model, seen, slide_sample_taken(model, from + left), left == 0)) {
            return false;
        }
    }
    seen->head->end = end;
    seen->head->n_open = n_open;
    if (from > 0) { /* new samples come; else no more is known than before */
        judge(model, state, seen, given);
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

/* What derivatives need of the state before the samples that come after what is known, and what
 * undoes the step. */
static void note(const SlideModel *model, SlideState *state, const SlideSeen *seen, double time) {
    const SlideFamily *family = model->predictor.family;
    const size_t row = model->n_inputs;
    const SlideUndo *undo = &model->undo;
    SlideHead *head = state->head;
    head->before = 1 - head->before;
    if (slide_is_recurrent(family)) {
        family->keep(&model->predictor, seen->head->n_open > 0 ? &seen->known : &seen->predictor,
                     &state->before.predictor[head->before]);
    }
    head->n_looked = 0;
    head->n_since = (uint64_t)samples_between(model, slide_seen_known_end(model, seen), time);
    *undo->seen = *seen->head;
    undo->count[0] = *seen->samples.count;
    undo->count[1] = (uint64_t)(seen - state->seen);
    undo->count[2] += 1;
    if (model->n_unsettled > 0) {
        memcpy(undo->revised, seen->revised, model->n_outputs * sizeof *seen->revised);
        memcpy(undo->kept, seen->kept, model->n_kept * sizeof *seen->kept);
    }
    for (uint64_t left = seen->head->n_open; left-- > 0;) {
        const uint64_t number = *seen->samples.count - 1 - left;
        const size_t place = (size_t)(seen->head->n_open - 1 - left) * row;
        memcpy(undo->open + place, slide_samples_at(&model->samples, &seen->samples, number),
               row * sizeof(double));
        if (model->others.capacity > 0) {
            memcpy(undo->others + place, slide_samples_at(&model->others, &seen->others, number),
                   row * sizeof(double));
        }
    }
}

void slide_phases_prepare(const SlideModel *model, const SlideState *state) {
    const SlideUndo *undo = &model->undo;
    undo->seen->used = 0;
    undo->count[2] = 0;
    *undo->start_used = state->seen[model->n_phases].head->used;
    for (size_t place = 0; place <= model->n_phases; ++place) {
        undo->since[place] = state->seen[place].head->since;
    }
    for (size_t place = 0; place < model->n_phases; ++place) {
        undo->kept_of[place] = state->seen[place].head->kept;
        undo->expected[place] = state->seen[place].head->expected;
    }
}

/* The phase that went on is what it was. */
static bool restore(const SlideModel *model, SlideState *state, SlideSeen *seen) {
    const SlideUndo *undo = &model->undo;
    const uint64_t n_open = undo->seen->n_open;
    bool done = true;
    slide_seen_restore(model, seen, undo->seen, undo->count[0],
                       &state->before.predictor[1 - state->head->before]);
    for (uint64_t i = 0; done && i < n_open; ++i) {
        if (i == 0) {
            slide_seen_open(model, seen);
        }
        const double *inputs = undo->open + i * model->n_inputs;
        const SlideSample sample = {
            inputs, model->others.capacity > 0 ? undo->others + i * model->n_inputs : inputs,
            false}; /* the head tells below what strayed */
        done = slide_seen_take(model, seen, sample, i + 1 == n_open);
    }
    *seen->head = *undo->seen;
    if (model->n_unsettled > 0) {
        memcpy(seen->revised, undo->revised, model->n_outputs * sizeof *seen->revised);
        memcpy(seen->kept, undo->kept, model->n_kept * sizeof *seen->kept);
    }
    return done;
}

bool slide_phases_undo(const SlideModel *model, SlideState *state) {
    const SlideUndo *undo = &model->undo;
    const uint64_t n_steps = state->head->n_steps;
    const bool several = undo->count[2] > 1; /* between phases: of each, only one state was kept */
    for (size_t place = 0; place <= model->n_phases; ++place) {
        state->seen[place].head->since = undo->since[place];
    }
    slide_start(model, state)->head->used = *undo->start_used;
    undo->seen->since = undo->since[undo->count[1]];
    undo->seen->kept = undo->kept_of[undo->count[1]];
    undo->seen->expected = undo->expected[undo->count[1]];
    for (size_t place = 0; place < model->n_phases; ++place) {
        SlideSeen *seen = &state->seen[place];
        if (seen->head->used <= n_steps) { /* it may have been told of what failed */
            seen->head->kept = undo->kept_of[place];
            seen->head->expected = undo->expected[place];
            continue;
        }
        /* one that went on twice was noted after it had seen what failed */
        if (several || undo->count[1] != place || undo->seen->used == 0 || undo->seen->used > n_steps ||
            !restore(model, state, seen)) {
            seen->head->used = 0;
        }
    }
    if (several) {
        slide_phases_note_nothing(state);
    }
    return slide_now(state)->head->used > 0;
}

void slide_phases_forget(const SlideModel *model, SlideState *state) {
    for (size_t place = 0; place < model->n_phases; ++place) {
        state->seen[place].head->used = 0;
    }
}

/* A phase goes on to a time, by samples that come after those that it has. Open ones stay where they
 * end until then, and are known now. */
static bool go_on(const SlideModel *model, SlideState *state, SlideSeen *seen, double time,
                  uint64_t least_open) {
    const double now = slide_clock_time(&state->head->inner);
    note(model, state, seen, time);
    const bool ahead = model->n_unsettled == 0 && n_ahead_at(model, state, seen->head->end) > 0;
    if (seen->head->n_open > 0 && (ahead || samples_between(model, seen->head->end, time) < 0)) {
        slide_seen_take_back(model, seen);
    }
    const uint64_t n_again = seen->head->n_open;
    const uint64_t n_taken = (uint64_t)samples_between(model, seen->head->end, time);
    const uint64_t n_ahead = n_ahead_at(model, state, time);
    const uint64_t n_open = n_open_of(model, n_ahead > least_open ? n_ahead : least_open);
    const bool kept =
        slide_sample_phase(model, state, seen, n_again + n_taken, n_open, fmax(now - time, 0));
    const bool done = (n_again == 0 || renew(model, state, seen, n_taken)) &&
                      take(model, seen, n_taken, n_open);
    if (n_taken > 0) { /* else its samples end where they did, or tiny steps would drag it along */
        seen->head->end = time;
    }
    seen->head->expected = expects(model, state);
    seen->head->kept = kept && seen->head->n_open == n_open ? *seen->samples.count : 0;
    return done;
}

/* A phase begins with what was before the first step. */
static bool begin(const SlideModel *model, SlideState *state, SlideSeen *seen, double time,
                  uint64_t least_open) {
    const SlideSeen *start = slide_start(model, state);
    slide_seen_copy(model, start, seen);
    if (seen->head->n_open > 0) {
        slide_seen_take_back(model, seen);
    }
    /* where nothing moved before, samples need not end at the start */
    const double samples = ceil((time - seen->head->end) / model->step - SLACK);
    seen->head->end = time - model->step * fmax(samples, 0);
    return go_on(model, state, seen, time, least_open);
}

/* May a phase begin with what was before the first step? */
static bool may_begin(const SlideModel *model, SlideState *state, double time) {
    const SlideSeen *start = slide_start(model, state);
    const double samples = (time - slide_seen_known_end(model, start)) / model->step;
    const bool steady = state->head->prehistory != SLIDE_INITIAL_WINDOW_KNOWN;
    return start->head->used > 0 && samples <= model->most_open && (steady || is_whole(samples, SLACK));
}

/* A phase sees all samples anew that anything depends on. After a step that is longer than the
 * window it has seen nothing that is known: then it fits no further time. */
static bool see_all(const SlideModel *model, SlideState *state, SlideSeen *seen, double time,
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
    if (seen != slide_now(state)) {
        slide_seen_clear(model, seen, slide_now(state));
    }
    if (model->n_unsettled > 0) { /* until it has its own */
        memcpy(seen->revised, state->ahead.forecast, model->n_outputs * sizeof *seen->revised);
    }
    slide_sample(model, state, count, fmax(now - time, 0));
    slide_seen_restart(model, seen, slide_sample_taken(model, count - 1));
    for (uint64_t left = count; left-- > n_looked;) {
        slide_seen_pass(model, seen, slide_sample_taken(model, left));
    }
    const bool done = take(model, seen, n_looked < count ? n_looked : count, n_open);
    seen->head->end = lasts ? time : NAN;
    seen->head->expected = expects(model, state);
    slide_phases_note_nothing(state);
    state->head->n_looked = n_looked < count ? n_looked : count;
    return done;
}

/* Does a phase go on to a time? */
static bool leads_to(const SlideModel *model, const SlideSeen *seen, double time,
                     uint64_t least_open) {
    const double ahead = samples_between(model, slide_seen_known_end(model, seen), time);
    return fits(model, seen, time) && ahead >= (double)least_open && ahead <= model->most_open;
}

/* Samples that a phase takes in until a time. */
static double n_taken_until(const SlideModel *model, const SlideSeen *seen, double time) {
    return (time - slide_seen_known_end(model, seen)) / model->step;
}

bool slide_phases_have(const SlideModel *model, SlideState *state, double time) {
    const SlideSeen *seen = &state->seen[place_for(model, state, time)];
    return (fits(model, seen, time) && n_taken_until(model, seen, time) <= MANY) ||
           (may_begin(model, state, time) &&
            n_taken_until(model, slide_start(model, state), time) <= MANY);
}

bool slide_phases_reach(const SlideModel *model, SlideState *state, double time,
                        uint64_t least_open, size_t *place) {
    *place = place_for(model, state, time);
    SlideSeen *seen = &state->seen[*place];
    const bool fitting = fits(model, seen, time);
    bool done, costs;
    if (leads_to(model, seen, time, least_open)) {
        costs = n_taken_until(model, seen, time) > MANY;
        done = go_on(model, state, seen, time, least_open);
    } else if (may_begin(model, state, time)) {
        costs = n_taken_until(model, slide_start(model, state), time) > MANY;
        done = begin(model, state, seen, time, least_open);
    } else { /* elsewhere, so that the phase is there when this fails */
        costs = !fitting;
        *place = vacant(model, state);
        done = see_all(model, state, &state->seen[*place], time, least_open);
        seen->head->used = done && fitting ? 0 : seen->head->used;
    }
    state->head->credit -= costs ? fmin(state->head->credit, 1) : 0;
    state->seen[*place].head->used = state->head->n_steps + 1;
    return done;
}
