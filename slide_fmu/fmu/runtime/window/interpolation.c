#include "interpolation.h"

#include "forecast_miss.h"
#include "phases.h"
#include "sampling.h"

#include <math.h>
#include <string.h>

enum {
    N_NODES = 4, /* phases that a cubic goes through */
    N_GRID = 5   /* phases in a sample step, of which these are some */
};

bool slide_interpolation_serves(const SlideModel *model, SlideState *state) {
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

/* What held inputs become after the end of the newest step, so much later (s): those that move smoothly
 * go on along a parabola, within their ranges. */
static void go_beyond(const SlideModel *model, SlideState *state, double later) {
    const SlideHistoryShape *shape = &model->history;
    const SlideForecast *forecast = &model->forecast;
    const unsigned char *moved = slide_history_moved(shape, &state->history, 0);
    double *newest = slide_history_newest(shape, &state->history);
    const double length = newest[0];
    for (size_t i = 0; i < model->n_inputs; ++i) {
        const double begin = newest[1 + i], end = state->history.end[i];
        if (moved[i] == SLIDE_HELD) {
            continue;
        }
        double slope = (end - begin) / length;
        if (moved[i] == SLIDE_MOVED && *state->history.count > 1 &&
            slide_history_moved(shape, &state->history, 1)[i] == SLIDE_MOVED) {
            const double *before = slide_history_before(shape, &state->history);
            const double slope_before = (begin - before[1 + i]) / before[0];
            slope += (slope - slope_before) / (length + before[0]) * (length + later);
        }
        const double value = end + later * slope;
        state->history.end[i] = fmax(fmin(value, fmax(end, forecast->high[i])),
                                     fmin(end, forecast->low[i]));
    }
    newest[0] += later;
}

/* Held inputs: the phases around the present. Those that end after it see inputs that go on as they do
 * now, in samples that are open. */
static bool reach_held(const SlideModel *model, SlideState *state, size_t *place, double *outputs) {
    SlideHead *head = state->head;
    const double now = slide_clock_time(&head->inner), spacing = model->step / N_GRID;
    const double first = floor(now / spacing);
    const double later = fmax((first + 2) * spacing - now, 0);
    const SlideClock clock = head->inner;
    const double length = head->last_length;
    const double newest = slide_history_newest(&model->history, &state->history)[0];
    double weights[N_NODES];
    bool done = true;
    weigh(now / spacing - first, weights);
    memcpy(model->end, state->history.end, model->n_inputs * sizeof(double));
    go_beyond(model, state, later);
    head->last_length += later;
    slide_clock_advance(&head->inner, now, later);
    memset(outputs, 0, model->n_outputs * sizeof *outputs);
    for (size_t i = 0; done && i < N_NODES; ++i) {
        size_t node;
        done = slide_phases_reach(model, state, (first - 1 + (double)i) * spacing, 0, &node);
        for (size_t j = 0; done && j < model->n_outputs; ++j) {
            outputs[j] += weights[i] * state->phases[node].given[j];
        }
        *place = i < 3 ? node : *place; /* its bound knows what held inputs do now */
    }
    head->inner = clock;
    head->last_length = length;
    slide_history_newest(&model->history, &state->history)[0] = newest;
    memcpy(state->history.end, model->end, model->n_inputs * sizeof(double));
    return done;
}

/* Inputs that move: the newest sample, after the state that lies between those of phases that ended a sample
 * step ago. */
static bool reach_moving(const SlideModel *model, SlideState *state, size_t *place,
                         double *outputs) {
    const double now = slide_clock_time(&state->head->inner), spacing = model->step / N_GRID;
    const double first = floor((now - model->step) / spacing);
    const SlideNetworkState *nodes[N_NODES];
    SlideNetworkState between = model->between;
    double weights[N_NODES];
    weigh((now - model->step) / spacing - first, weights);
    for (size_t i = 0; i < N_NODES; ++i) {
        const double time = (first - 1 + (double)i) * spacing;
        size_t node;
        if (!slide_phases_reach(model, state, time, 0, &node)) {
            return false;
        }
        nodes[i] = &state->phases[node].predictor;
    }
    model->predictor.family->blend(&model->predictor, nodes, weights, N_NODES, &between);
    slide_sample_newest(model, state);
    if (!slide_forecast_miss_outputs(model, &between, outputs) ||
        (state->head->known == 0 && !slide_forecast_miss_judge(model, state, &between, outputs))) {
        return false;
    }
    /* what the bound says of it: the phase that ends last, taken back where the phase is a node again */
    return slide_phases_reach(model, state, first * spacing + model->step, 1, place);
}

bool slide_interpolation_reach(const SlideModel *model, SlideState *state, size_t *place,
                         double *outputs) {
    slide_sample_newest(model, state);
    if (model->strays[0]) {
        state->head->outside = slide_clock_time(&state->head->inner);
    }
    const bool done = model->n_unsettled > 0 ? reach_held(model, state, place, outputs)
                                             : reach_moving(model, state, place, outputs);
    slide_phases_note_nothing(state);
    return done;
}
