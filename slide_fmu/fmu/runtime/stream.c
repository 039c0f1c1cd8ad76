#include "stream.h"

#include <math.h>
#include <string.h>

void slide_state_place(SlideState *state, const SlideModel *model, SlideArena *arena) {
    size_t n_inputs = model->n_inputs, n_outputs = model->n_outputs, start;
    state->head = slide_place(arena, 1, sizeof *state->head);
    start = arena->used - sizeof *state->head;
    state->inputs = slide_place(arena, n_inputs, sizeof(double));
    state->outputs = slide_place(arena, n_outputs, sizeof(double));
    state->errors = slide_place(arena, model->positions > 0 ? n_outputs : 0, sizeof(double));
    state->squares = slide_place(arena, model->positions * n_outputs, sizeof(double));
    state->before = slide_place(arena, SLIDE_BEFORE * n_inputs, sizeof(double));
    slide_network_state_place(&state->predictor, &model->predictor, arena);
    if (model->positions > 0) {
        slide_network_state_place(&state->estimator, &model->estimator, arena);
    }
    slide_history_place(&state->history, &model->history, arena);
    state->size = arena->used - start;
    state->backup = slide_place(arena, state->size, 1);
}

void slide_state_reset(const SlideModel *model, SlideState *state) {
    memset(state->head, 0, state->size);
    memcpy(state->inputs, model->starts, model->n_inputs * sizeof(double));
}

static double scaled(const SlideModel *model, size_t input, double value) {
    const SlideScaling *scaling = &model->input_scaling[input];
    return (value - scaling->offset) / scaling->scale;
}

bool slide_input_usable(const SlideModel *model, size_t input, double value) {
    return isfinite(value) && isfinite((float)scaled(model, input, value));
}

bool slide_stream_fresh(const SlideState *state) { return *state->history.count == 0; }

static void set_sample(const SlideModel *model, const double *inputs) {
    for (size_t i = 0; i < model->n_inputs; ++i) {
        model->sample[i] = scaled(model, i, inputs[i]);
    }
}

/* What the networks give with the present sample as their newest. */
static bool predict(const SlideModel *model, const SlideState *state, uint64_t sample) {
    bool finite = true;
    const float *values =
        slide_network_evaluate(&model->predictor, model->kernel, &state->predictor, sample);
    for (size_t i = 0; i < model->n_outputs; ++i) {
        const SlideScaling *scaling = &model->output_scaling[i];
        model->candidate[i] = values[i] * scaling->scale + scaling->offset;
        finite = finite && isfinite(model->candidate[i]);
    }
    return finite;
}

/* Squared error, relative to the output's scale, of an expected error and an eps: at most the
 * largest that the map knows. What is not finite stays so. */
static double squared_error(const SlideModel *model, double mean, double value) {
    double high = model->log_middle + model->log_half_range, largest = pow(10.0, 2 * high);
    double exponent = model->log_middle + model->log_half_range * value;
    double kept = exponent < -150 ? -150 : (exponent > high ? high : exponent);
    double square = mean * mean + pow(10.0, 2 * kept);
    if (!isfinite(mean) || !isfinite(value)) {
        return mean + value;
    }
    return square > largest ? largest : square;
}

static bool estimate(const SlideModel *model, const SlideState *state, uint64_t sample) {
    bool finite = true;
    double *squares = model->candidate + model->n_outputs;
    const float *values =
        slide_network_evaluate(&model->estimator, model->kernel, &state->estimator, sample);
    for (size_t i = 0; i < model->n_outputs; ++i) {
        double mean = model->n_means > 0 ? values[i] : 0;
        squares[i] = squared_error(model, mean, values[model->n_means + i]);
        finite = finite && isfinite(squares[i]);
    }
    return finite;
}

static void write_squares(const SlideModel *model, SlideState *state, size_t position) {
    size_t n_outputs = model->n_outputs;
    memcpy(state->squares + position * n_outputs, model->candidate + n_outputs,
           n_outputs * sizeof(double));
}

/* Which networks are evaluated at a sample; layers see every one. */
typedef struct {
    bool predictor, estimator;
} Due;

static bool see(const SlideModel *model, const SlideNetwork *network, SlideNetworkState *state,
                const double *before, uint64_t sample, bool due) {
    return (!due && network->kind == SLIDE_STATE_SPACE) ||
           slide_network_see(network, state, sample, model->sample, before);
}

static void accept_sample(const SlideModel *model, SlideState *state, Due due) {
    size_t n_inputs = model->n_inputs;
    if (due.predictor) {
        slide_network_accept(&model->predictor, &state->predictor);
    }
    if (due.estimator) {
        slide_network_accept(&model->estimator, &state->estimator);
    }
    for (size_t i = 0; i < n_inputs; ++i) {
        for (size_t age = SLIDE_BEFORE - 1; age > 0; --age) {
            state->before[age * n_inputs + i] = state->before[(age - 1) * n_inputs + i];
        }
        state->before[i] = model->sample[i];
    }
    state->head->samples += 1;
    if (due.estimator) {
        write_squares(model, state, (size_t)(state->head->samples % model->positions));
    }
}

/* Take in model->sample. Layers write to the slot of the oldest sample, which no later window
 * needs: when this fails, the state is what it was. */
static bool take(const SlideModel *model, SlideState *state, Due due) {
    uint64_t sample = state->head->samples + 1;
    const double *before = state->before;
    bool estimates = model->positions > 0;
    due.estimator = due.estimator && estimates;
    if (!see(model, &model->predictor, &state->predictor, before, sample, due.predictor) ||
        (estimates &&
         !see(model, &model->estimator, &state->estimator, before, sample, due.estimator))) {
        return false;
    }
    if ((due.predictor && !predict(model, state, sample)) ||
        (due.estimator && !estimate(model, state, sample))) {
        return false;
    }
    accept_sample(model, state, due);
    return true;
}

