#include "parameter_slopes.h"

#include <math.h>
#include <string.h>

/* How far parameters are moved, scaled: their weights have single precision, so it must be far
 * beyond its rounding; five points keep the truncation smaller than that. */
static const double DISTANCE = 0.02;

/* The samples of the window, newest first, and those that features of the oldest look at. */
static void gather(const SlideModel *model, SlideState *state) {
    const SlideSamples *samples = &slide_now(state)->samples;
    const uint64_t newest = *samples->count - 1;
    for (size_t age = 0; age < model->memory_length; ++age) {
        memcpy(model->taken + age * model->n_inputs,
               slide_samples_at(&model->samples, samples, newest - age),
               model->n_inputs * sizeof(double));
    }
}

/* Add the outputs of the window, scaled, times a weight, with the parameters moved. */
static void add_outputs(const SlideModel *model, const SlideState *state,
                        const SlideParameterScratch *scratch, double amount, double weight) {
    const SlideNetwork *network = &model->predictor;
    const SlideExactRun run = {.samples = model->taken, .anew = true};
    slide_parameters_form_near(&model->parameters, &network->of.cells.terms, state->acting,
                               scratch->scaled, amount);
    const double *values = network->family->run_exact(network, &scratch->exact, &run);
    for (size_t i = 0; i < model->n_outputs; ++i) {
        scratch->slopes[i] += weight * values[i];
    }
}

void slide_parameter_slopes(const SlideModel *model, SlideState *state,
                            const SlideParameterScratch *scratch) {
    const SlideParameters *parameters = &model->parameters;
    double largest = 0;
    for (size_t i = 0; i < parameters->count; ++i) {
        scratch->scaled[i] =
            scratch->direction[i] * slide_parameter_slope(parameters, i, state->acting[i]);
        largest = fmax(largest, fabs(scratch->scaled[i]));
    }
    memset(scratch->slopes, 0, model->n_outputs * sizeof(double));
    if (largest == 0) { /* no parameter moves */
        return;
    }
    const double amount = DISTANCE / largest, weight = 1 / (12 * amount);
    gather(model, state);
    add_outputs(model, state, scratch, -2 * amount, weight);
    add_outputs(model, state, scratch, -amount, -8 * weight);
    add_outputs(model, state, scratch, amount, 8 * weight);
    add_outputs(model, state, scratch, 2 * amount, -weight);
    for (size_t i = 0; i < model->n_outputs; ++i) {
        scratch->slopes[i] *= model->output_scaling[i].scale;
    }
}

void slide_parameter_slopes_place(SlideParameterScratch *scratch, const SlideModel *model,
                                  SlideArena *arena) {
    const size_t count = model->parameters.count;
    if (count > 0) {
        model->predictor.family->place_exact(&scratch->exact, &model->predictor, arena);
        scratch->direction = slide_place(arena, count, sizeof(double));
        scratch->scaled = slide_place(arena, count, sizeof(double));
        scratch->slopes = slide_place(arena, model->n_outputs, sizeof(double));
    }
}
