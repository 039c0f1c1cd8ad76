#include "model.h"

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

/* How much of the past is kept: samples for the estimator and the error bound, which catch up;
 * steps for all networks, for steps after which all samples are others. */
static void shape_past(SlideModel *model, const SlidePayload *payload) {
    const SlideEstimator *estimator = &model->estimator;
    const uint64_t estimated = estimator->positions > 0 ? estimator->memory_length : 1;
    const uint64_t lengths[] = {payload->n_in, estimated, model->bound.memory_length};
    const uint32_t n_forecast = payload->first_order ? payload->n_in : 0;
    uint64_t longest = 0;
    for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; ++i) {
        longest = lengths[i] > longest ? lengths[i] : longest;
    }
    model->memory_length = (uint32_t)longest + SLIDE_BEFORE;
    model->n_redone = model->memory_length + n_forecast;
    /* Both are evaluated up to where a forecast begins, too, when that is behind. */
    const bool catch_up = estimator->positions > 0 || model->bound.memory_length > 0;
    const uint64_t n_kept = catch_up ? model->n_redone : model->memory_length;
    model->samples = (SlideSamplesShape){payload->n_inputs, slide_power_of_two(n_kept)};
    model->history = slide_history_shape(payload->n_inputs, model->memory_length, payload->step,
                                         payload->first_order, model->cosine);
}

void slide_model_place(SlideModel *model, const SlidePayload *payload, SlideArena *arena) {
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
    slide_bound_place_plain(&model->plain_bound, &model->bound, payload, arena);
    shape_past(model, payload);
    slide_forecast_place(&model->forecast, payload, arena);
    model->at_step_end = payload->forecast.at_step_end;
    place_output_ranges(model, payload, arena);
    model->inputs = slide_place(arena, payload->n_inputs, sizeof(double));
    model->taken = slide_place(arena, model->n_redone, payload->n_inputs * sizeof(double));
    model->candidate = slide_place(arena, payload->n_outputs, sizeof(double));
    model->predicted = slide_place(arena, payload->n_outputs, sizeof(float));
    memcpy(model->guid, payload->guid, sizeof model->guid);
}
