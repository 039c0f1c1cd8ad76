#include "stream.h"

#include "ranges.h"

#include <math.h>
#include <string.h>

/* Beyond the samples that any result depends on, one part stands for all. */
static uint32_t largest_parts(const SlideModel *model) { return model->memory_length + 1; }

SlideParts slide_stream_parts(const SlideModel *model, double length) {
    return slide_parts(&model->history, length, model->step, largest_parts(model));
}

static void place_before(SlideBeforeStep *before, const SlideModel *model, SlideArena *arena) {
    size_t row = model->n_inputs * sizeof(double);
    before->inputs = slide_place(arena, 1, row);
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
    state->last = slide_place(arena, 1, sizeof *state->last);
    slide_samples_place(&state->samples, &model->samples, arena);
    model->predictor.family->place_state(&state->predictor, &model->predictor, arena);
    place_before(&state->before, model, arena);
    slide_estimate_place(&state->estimate, &model->estimator, arena);
    slide_history_place(&state->history, &model->history, arena);
    state->before_steps = arena->used - start - slide_history_steps_size(&model->history);
    state->window = slide_place(arena, model->memory_length, n_inputs * sizeof(double));
    state->size = arena->used - start;
    state->backup = slide_place(arena, state->before_steps, 1);
    /* the newest step, those before the first one, and the parts of one */
    size_t most = 1 + (size_t)model->memory_length + largest_parts(model);
    state->steps = slide_place(arena, most, (1 + n_inputs) * sizeof(double));
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

bool slide_input_usable(const SlideModel *model, size_t input, double value) {
    return isfinite(value) && isfinite((float)slide_scaled(model, input, value));
}

size_t slide_without_direction(const SlideModel *model, const double *inputs, double shortest) {
    for (size_t i = 0; i < model->n_inputs; ++i) {
        if (model->cosine[i] && !(hypot(inputs[i], inputs[i + 1]) >= shortest)) {
            return i;
        }
    }
    return model->n_inputs;
}

const double *slide_stream_prehistory(const SlideModel *model, const SlideState *state) {
    switch (state->head->prehistory) {
    case SLIDE_FIRST_HELD:
        return state->inputs;
    case SLIDE_INITIAL_HELD:
        return state->initial;
    default:
        return state->window + (size_t)(model->memory_length - 1) * model->n_inputs;
    }
}

bool slide_stream_fresh(const SlideState *state) { return *state->history.count == 0; }

static void set_sample(const SlideModel *model, const double *inputs) {
    for (size_t i = 0; i < model->n_inputs; ++i) {
        model->sample[i] = slide_scaled(model, i, inputs[i]);
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

/* The predictor looks at model->sample, the next one. */
static bool see(const SlideModel *model, SlideState *state) {
    return slide_network_see(&model->predictor, &state->predictor, *state->samples.count,
                             model->sample, newest_sample(model, state));
}

/* The predictor goes on by model->sample. Layers are evaluated at the last one of a step only. */
static bool advance(const SlideModel *model, SlideState *state, bool last) {
    const bool evaluated = last || slide_is_recurrent(model->predictor.family);
    if (!see(model, state) || (evaluated && !predict(model, state, *state->samples.count))) {
        return false;
    }
    if (evaluated) {
        model->predictor.family->accept(&model->predictor, &state->predictor);
    }
    return true;
}

/* A sample that is out of range leaves its number, once it is counted. */
static void watch_range(const SlideModel *model, SlideState *state) {
    if (!slide_in_range(model->sample, model->n_inputs, model->cosine)) {
        state->head->strayed = *state->samples.count;
    }
}

static void remember(const SlideModel *model, SlideState *state) {
    slide_samples_append(&model->samples, &state->samples, model->sample);
    watch_range(model, state);
}

/* What the derivatives of a step need of the state before it. */
static void keep(const SlideModel *model, SlideState *state, const SlideLastStep *step) {
    const SlideNetwork *network = &model->predictor;
    if (slide_is_recurrent(network->family)) {
        network->family->keep(network, &state->predictor, &state->before.predictor);
    }
    *state->last = *step;
}

static bool take(const SlideModel *model, SlideState *state, bool last) {
    bool good = advance(model, state, last);
    if (good) {
        remember(model, state);
    }
    return good;
}

static void accept_outputs(const SlideModel *model, SlideState *state) {
    memcpy(state->outputs, model->candidate, model->n_outputs * sizeof(double));
    state->head->current = 1;
}

/* Forget all samples; the present one counts for all. */
static void restart(const SlideModel *model, SlideState *state) {
    slide_samples_fill(&model->samples, &state->samples, model->sample);
    slide_network_restart(&model->predictor, &state->predictor, model->sample,
                          newest_sample(model, state));
    slide_estimate_restart(&model->estimator, &state->estimate);
    state->head->strayed = 0;
    watch_range(model, state);
}

/* The inputs of the step that begins now. */
static SlideStepInputs inputs_of_step(const SlideModel *model, const SlideState *state) {
    const bool moved = state->last->moved;
    return (SlideStepInputs){NULL, moved ? state->before.given : state->inputs,
                             moved ? state->before.rates : NULL,
                             slide_stream_parts(model, state->last->length)};
}

/* Take in samples one h apart, of the step that begins now. */
static bool take_in_turn(const SlideModel *model, SlideState *state, uint32_t count) {
    SlideStepInputs inputs = inputs_of_step(model, state);
    if (model->history.first_order && !slide_stream_fresh(state)) {
        memcpy(state->before.inputs, slide_history_newest(&model->history, &state->history),
               model->n_inputs * sizeof(double));
        inputs.from = state->before.inputs;
    }
    for (uint32_t left = count; left-- > 0;) {
        slide_step_sample(&model->history, &inputs, count, left, model->inputs);
        set_sample(model, model->inputs);
        if (!take(model, state, left == 0)) {
            return false;
        }
    }
    return true;
}

/* The step becomes the newest of the history, part by part. */
static void append(const SlideModel *model, SlideState *state) {
    const SlideHistoryShape *shape = &model->history;
    const SlideStepInputs inputs = inputs_of_step(model, state);
    if (inputs.rates == NULL) {
        slide_history_append(shape, &state->history, state->last->length, state->inputs,
                             SLIDE_JOIN_SAME);
        return;
    }
    for (uint32_t part = 0; part < inputs.parts.count; ++part) {
        slide_step_part(shape, &inputs, part, model->inputs);
        slide_history_append(shape, &state->history, slide_part_length(&inputs.parts, part),
                             model->inputs, part == 0 ? SLIDE_JOIN_SHORT : SLIDE_JOIN_NONE);
    }
}

/* Sample all the past that the networks see, up to the end of the newest step of the history. The
 * predictor sees its part of it. */
static bool take_anew(const SlideModel *model, SlideState *state) {
    SlideReader reader = slide_history_reader(&model->history, &state->history);
    uint32_t n_seen = model->predictor.n_samples;
    for (uint32_t left = model->memory_length; left > 0; --left) {
        double begin = -(double)left * model->step, end = -(double)(left - 1) * model->step;
        slide_history_sample(&reader, begin, end, model->inputs);
        set_sample(model, model->inputs);
        if (left == model->memory_length) {
            restart(model, state);
        }
        if (left > n_seen) {
            remember(model, state);
        } else if (!take(model, state, left == 1)) {
            return false;
        }
    }
    return true;
}

/* What is known of the inputs before the first step becomes the history. */
static void recall(const SlideModel *model, SlideState *state) {
    const bool window = state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN;
    const size_t n_inputs = model->n_inputs, count = window ? model->memory_length : 1;
    const double *rows = window ? state->window : slide_stream_prehistory(model, state);
    for (size_t sample = 0; sample < count; ++sample) {
        slide_history_append(&model->history, &state->history, model->step,
                             rows + sample * n_inputs, SLIDE_JOIN_NONE);
    }
}

static bool hold(const SlideModel *model, SlideState *state) {
    set_sample(model, slide_stream_prehistory(model, state));
    restart(model, state);
    for (uint64_t left = model->predictor.n_settling; left > 0; --left) {
        if (!advance(model, state, left == 1)) {
            return false;
        }
    }
    return true;
}

bool slide_stream_hold(const SlideModel *model, SlideState *state) {
    bool done;
    if (state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN) {
        recall(model, state);
        done = take_anew(model, state);
        *state->history.count = 0;
    } else {
        done = hold(model, state);
    }
    if (done) {
        accept_outputs(model, state);
    }
    return done;
}

/* Steps before the first one, where its inputs differ from those before: where these are known, or
 * its inputs move. */
static uint32_t count_before(const SlideModel *model, const SlideState *state) {
    if (!slide_stream_fresh(state)) {
        return 0;
    }
    if (state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN) {
        return model->memory_length;
    }
    return state->head->prehistory != SLIDE_FIRST_HELD || state->head->moving;
}

static bool begin(const SlideModel *model, SlideState *state) {
    bool done = true;
    if (count_before(model, state) > 0) {
        done = slide_stream_hold(model, state);
        recall(model, state);
    }
    return done;
}

/* The derivatives of the inputs count for this step only. */
static void begin_to_move(const SlideModel *model, SlideState *state) {
    const size_t row = model->n_inputs * sizeof(double);
    if (state->head->moving) {
        memcpy(state->before.given, state->inputs, row);
        memcpy(state->before.rates, state->rates, row);
        memset(state->rates, 0, row);
        state->head->moving = 0;
    }
}

static bool step_of(const SlideModel *model, SlideState *state, double length) {
    double count = nearbyint(length / model->step);
    bool whole = length == count * model->step && count <= model->n_in;
    uint32_t n_taken = whole ? (uint32_t)count : 0;
    SlideLastStep step = {length, n_taken, state->head->moving,
                          slide_stream_fresh(state) &&
                              state->head->prehistory == SLIDE_FIRST_HELD,
                          0};
    bool done = begin(model, state);
    if (!done) {
        return false;
    }
    keep(model, state, &step);
    begin_to_move(model, state);
    if (slide_stream_fresh(state)) {
        done = slide_stream_hold(model, state); /* the first sample of the step */
        done = done && (!whole || take_in_turn(model, state, n_taken - 1));
        append(model, state);
    } else if (whole) {
        done = take_in_turn(model, state, n_taken);
        append(model, state);
    } else {
        append(model, state);
        done = take_anew(model, state);
    }
    if (done) {
        accept_outputs(model, state);
        state->head->filled += whole ? count : length / model->step;
    }
    return done;
}

/* The most frequent step, of one sample; until all is found, it changes nothing that counts. */
static bool step_once(const SlideModel *model, SlideState *state) {
    set_sample(model, state->inputs);
    if (!see(model, state) || !predict(model, state, *state->samples.count)) {
        return false;
    }
    keep(model, state, &(SlideLastStep){.length = model->step, .n_taken = 1});
    model->predictor.family->accept(&model->predictor, &state->predictor);
    remember(model, state);
    accept_outputs(model, state);
    slide_history_append(&model->history, &state->history, model->step, state->inputs,
                         SLIDE_JOIN_SAME);
    state->head->filled += 1;
    return true;
}

bool slide_stream_step(const SlideModel *model, SlideState *state, double length) {
    if (length == model->step && !slide_stream_fresh(state) && !state->head->moving) {
        return step_once(model, state);
    }
    uint32_t n_parts = state->head->moving ? slide_stream_parts(model, length).count : 1;
    uint32_t n_next = n_parts + count_before(model, state);
    memcpy(state->backup, state->head, state->before_steps);
    slide_history_keep(&model->history, &state->history, n_next, state->steps);
    bool done = step_of(model, state, length);
    if (!done) {
        memcpy(state->head, state->backup, state->before_steps);
        slide_history_put_back(&model->history, &state->history, n_next, state->steps);
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
