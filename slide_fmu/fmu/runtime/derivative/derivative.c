#include "derivative.h"

#include <string.h>

void slide_derivative_scratch_place(SlideDerivativeScratch *scratch, const SlideNetwork *network,
                                    size_t n_inputs, size_t n_outputs, SlideArena *arena) {
    const size_t row = n_inputs * sizeof(double);
    if (network->kind == SLIDE_STATE_SPACE) {
        slide_cells_derivative_place(&scratch->cells, &network->cells, arena);
    } else {
        slide_layers_derivative_place(&scratch->layers, &network->layers, arena);
    }
    scratch->sample = slide_place(arena, 1, row);
    scratch->d_sample = slide_place(arena, 1, row);
    scratch->inputs = slide_place(arena, 1 + SLIDE_BEFORE, row);
    scratch->d_inputs = slide_place(arena, 1 + SLIDE_BEFORE, row);
    scratch->d_values = slide_place(arena, n_outputs, sizeof(double));
    scratch->zeros = slide_place(arena, 1, row);
    scratch->direction = slide_place(arena, 1, row);
    scratch->column = slide_place(arena, n_outputs, sizeof(double));
}

/* The sample becomes the newest of those that features see. */
static void push(const SlideModel *model) {
    const SlideDerivativeScratch *scratch = &model->derivative;
    const size_t n = model->n_inputs, kept = SLIDE_BEFORE * n * sizeof(double);
    memmove(scratch->inputs + n, scratch->inputs, kept);
    memmove(scratch->d_inputs + n, scratch->d_inputs, kept);
    for (size_t i = 0; i < n; ++i) {
        scratch->inputs[i] = slide_scaled(model, i, scratch->sample[i]);
        scratch->d_inputs[i] = scratch->d_sample[i] * model->input_scaling[i].factor;
    }
}

/* The sample counts for all before it. */
static void push_for_all(const SlideModel *model) {
    for (size_t i = 0; i <= SLIDE_BEFORE; ++i) {
        push(model);
    }
}

/* The network goes on by the newest input; left: samples of the step after it. */
static void take(const SlideModel *model, uint32_t left) {
    const SlideNetwork *network = &model->predictor;
    const SlideDerivativeScratch *scratch = &model->derivative;
    if (network->kind == SLIDE_STATE_SPACE) {
        const double *values = slide_cells_derivative_take(
            &network->cells, &scratch->cells, scratch->inputs, scratch->d_inputs);
        memcpy(scratch->d_values, values, model->n_outputs * sizeof *values);
    } else {
        slide_layers_derivative_see(&network->layers, &scratch->layers, left, scratch->inputs,
                                    scratch->d_inputs);
    }
}

/* From what was before the first sample; of cells, from these states. */
static void start(const SlideModel *model, const float *states, uint64_t taken) {
    const SlideNetwork *network = &model->predictor;
    if (network->kind == SLIDE_STATE_SPACE) {
        slide_cells_derivative_start(&network->cells, &model->derivative.cells, states, taken);
    } else {
        slide_layers_derivative_start(&network->layers, &model->derivative.layers);
    }
}

/* As slide_stream_hold, and the samples of the first step, which are the same: until cells have
 * seen 2 n_samples and those, layers their whole window. */
static void hold_again(const SlideModel *model, const double *inputs, const double *d_inputs,
                       uint32_t n_further) {
    const SlideDerivativeScratch *scratch = &model->derivative;
    uint64_t count = 2 * (uint64_t)model->predictor.n_samples + n_further;
    memcpy(scratch->sample, inputs, model->n_inputs * sizeof *inputs);
    memcpy(scratch->d_sample, d_inputs, model->n_inputs * sizeof *inputs);
    push_for_all(model);
    start(model, NULL, 0);
    while (count-- > 0) {
        take(model, (uint32_t)count);
    }
}

/* Inputs that cells had taken in before the last step. */
static uint64_t n_inputs_of_cells(const SlideModel *model, const SlideBeforeStep *before) {
    return model->predictor.kind == SLIDE_STATE_SPACE ? *before->cells.taken : 0;
}

/* What was before the step: samples that stay, or, before the first one, its own inputs. */
static void start_before_step(const SlideModel *model, const SlideState *state,
                              const double *d_inputs) {
    const SlideDerivativeScratch *scratch = &model->derivative;
    const SlideBeforeStep *before = &state->before;
    const size_t row = model->n_inputs * sizeof(double);
    if (state->last->began) {
        hold_again(model, before->given, d_inputs, 0);
        return;
    }
    memcpy(scratch->inputs, before->samples, SLIDE_BEFORE * row);
    memset(scratch->d_inputs, 0, SLIDE_BEFORE * row);
    start(model, before->cells.states, n_inputs_of_cells(model, before));
}

/* How inputs appended with a part of the last step move, when those that were set do. */
static void move_part(const SlideModel *model, const SlideState *state, uint32_t part,
                      const double *d_inputs, double *d_part) {
    const SlideParts parts = slide_stream_parts(model, state->last->length);
    if (state->last->moved) {
        slide_moved_slope(&model->history, state->before.given, state->before.rates,
                          slide_part_time(&parts, part), d_inputs, d_part);
    } else {
        memcpy(d_part, d_inputs, model->n_inputs * sizeof *d_inputs);
    }
}

