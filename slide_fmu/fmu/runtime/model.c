#include "model.h"

#include <string.h>

static SlideScaling *place_scaling(const unsigned char *rows, size_t row_size, uint32_t channels,
                                   SlideArena *arena) {
    SlideScaling *scaling = slide_place(arena, channels, sizeof *scaling);
    for (size_t i = 0; arena->base != NULL && i < channels; ++i) {
        scaling[i].offset = slide_f64(rows + row_size * i);
        scaling[i].scale = slide_f64(rows + row_size * i + 8);
    }
    return scaling;
}

static double *place_starts(const SlidePayload *payload, SlideArena *arena) {
    double *starts = slide_place(arena, payload->n_inputs, sizeof *starts);
    for (size_t i = 0; arena->base != NULL && i < payload->n_inputs; ++i) {
        starts[i] = slide_f64(payload->input_scaling + SLIDE_INPUT_ROW * i + 16);
    }
    return starts;
}

void slide_model_place(SlideModel *model, const SlidePayload *payload, SlideArena *arena) {
    model->step = payload->step;
    model->n_inputs = payload->n_inputs;
    model->n_outputs = payload->n_outputs;
    model->n_in = payload->n_in;
    model->positions = 0;
    model->input_scaling =
        place_scaling(payload->input_scaling, SLIDE_INPUT_ROW, payload->n_inputs, arena);
    model->output_scaling =
        place_scaling(payload->output_scaling, SLIDE_OUTPUT_ROW, payload->n_outputs, arena);
    model->starts = place_starts(payload, arena);
    slide_network_place(&model->predictor, &payload->predictor, payload->n_outputs, arena);
    if (payload->has_estimator) {
        const SlideNetworkView *view = &payload->estimator;
        slide_network_place(&model->estimator, view, view->n_values, arena);
        model->n_means = view->n_values - payload->n_outputs;
        model->positions = payload->positions;
        model->log_middle = 0.5 * (payload->high + payload->low);
        model->log_half_range = 0.5 * (payload->high - payload->low);
    }
    model->history = slide_history_shape(payload->n_inputs, payload->n_in + SLIDE_BEFORE,
                                         payload->step, payload->ramp);
    model->inputs = slide_place(arena, payload->n_inputs, sizeof(double));
    model->sample = slide_place(arena, payload->n_inputs, sizeof(double));
    model->candidate = slide_place(arena, (size_t)payload->n_outputs * 2, sizeof(double));
    model->kernel = slide_kernel_choose();
    memcpy(model->guid, payload->guid, sizeof model->guid);
}