/* Take over the outputs and the root of the mean square over all positions. */
static void accept(const SlideModel *model, SlideState *state) {
    size_t n_outputs = model->n_outputs;
    memcpy(state->outputs, model->candidate, n_outputs * sizeof(double));
    for (size_t i = 0; model->positions > 0 && i < n_outputs; ++i) {
        double sum = 0;
        for (size_t position = 0; position < model->positions; ++position) {
            sum += state->squares[position * n_outputs + i];
        }
        state->errors[i] = sqrt(sum / model->positions) * model->output_scaling[i].scale;
    }
    state->head->current = 1;
}

/* Forget all samples; the present one counts for those before the next. */
static void restart(const SlideModel *model, SlideState *state) {
    for (size_t age = 0; age < SLIDE_BEFORE; ++age) {
        memcpy(state->before + age * model->n_inputs, model->sample,
               model->n_inputs * sizeof(double));
    }
    slide_network_restart(&model->predictor, &state->predictor, model->sample, state->before);
    if (model->positions > 0) {
        slide_network_restart(&model->estimator, &state->estimator, model->sample, state->before);
    }
    state->head->samples = 0;
}

/* Samples that a network must see after a restart: its last positions with layers, and the
 * inputs before them with cells, n_filled times n_samples in all. */
static uint64_t samples_for(const SlideNetwork *network, uint32_t positions, uint32_t n_filled) {
    return network->kind == SLIDE_STATE_SPACE
               ? (uint64_t)network->n_samples * n_filled + positions - 1
               : positions;
}

bool slide_stream_hold(const SlideModel *model, SlideState *state) {
    uint64_t predictor = samples_for(&model->predictor, 1, 2);
    uint64_t estimator = model->positions > 0 ? samples_for(&model->estimator, 1, 2) : 0;
    set_sample(model, state->inputs);
    restart(model, state);
    for (uint64_t left = predictor > estimator ? predictor : estimator; left > 0; --left) {
        if (!take(model, state, (Due){left <= predictor, left <= estimator})) {
            return false;
        }
    }
    for (size_t position = 0; position < model->positions; ++position) {
        write_squares(model, state, position);
    }
    accept(model, state);
    return true;
}

/* Take in samples one h apart, of the step that begins now. */
static bool take_in_turn(const SlideModel *model, SlideState *state, uint32_t count) {
    bool ramp = model->history.ramp && !slide_stream_fresh(state);
    const double *from =
        ramp ? slide_history_newest(&model->history, &state->history) : state->inputs;
    for (uint32_t left = count; left-- > 0;) {
        double part = (double)left / count;
        for (size_t i = 0; i < model->n_inputs; ++i) {
            model->inputs[i] = state->inputs[i] - part * (state->inputs[i] - from[i]);
        }
        set_sample(model, model->inputs);
        bool needed = left == 0 || model->predictor.kind == SLIDE_STATE_SPACE;
        if (!take(model, state, (Due){needed, true})) {
            return false;
        }
    }
    return true;
}

/* Sample all the past that the networks see, up to the end of the newest step of the history. */
static bool take_anew(const SlideModel *model, SlideState *state) {
    SlideReader reader = slide_history_reader(&model->history, &state->history);
    uint64_t predictor = samples_for(&model->predictor, 1, 1);
    uint64_t estimator =
        model->positions > 0 ? samples_for(&model->estimator, model->positions, 1) : 0;
    for (uint64_t n = (uint64_t)model->n_in + SLIDE_BEFORE, left = n; left > 0; --left) {
        double begin = -(double)left * model->step, end = -(double)(left - 1) * model->step;
        slide_history_sample(&reader, begin, end, model->inputs);
        set_sample(model, model->inputs);
        if (left == n) {
            restart(model, state);
        }
        if (!take(model, state, (Due){left <= predictor, left <= estimator})) {
            return false;
        }
    }
    return true;
}

static bool step_of(const SlideModel *model, SlideState *state, double length) {
    double count = nearbyint(length / model->step);
    bool whole = length == count * model->step && count <= model->n_in;
    bool done = true;
    if (slide_stream_fresh(state)) {
        done = slide_stream_hold(model, state); /* the first sample of the step */
        done = done && (!whole || take_in_turn(model, state, (uint32_t)count - 1));
        slide_history_append(&model->history, &state->history, length, state->inputs);
    } else if (whole) {
        done = take_in_turn(model, state, (uint32_t)count);
        slide_history_append(&model->history, &state->history, length, state->inputs);
    } else {
        slide_history_append(&model->history, &state->history, length, state->inputs);
        done = take_anew(model, state);
    }
    if (done) {
        accept(model, state);
        state->head->filled += whole ? count : length / model->step;
    }
    return done;
}

bool slide_stream_step(const SlideModel *model, SlideState *state, double length) {
    if (length == model->step && !slide_stream_fresh(state)) { /* undoes itself */
        set_sample(model, state->inputs);
        if (!take(model, state, (Due){true, true})) {
            return false;
        }
        accept(model, state);
        slide_history_append(&model->history, &state->history, length, state->inputs);
        state->head->filled += 1;
        return true;
    }
    memcpy(state->backup, state->head, state->size);
    bool done = step_of(model, state, length);
    if (!done) {
        memcpy(state->head, state->backup, state->size);
    }
    return done;
}