/* How all inputs before the last step move with those that were set. */
static const double *move_before(const SlideModel *model, const SlideState *state,
                                 const double *d_inputs) {
    return state->last->began ? d_inputs : model->derivative.zeros;
}

/* As take_in_turn of stream.c. */
static void take_in_turn_again(const SlideModel *model, const SlideState *state,
                               const double *d_inputs, uint32_t count) {
    const SlideHistoryShape *shape = &model->history;
    const SlideDerivativeScratch *scratch = &model->derivative;
    const SlideBeforeStep *before = &state->before;
    const SlideParts parts = slide_stream_parts(model, state->last->length);
    const double *reached = slide_history_newest(shape, &state->history);
    start_before_step(model, state, d_inputs);
    for (uint32_t left = count; left-- > 0;) {
        uint32_t part = shape->ramp ? 0 : count - 1 - left;
        memcpy(scratch->sample, reached, model->n_inputs * sizeof *reached);
        move_part(model, state, part, d_inputs, scratch->d_sample);
        if (shape->ramp && count > 1) {
            double rest = (double)left / count;
            slide_history_between(shape, before->inputs, reached, rest, scratch->sample);
            slide_history_between_slope(shape, before->inputs, reached, rest,
                                        move_before(model, state, d_inputs), scratch->d_sample,
                                        scratch->d_sample);
        } else if (state->last->moved && !shape->ramp) {
            slide_moved(shape, before->given, before->rates, slide_part_time(&parts, part),
                        scratch->sample);
        }
        push(model);
        take(model, left);
    }
}

/* How the sample read last moves with the inputs that were set. */
static void move_sample(const SlideModel *model, const SlideState *state,
                        const SlideReader *reader, double begin, double end,
                        const double *d_inputs, double *d_sample) {
    const double *d_before = move_before(model, state, d_inputs);
    uint64_t after = reader->at + slide_stream_parts(model, state->last->length).count;
    uint64_t first = *state->history.count; /* of the parts, where after is as much */
    if (model->history.ramp) {
        move_part(model, state, 0, d_inputs, d_sample);
        slide_history_ramp_slope(reader, end, d_before, d_sample, d_sample);
    } else if (state->last->moved && after >= first) {
        move_part(model, state, (uint32_t)(after - first), d_inputs, d_sample);
    } else {
        bool newest = !state->last->moved && slide_history_is_newest(reader, begin);
        memcpy(d_sample, newest ? d_inputs : d_before, model->n_inputs * sizeof *d_inputs);
    }
}

/* As take_anew of stream.c. */
static void take_anew_again(const SlideModel *model, const SlideState *state,
                            const double *d_inputs) {
    const SlideDerivativeScratch *scratch = &model->derivative;
    SlideReader reader = slide_history_reader(&model->history, &state->history);
    start(model, NULL, 0);
    for (uint32_t left = model->n_sampled; left > 0; --left) {
        double begin = -(double)left * model->step, end = -(double)(left - 1) * model->step;
        slide_history_sample(&reader, begin, end, scratch->sample);
        move_sample(model, state, &reader, begin, end, d_inputs, scratch->d_sample);
        if (left == model->n_sampled) {
            push_for_all(model);
        } else {
            push(model);
        }
        if (left <= model->predictor.n_samples) {
            take(model, left - 1);
        }
    }
}

static void do_last_step_again(const SlideModel *model, const SlideState *state,
                               const double *d_inputs) {
    const uint64_t steps = *state->history.count;
    const uint32_t taken = state->last->n_taken, n_taken = taken < model->n_in ? taken : model->n_in;
    if (steps == 0) {
        hold_again(model, state->inputs, d_inputs, 0);
    } else if (steps == 1) {
        hold_again(model, slide_history_newest(&model->history, &state->history), d_inputs,
                   n_taken > 0 ? n_taken - 1 : 0);
    } else if (n_taken > 0) {
        take_in_turn_again(model, state, d_inputs, n_taken);
    } else {
        take_anew_again(model, state, d_inputs);
    }
}

/* The slopes of what the network gives, scaled. */
static void evaluate(const SlideModel *model, const SlideState *state) {
    const SlideDerivativeScratch *scratch = &model->derivative;
    const SlideLayers *layers = &model->predictor.layers;
    if (model->predictor.kind == SLIDE_STATE_SPACE) {
        return; /* cells give them with every input */
    }
    const float *slopes =
        slide_layers_derivative_evaluate(layers, &scratch->layers, model->kernel,
                                         &state->predictor.layers, *state->samples.count - 1);
    for (size_t i = 0; i < model->n_outputs; ++i) {
        scratch->d_values[i] = slopes[i];
    }
}

void slide_directional_derivative(const SlideModel *model, const SlideState *state,
                                  const double *d_inputs, double *d_outputs) {
    if (slide_stream_fresh(state) && state->head->prehistory != SLIDE_FIRST_HELD) {
        memset(d_outputs, 0, model->n_outputs * sizeof *d_outputs);
        return; /* no input was taken in yet */
    }
    do_last_step_again(model, state, d_inputs);
    evaluate(model, state);
    for (size_t i = 0; i < model->n_outputs; ++i) {
        d_outputs[i] = model->derivative.d_values[i] * model->output_scaling[i].scale;
    }
}
