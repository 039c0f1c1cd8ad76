#include "forecast_miss.h"

#include "phases.h"
#include "sampling.h"

#include <math.h>

bool slide_forecast_miss_outputs(const SlideModel *model, SlideNetworkState *state, double *outputs) {
    const SlideNetwork *network = &model->predictor;
    if (!slide_network_see(network, state, 0, model->taken, model->taken + model->n_inputs)) {
        return false;
    }
    const float *values = network->family->evaluate(network, model->kernel, state, 0);
    bool finite = true;
    for (size_t i = 0; i < model->n_outputs; ++i) {
        outputs[i] = values[i];
        finite = finite && isfinite(values[i]);
    }
    return finite;
}

bool slide_forecast_miss_judge(const SlideModel *model, SlideState *state, SlideNetworkState *before,
                        const double *outputs) {
    for (size_t i = 0; i < model->n_inputs; ++i) {
        model->taken[i] += model->missed[i] * model->input_scaling[i].factor;
    }
    if (!slide_forecast_miss_outputs(model, before, model->missing)) {
        return false;
    }
    for (size_t i = 0; i < model->n_outputs; ++i) {
        slide_phases_judge(&state->ahead.forecast[i], model->missing[i] - outputs[i]);
    }
    return true;
}

bool slide_forecast_miss_surprise(const SlideModel *model, SlideState *state) {
    SlidePhase *phase = slide_now(state);
    if (model->n_unsettled > 0 || state->head->known != 0 || phase->head->n_open != 1 ||
        !slide_is_recurrent(model->predictor.family) ||
        !slide_forecast_surprised(&model->forecast, &model->history, &state->forecast)) {
        return true;
    }
    slide_sample_newest(model, state);
    for (size_t i = 0; i < model->n_outputs; ++i) {
        model->candidate[i] = phase->given[i];
    }
    return slide_forecast_miss_judge(model, state, &phase->known, model->candidate);
}
