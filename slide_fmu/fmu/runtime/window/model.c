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

static double *place_starts(const SlidePayload *payload, SlideArena *arena) {
    double *starts = slide_place(arena, payload->n_inputs, sizeof *starts);
    for (size_t i = 0; arena->base != NULL && i < payload->n_inputs; ++i) {
        starts[i] = slide_f64(payload->input_scaling + SLIDE_INPUT_ROW * i + 16);
    }
    return starts;
}

static bool *place_cosines(const SlidePayload *payload, SlideArena *arena) {
    bool *cosine = slide_place(arena, payload->n_inputs, sizeof *cosine);
    for (size_t i = 0; arena->base != NULL && i < payload->n_inputs; ++i) {
        cosine[i] = slide_angle_of(payload, i) == SLIDE_COSINE;
    }
    return cosine;
}

/* How much of the past is kept: samples for the estimator, which catches up; steps for both
 * networks, for steps after which all samples are others. */
static void shape_past(SlideModel *model, const SlidePayload *payload) {
    uint32_t reach = model->estimator.positions > 0 ? (uint32_t)model->estimator.reach : 1;
    uint32_t n_seen = reach > payload->n_in ? reach : payload->n_in;
    model->n_sampled = n_seen + SLIDE_BEFORE;
    model->samples =
        (SlideSamplesShape){payload->n_inputs, slide_power_of_two((uint64_t)model->n_sampled)};
    model->history = slide_history_shape(payload->n_inputs, model->n_sampled, payload->step,
                                         payload->ramp, model->cosine);
}

static void place_derivative(SlideModel *model, SlideArena *arena) {
    SlideDerivativeScratch *scratch = &model->derivative;
    const size_t row = model->n_inputs * sizeof(double);
    const size_t results = 3 * model->n_outputs * sizeof(double);
    model->predictor.family->place_exact(&scratch->predictor, &model->predictor, arena);
    if (model->estimator.positions > 0) {
        model->estimator.network.family->place_exact(&scratch->estimator,
                                                     &model->estimator.network, arena);
    }
    scratch->samples = slide_place(arena, (size_t)model->n_sampled + SLIDE_BEFORE, row);
    scratch->given = slide_place(arena, 1, row);
    scratch->from = slide_place(arena, 1, row);
    scratch->sample = slide_place(arena, 1, row);
    scratch->results[0] = slide_place(arena, 1, results);
    scratch->results[1] = slide_place(arena, 1, results);
    scratch->direction = slide_place(arena, 1, row);
    scratch->slopes = slide_place(arena, 1, results);
}

void slide_model_place(SlideModel *model, const SlidePayload *payload, SlideArena *arena) {
    model->kernel = slide_kernel_choose();
    model->step = payload->step;
    model->n_inputs = payload->n_inputs;
    model->n_outputs = payload->n_outputs;
    model->n_in = payload->n_in;
    model->n_block = 1;
    model->input_scaling =
        place_scaling(payload->input_scaling, SLIDE_INPUT_ROW, payload->n_inputs, arena);
    model->output_scaling =
        place_scaling(payload->output_scaling, SLIDE_OUTPUT_ROW, payload->n_outputs, arena);
    model->starts = place_starts(payload, arena);
    model->cosine = place_cosines(payload, arena);
    slide_network_place(&model->predictor, &payload->predictor, payload->n_outputs, arena);
    slide_estimator_place(&model->estimator, payload, arena);
    shape_past(model, payload);
    model->inputs = slide_place(arena, payload->n_inputs, sizeof(double));
    model->sample = slide_place(arena, payload->n_inputs, sizeof(double));
    model->candidate = slide_place(arena, payload->n_outputs, sizeof(double));
    place_derivative(model, arena);
    memcpy(model->guid, payload->guid, sizeof model->guid);
}

void slide_model_place_block(SlideModel *model, const SlidePayload *payload, SlideArena *arena) {
    model->n_block = slide_network_block_size(&payload->predictor, payload->n_outputs);
    slide_network_place_block(&model->predictor, &payload->predictor, payload->n_outputs,
                              arena);
}
