#include "stream.h"

#include "ranges.h"

#include <math.h>
#include <string.h>

static void place_before(SlideBeforeStep *before, const SlideModel *model, SlideArena *arena) {
    size_t row = model->n_inputs * sizeof(double);
    before->given = slide_place(arena, 1, row);
    before->rates = slide_place(arena, 1, row);
    if (slide_is_recurrent(model->predictor.family)) {
        model->predictor.family->place_before(&before->predictor, &model->predictor, arena);
    }
}

void slide_state_place(SlideState *state, const SlideModel *model, SlideArena *arena) {
    size_t n_inputs = model->n_inputs, n_outputs = model->n_outputs, start;
    state->head = slide_place(arena, 1, sizeof *state->head);
    start = arena->used - sizeof *state->head;
    state->inputs = slide_place(arena, n_inputs, sizeof(double));
    state->rates = slide_place(arena, n_inputs, sizeof(double));
    state->initial = slide_place(arena, n_inputs, sizeof(double));
    state->outputs = slide_place(arena, n_outputs, sizeof(double));
    slide_samples_place(&state->samples, &model->samples, arena);
    model->predictor.family->place_state(&state->predictor, &model->predictor, arena);
    place_before(&state->before, model, arena);
    slide_estimate_place(&state->estimate, &model->estimator, arena);
    slide_history_place(&state->history, &model->history, arena);
    state->before_steps = arena->used - start - slide_history_steps_size(&model->history);
    state->window = slide_place(arena, model->memory_length, n_inputs * sizeof(double));
    state->size = arena->used - start;
    state->backup = slide_place(arena, state->before_steps, 1);
}

void slide_state_reset(const SlideModel *model, SlideState *state) {
    memset(state->head, 0, state->size);
    memcpy(state->inputs, model->starts, model->n_inputs * sizeof(double));
    memcpy(state->initial, model->starts, model->n_inputs * sizeof(double));
    for (size_t sample = 0; sample < model->memory_length; ++sample) {
        memcpy(state->window + sample * model->n_inputs, model->starts,
               model->n_inputs * sizeof(double));
    }
}

/* Before the first step: the inputs until then. */
static const double *prehistory(const SlideModel *model, const SlideState *state) {
    if (state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN) {
        return state->window + (size_t)(model->memory_length - 1) * model->n_inputs;
    }
    return state->head->prehistory == SLIDE_FIRST_HELD ? state->inputs : state->initial;
}

bool slide_stream_fresh(const SlideState *state) { return *state->history.count == 0; }

const double *slide_stream_reached(const SlideModel *model, const SlideState *state) {
    return slide_stream_fresh(state) ? prehistory(model, state)
                                     : slide_history_newest(&model->history, &state->history);
}

static void set_sample(const SlideModel *model, const double *inputs, double *sample) {
    for (size_t i = 0; i < model->n_inputs; ++i) {
        sample[i] = slide_scaled(model, i, inputs[i]);
    }
}

/* The outputs that the network gives after the sample that it has seen. */
static bool predict(const SlideModel *model, const SlideState *state, uint64_t sample) {
    bool finite = true;
    const float *values = model->predictor.family->evaluate(&model->predictor, model->kernel,
                                                            &state->predictor, sample);
    for (size_t i = 0; i < model->n_outputs; ++i) {
        const SlideScaling *scaling = &model->output_scaling[i];
        model->candidate[i] = values[i] * scaling->scale + scaling->offset;
        finite = finite && isfinite(model->candidate[i]);
    }
    return finite;
}

static const double *newest_sample(const SlideModel *model, const SlideState *state) {
    return slide_samples_at(&model->samples, &state->samples, *state->samples.count - 1);
}

/* The predictor looks at the next sample. */
static bool see(const SlideModel *model, SlideState *state, const double *sample) {
    return slide_network_see(&model->predictor, &state->predictor, *state->samples.count, sample,
                             newest_sample(model, state));
}

/* The predictor goes on by a sample. Layers are evaluated at the last one of a step only. */
static bool advance(const SlideModel *model, SlideState *state, const double *sample, bool last) {
    const bool evaluated = last || slide_is_recurrent(model->predictor.family);
    if (!see(model, state, sample) || (evaluated && !predict(model, state, *state->samples.count))) {
        return false;
    }
    if (evaluated) {
        model->predictor.family->accept(&model->predictor, &state->predictor);
    }
    return true;
}

