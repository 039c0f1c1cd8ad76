#include "stream.h"

#include <math.h>
#include <string.h>

void slide_state_place(SlideState *state, const SlideModel *model, SlideArena *arena) {
    size_t n_outputs = model->n_outputs, start;
    state->head = slide_place(arena, 1, sizeof *state->head);
    start = arena->used - sizeof *state->head;
    state->inputs = slide_place(arena, model->n_inputs, sizeof(double));
    state->outputs = slide_place(arena, n_outputs, sizeof(double));
    state->errors = slide_place(arena, model->positions > 0 ? n_outputs : 0, sizeof(double));
    state->squares = slide_place(arena, model->positions * n_outputs, sizeof(double));
    state->ring =
        slide_place(arena, (size_t)model->capacity * 2 * model->n_inputs, sizeof(float));
    state->size = arena->used - start;
}

void slide_state_reset(const SlideModel *model, SlideState *state) {
    memset(state->head, 0, state->size);
    for (size_t i = 0; i < model->n_inputs; ++i) {
        double low = model->input_scaling[i].offset - model->input_scaling[i].scale;
        double high = model->input_scaling[i].offset + model->input_scaling[i].scale;
        state->inputs[i] = low > 0 ? low : (high < 0 ? high : 0);
    }
}

static float scaled(const SlideModel *model, size_t input, double value) {
    const SlideScaling *scaling = &model->input_scaling[input];
    return (float)((value - scaling->offset) / scaling->scale);
}

bool slide_input_usable(const SlideModel *model, size_t input, double value) {
    return isfinite(value) && isfinite(scaled(model, input, value));
}

static void write_slot(const SlideModel *model, SlideState *state, size_t slot) {
    size_t n_inputs = model->n_inputs;
    float *first = state->ring + slot * n_inputs;
    for (size_t i = 0; i < n_inputs; ++i) {
        first[i] = scaled(model, i, state->inputs[i]);
    }
    memcpy(first + model->capacity * n_inputs, first, n_inputs * sizeof(float));
}

static const float *window_ending_at(const SlideModel *model, const SlideState *state, size_t slot,
                                     uint32_t n_samples) {
    return state->ring + (slot + model->capacity + 1 - n_samples) * model->n_inputs;
}

/* Squared error, relative to the output's scale; the exponent is kept where squares are finite. */
static double squared_error(const SlideModel *model, double value) {
    double exponent = model->log_middle + model->log_half_range * value;
    double kept = exponent < -150 ? -150 : (exponent > 150 ? 150 : exponent);
    return isfinite(value) ? pow(10.0, 2 * kept) : value;
}

/* Fill model->candidate from the window that ends at a slot; false when it is not finite. */
static bool evaluate(const SlideModel *model, const SlideState *state, size_t slot) {
    size_t n_outputs = model->n_outputs;
    bool finite = true;
    const float *window = window_ending_at(model, state, slot, model->predictor.n_samples);
    const float *values = slide_network_evaluate(&model->predictor, model->kernel, window);
    for (size_t i = 0; i < n_outputs; ++i) {
        const SlideScaling *scaling = &model->output_scaling[i];
        model->candidate[i] = values[i] * scaling->scale + scaling->offset;
        finite = finite && isfinite(model->candidate[i]);
    }
    if (model->positions == 0) {
        return finite;
    }
    window = window_ending_at(model, state, slot, model->estimator.n_samples);
    values = slide_network_evaluate(&model->estimator, model->kernel, window);
    for (size_t i = 0; i < n_outputs; ++i) {
        double mean = model->n_means > 0 ? values[i] : 0;
        double square = mean * mean + squared_error(model, values[model->n_means + i]);
        model->candidate[n_outputs + i] = square;
        finite = finite && isfinite(model->candidate[n_outputs + i]);
    }
    return finite;
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

static void write_squares(const SlideModel *model, SlideState *state, size_t position) {
    size_t n_outputs = model->n_outputs;
    memcpy(state->squares + position * n_outputs, model->candidate + n_outputs,
           n_outputs * sizeof(double));
}

bool slide_stream_hold(const SlideModel *model, SlideState *state) {
    for (size_t slot = 0; slot < model->capacity; ++slot) {
        write_slot(model, state, slot);
    }
    if (!evaluate(model, state, 0)) {
        return false;
    }
    for (size_t position = 0; position < model->positions; ++position) {
        write_squares(model, state, position);
    }
    accept(model, state);
    return true;
}

/* The slot written here holds the oldest input, which no later window needs: a step that fails and
 * is tried again finds the window as it was. */
bool slide_stream_step(const SlideModel *model, SlideState *state) {
    SlideHead *head = state->head;
    if (head->steps == 0) {
        if (!slide_stream_hold(model, state)) {
            return false;
        }
    } else {
        size_t slot = (size_t)(head->steps % model->capacity);
        write_slot(model, state, slot);
        if (!evaluate(model, state, slot)) {
            return false;
        }
        if (model->positions > 0) {
            write_squares(model, state, (size_t)(head->steps % model->positions));
        }
        accept(model, state);
    }
    head->steps += 1;
    return true;
}
