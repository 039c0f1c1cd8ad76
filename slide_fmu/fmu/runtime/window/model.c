#include "model.h"

#include <math.h>
#include <string.h>

static SlideScaling *place_scaling(const unsigned char *rows, size_t row_size, uint32_t channels,
                                   SlideArena *arena) {
    SlideScaling *scaling = slide_place(arena, channels, sizeof *scaling);
    for (size_t i = 0; arena->base != NULL && i < channels; ++i) {
        scaling[i].offset = slide_f64(rows + row_size * i);
        scaling[i].scale = slide_f64(rows + row_size * i + 8);
        scaling[i].factor = 1 / scaling[i].scale;
    }
    return scaling;
}

static void place_output_ranges(SlideModel *model, const SlidePayload *payload,
                                SlideArena *arena) {
    const size_t count = payload->output_ranges == NULL ? 0 : 2 * (size_t)payload->n_outputs;
    double *ranges = count == 0 ? NULL : slide_place(arena, count, sizeof *ranges);
    for (size_t i = 0; arena->base != NULL && i < count; ++i) {
        ranges[i] = slide_f64(payload->output_ranges + 8 * i);
    }
    model->has_output_ranges = count > 0;
    model->output_ranges = ranges;
}

static void place_inputs(SlideModel *model, const SlidePayload *payload, SlideArena *arena) {
    model->starts = slide_place(arena, payload->n_inputs, sizeof *model->starts);
    model->cosine = slide_place(arena, payload->n_inputs, sizeof *model->cosine);
    for (size_t i = 0; arena->base != NULL && i < payload->n_inputs; ++i) {
        model->starts[i] = slide_f64(payload->input_scaling + SLIDE_INPUT_ROW * i + 16);
        model->cosine[i] = slide_angle_of(payload, i) == SLIDE_COSINE;
    }
}

/* Many importers go by milliseconds. */
static uint32_t most_phases(double step) {
    const double milliseconds = nearbyint(1000 * step);
    const bool whole = fabs(1000 * step - milliseconds) <= 1e-5 * milliseconds;
    return whole && milliseconds > SLIDE_USUAL_PHASES && milliseconds <= SLIDE_MOST_PHASES
               ? (uint32_t)milliseconds
               : SLIDE_USUAL_PHASES;
}

/* How much of the past is kept: samples for the estimator and the error bound, which catch up;
 * steps for all networks, for a phase of time that they come to for the first time. */
static void shape_past(SlideModel *model, const SlidePayload *payload, uint32_t steps_per_sample) {
    const SlideEstimator *estimator = &model->estimator;
    const uint64_t estimated = estimator->positions > 0 ? estimator->memory_length : 1;
    const uint64_t lengths[] = {payload->n_in, estimated, model->bound.memory_length};
    uint64_t longest = 0;
    for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; ++i) {
        longest = lengths[i] > longest ? lengths[i] : longest;
    }
    model->memory_length = (uint32_t)longest + SLIDE_BEFORE;
    model->n_unsettled = payload->first_order ? 0 : SLIDE_UNSETTLED;
    model->n_kept = payload->first_order ? 0 : SLIDE_KEPT_SIZE(payload->n_inputs);
    model->most_open = payload->n_in + model->n_unsettled;
    model->n_redone = model->memory_length + model->most_open;
    const uint32_t most = most_phases(payload->step);
    model->n_phases = steps_per_sample < most ? steps_per_sample : most;
    /* one that fails may have taken in as many again */
    model->samples = (SlideSamplesShape){payload->n_inputs,
                                         slide_power_of_two(model->n_redone + model->most_open)};
    const bool doubted = model->bound.memory_length > 0 && model->bound.doubt > 0;
    const bool apart = model->bound.memory_length > 0 && (doubted || !payload->first_order);
    model->others = (SlideSamplesShape){payload->n_inputs, apart ? model->samples.capacity : 0};
    model->history =
        slide_history_shape(payload->n_inputs, model->memory_length + model->n_unsettled,
                            payload->step, steps_per_sample, payload->first_order,
                            payload->first_order && (doubted || payload->forecast.jumps), model->cosine,
                            model->forecast.low, model->forecast.high);
}

void slide_model_place(SlideModel *model, const SlidePayload *payload, uint32_t steps_per_sample,
                       SlideArena *arena) {
    model->kernel = slide_kernel(0);
    model->step = payload->step;
    model->n_inputs = payload->n_inputs;
    model->n_outputs = payload->n_outputs;
    model->n_in = payload->n_in;
    model->input_scaling =
        place_scaling(payload->input_scaling, SLIDE_INPUT_ROW, payload->n_inputs, arena);
    model->output_scaling =
        place_scaling(payload->output_scaling, SLIDE_OUTPUT_ROW, payload->n_outputs, arena);
    place_inputs(model, payload, arena);
    slide_network_place(&model->predictor, &payload->predictor, payload->n_outputs, arena);
    slide_parameters_place(&model->parameters, &payload->parameters, arena);
    slide_estimator_place(&model->estimator, payload, arena);
    slide_bound_place(&model->bound, payload, arena);
    slide_forecast_place(&model->forecast, payload, arena);
    shape_past(model, payload, steps_per_sample);
    model->at_step_end = payload->forecast.at_step_end;
    place_output_ranges(model, payload, arena);
    model->inputs = slide_place(arena, payload->n_inputs, sizeof(double));
    model->end = slide_place(arena, payload->n_inputs, sizeof(double));
    model->missed = slide_place(arena, payload->n_inputs, sizeof(double));
    model->corrected = slide_place(arena, payload->n_inputs, sizeof(double));
    model->others_taken = slide_place(arena, model->others.capacity > 0 ? model->n_redone + 1 : 0,
                                      payload->n_inputs * sizeof(double));
    model->taken = slide_place(arena, model->n_redone + 1, payload->n_inputs * sizeof(double));
    model->moments = slide_place(arena, (size_t)(model->n_redone + 1) * SLIDE_MOMENTS,
                                 payload->n_inputs * sizeof(double));
    model->edges = slide_place(arena, (size_t)(model->n_redone + 1) * 2,
                               payload->n_inputs * sizeof(double));
    model->strays = slide_place(arena, model->n_redone, sizeof *model->strays);
    model->given = slide_place(arena, payload->n_outputs, sizeof(float));
    if (slide_is_recurrent(model->predictor.family)) {
        model->predictor.family->place_before(&model->between, &model->predictor, arena);
    }
    model->missing = slide_place(arena, payload->n_outputs, sizeof(double));
    model->candidate = slide_place(arena, payload->n_outputs, sizeof(double));
    if (slide_shows_state(model)) {
        slide_first_state_place(&model->first, &model->predictor, arena);
        model->known_values =
            slide_place(arena, model->memory_length, payload->n_outputs * sizeof(double));
    }
    memcpy(model->guid, payload->guid, sizeof model->guid);
}