/* A sample that is out of range leaves its number, once it is counted. */
static void watch_range(const SlideModel *model, SlideState *state, const double *sample) {
    if (!slide_in_range(sample, model->n_inputs, model->cosine)) {
        state->head->strayed = *state->samples.count;
    }
}

static void remember(const SlideModel *model, SlideState *state, const double *sample) {
    slide_samples_append(&model->samples, &state->samples, sample);
    watch_range(model, state, sample);
}

/* A step begins: keep what its derivatives need of the state before it. The derivatives of the
 * inputs count for this step only. */
static void keep(const SlideModel *model, SlideState *state, double length) {
    const SlideNetwork *network = &model->predictor;
    const size_t row = model->n_inputs * sizeof(double);
    if (slide_is_recurrent(network->family)) {
        network->family->keep(network, &state->predictor, &state->before.predictor);
    }
    memcpy(state->before.given, state->inputs, row);
    state->head->last_length = length;
    state->head->moved = state->head->moving;
    if (state->head->moving) {
        memcpy(state->before.rates, state->rates, row);
        memset(state->rates, 0, row);
        state->head->moving = 0;
    }
    slide_history_begin(&model->history, &state->history);
}

static bool take(const SlideModel *model, SlideState *state, const double *sample, bool last) {
    bool good = advance(model, state, sample, last);
    if (good) {
        remember(model, state, sample);
    }
    return good;
}

static void accept_outputs(const SlideModel *model, SlideState *state) {
    memcpy(state->outputs, model->candidate, model->n_outputs * sizeof(double));
    state->head->current = 1;
}

/* Forget all samples; this one counts for all. */
static void restart(const SlideModel *model, SlideState *state, const double *sample) {
    slide_samples_fill(&model->samples, &state->samples, sample);
    slide_network_restart(&model->predictor, &state->predictor, sample,
                          newest_sample(model, state));
    slide_estimate_restart(&model->estimator, &state->estimate);
    state->head->strayed = 0;
    watch_range(model, state, sample);
}

/* What is known of the inputs before the first step becomes the history. */
static void recall(const SlideModel *model, SlideState *state) {
    const bool window = state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN;
    const size_t n_inputs = model->n_inputs, count = window ? model->memory_length : 1;
    const double *rows = window ? state->window : prehistory(model, state);
    for (size_t sample = 0; sample < count; ++sample) {
        slide_history_append(&model->history, &state->history, model->step,
                             rows + sample * n_inputs, true);
    }
}

/* The step becomes the newest of the history. Beyond the samples that any result depends on, one
 * part of a step whose inputs move stands for all. */
static void append(const SlideModel *model, SlideState *state) {
    const double length = state->head->last_length;
    if (state->head->moved) {
        const SlideMovingStep step = {length, state->inputs, state->before.rates, model->step,
                                      model->memory_length + 1};
        slide_append_moving(&model->history, &state->history, &step, model->inputs);
    } else {
        slide_history_append(&model->history, &state->history, length, state->inputs, false);
    }
}

/* The newest samples up to the end of the newest step of the history; from: NULL, or the inputs
 * that move evenly over so many samples to those of this step. */
static void sample_past(const SlideModel *model, const SlideState *state, uint32_t count,
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
        set_sample(model, model->inputs, model->taken + left * model->n_inputs);
    }
}

/* Samples one h apart that a step takes in; 0: it takes all anew. */
static uint32_t count_whole(const SlideModel *model, double length) {
    double count = nearbyint(length / model->step);
    bool whole = length == count * model->step && count > 0 && count <= model->n_in;
    return whole ? (uint32_t)count : 0;
}

