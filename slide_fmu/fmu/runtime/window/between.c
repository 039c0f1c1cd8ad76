#include "between.h"

#include "phases.h"
#include "sampling.h"

#include <math.h>

enum {
    N_NODES = 4, /* phases that a cubic goes through */
    N_GRID = 5   /* phases in a sample step, of which these are some */
};

bool slide_between_serves(const SlideModel *model, SlideState *state) {
    const SlideHead *head = state->head;
    if (model->n_phases < N_GRID || !slide_is_recurrent(model->predictor.family)) {
        return false;
    }
    /* that each node goes on by, also those of the step before, or it sees all anew, too */
    const double n_samples = fmax(head->last_length, head->length_before) / model->step;
    return head->n_phases == 0 ||
           (head->credit < 1 && N_GRID * n_samples < model->predictor.n_samples &&
            !slide_phases_have(model, state, slide_clock_time(&head->inner)));
}

/* Of the polynomial through the nodes -1, 0, 1, 2, at a place from 0 to 1. */
static void weigh(double x, double weights[N_NODES]) {
    weights[0] = -x * (x - 1) * (x - 2) / 6;
    weights[1] = (x + 1) * (x - 1) * (x - 2) / 2;
    weights[2] = -(x + 1) * x * (x - 2) / 2;
    weights[3] = (x + 1) * x * (x - 1) / 6;
}

bool slide_between_reach(const SlideModel *model, SlideState *state, size_t *place,
                         double *outputs) {
    const SlideNetwork *network = &model->predictor;
    const double now = slide_clock_time(&state->head->inner), spacing = model->step / N_GRID;
    const double first = floor((now - model->step) / spacing);
    size_t nodes[N_NODES];
    double weights[N_NODES];
    weigh((now - model->step) / spacing - first, weights);
    for (size_t i = 0; i < N_NODES; ++i) {
        const double time = (first - 1 + (double)i) * spacing;
        if (!slide_phases_reach(model, state, time, 0, &nodes[i])) {
            return false;
        }
    }
    slide_sample_newest(model, state);
    if (model->strays[0]) {
        state->head->outside = now;
    }
    for (size_t i = 0; i < model->n_outputs; ++i) {
        outputs[i] = 0;
    }
    for (size_t i = 0; i < N_NODES; ++i) {
        SlideSeen *node = &state->seen[nodes[i]];
        const uint64_t number = *node->samples.count;
        if (!slide_network_see(network, &node->predictor, number, model->taken,
                               model->taken + model->n_inputs)) {
            return false;
        }
        const float *values =
            network->family->evaluate(network, model->kernel, &node->predictor, number);
        for (size_t j = 0; j < model->n_outputs; ++j) {
            outputs[j] += weights[i] * values[j];
        }
    }
    /* what the bound says of it: the phase that ends last, taken back where the phase is a node again */
    const bool done =
        slide_phases_reach(model, state, first * spacing + model->step, 1, place);
    slide_phases_note_nothing(state);
    for (size_t i = 0; i < model->n_outputs; ++i) {
        if (!isfinite(outputs[i])) {
            return false;
        }
    }
    return done;
}