SlideIntake slide_stream_take_in(const SlideModel *model, SlideState *state) {
    const bool first = slide_stream_fresh(state);
    const bool settled = first && state->head->prehistory == SLIDE_FIRST_HELD;
    const bool held = settled && !state->head->moved; /* slide_stream_hold took in one sample */
    const uint32_t n_whole = count_whole(model, state->head->last_length);
    const double *from = slide_stream_reached(model, state);
    SlideIntake intake = {n_whole, n_whole == 0 && !held, settled};
    if (intake.anew) {
        intake.count = model->memory_length;
    } else if (held && n_whole > 0) {
        intake.count = n_whole - 1;
    }
    if (first && !held) {
        recall(model, state);
    }
    append(model, state); /* a step of whole samples is joined to none under a first-order hold */
    sample_past(model, state, intake.count,
                model->history.first_order && !intake.anew ? from : NULL);
    return intake;
}

/* The predictor goes on by what a step takes in; it sees its own part of what is taken in anew. */
static bool take_all(const SlideModel *model, SlideState *state, const SlideIntake *intake) {
    for (uint32_t left = intake->count; left-- > 0;) {
        const double *sample = model->taken + left * model->n_inputs;
        if (intake->anew && left == intake->count - 1) {
            restart(model, state, sample);
        }
        if (intake->anew && left >= model->predictor.n_samples) {
            remember(model, state, sample);
        } else if (!take(model, state, sample, left == 0)) {
            return false;
        }
    }
    return true;
}

static bool hold(const SlideModel *model, SlideState *state) {
    set_sample(model, prehistory(model, state), model->taken);
    restart(model, state, model->taken);
    for (uint64_t left = model->predictor.n_settling; left > 0; --left) {
        if (!advance(model, state, model->taken, left == 1)) {
            return false;
        }
    }
    return true;
}

bool slide_stream_hold(const SlideModel *model, SlideState *state) {
    bool done;
    if (state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN) {
        recall(model, state);
        sample_past(model, state, model->memory_length, NULL);
        const SlideIntake intake = {model->memory_length, .anew = true};
        done = take_all(model, state, &intake);
        *state->history.count = 0;
    } else {
        done = hold(model, state);
    }
    if (done) {
        accept_outputs(model, state);
    }
    return done;
}

static bool step_of(const SlideModel *model, SlideState *state, double length) {
    if (slide_stream_fresh(state) && !slide_stream_hold(model, state)) {
        return false;
    }
    keep(model, state, length);
    const SlideIntake intake = slide_stream_take_in(model, state);
    const uint32_t n_whole = count_whole(model, length);
    if (!take_all(model, state, &intake)) {
        return false;
    }
    accept_outputs(model, state);
    state->head->filled += n_whole > 0 ? n_whole : length / model->step;
    return true;
}

/* The most frequent step, of one sample; until all is found, it changes nothing that counts. */
static bool step_once(const SlideModel *model, SlideState *state) {
    set_sample(model, state->inputs, model->taken);
    if (!see(model, state, model->taken) || !predict(model, state, *state->samples.count)) {
        return false;
    }
    keep(model, state, model->step);
    model->predictor.family->accept(&model->predictor, &state->predictor);
    remember(model, state, model->taken);
    accept_outputs(model, state);
    slide_history_append(&model->history, &state->history, model->step, state->inputs, false);
    state->head->filled += 1;
    return true;
}

bool slide_stream_step(const SlideModel *model, SlideState *state, double length) {
    if (length == model->step && !slide_stream_fresh(state) && !state->head->moving) {
        return step_once(model, state);
    }
    memcpy(state->backup, state->head, state->before_steps);
    bool done = step_of(model, state, length);
    if (!done) {
        slide_history_go_back(&model->history, &state->history);
        memcpy(state->head, state->backup, state->before_steps);
    }
    return done;
}

bool slide_stream_in_range(const SlideModel *model, SlideState *state) {
    uint64_t behind = *state->samples.count - state->head->strayed;
    bool inside = state->head->strayed == 0 || behind >= model->predictor.memory_length;
    if (model->estimator.positions > 0) {
        slide_stream_estimate(model, state);
        inside = inside && slide_estimate_in_range(&model->estimator, &state->estimate);
    }
    return inside;
}

const float *slide_stream_block(const SlideModel *model, const SlideState *state) {
    return model->predictor.family->block(&model->predictor, model->kernel, &state->predictor,
                                          *state->samples.count - 1);
}

void slide_stream_estimate(const SlideModel *model, SlideState *state) {
    slide_estimate_catch_up(&model->estimator, model->kernel, &model->samples, &state->samples,
                            &state->estimate);
}
