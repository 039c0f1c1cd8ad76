#include "derivative.h"

#include <math.h>
#include <string.h>

/* How far inputs are moved to either side, scaled: what differs is then known to about 1e-10 of
 * the values, and the third derivative is felt with the square of this, though changes of inputs
 * count many times in second differences. */
static const double DISTANCE = 1e-6;

/* The last step, done once more. */
typedef struct {
    const SlideModel *model;
    const SlideState *state;
    const SlideDerivativeScratch *scratch;
    SlideIntake intake;
} Replay;

static double *row_at(const Replay *replay, size_t age) {
    return replay->model->taken + age * replay->model->n_inputs;
}

/* A sample that the step did not take in. The last ones before it are kept, since two steps may
 * take in more samples than the ring holds. */
static const double *sample_before(const Replay *replay, size_t age) {
    const SlideModel *model = replay->model;
    const SlideSamples *samples = &replay->state->samples;
    const size_t behind = age - replay->intake.count;
    return behind < SLIDE_BEFORE
               ? replay->state->before.samples + behind * model->n_inputs
               : slide_samples_at(&model->samples, samples, *samples->count - 1 - age);
}

static void put_earlier(const Replay *replay) {
    const SlideModel *model = replay->model;
    for (size_t age = replay->intake.count; age < model->n_redone; ++age) {
        const double *before = sample_before(replay, age);
        for (size_t i = 0; i < model->n_inputs; ++i) {
            row_at(replay, age)[i] = replay->intake.settled
                                         ? slide_scaled(model, i, replay->state->inputs[i])
                                         : before[i];
        }
    }
}

/* Do the last step once more, or what counts as it before the first, under inputs that were moved
 * from those given by a part of the direction: the history is then that after this step. */
static Replay redo(const SlideModel *model, SlideState *state,
                   const SlideDerivativeScratch *scratch, const double *given, double amount) {
    Replay replay = {.model = model, .state = state, .scratch = scratch};
    for (size_t i = 0; i < model->n_inputs; ++i) {
        state->inputs[i] = given[i] + amount * scratch->direction[i];
    }
    slide_history_go_back(&model->history, &state->history, SLIDE_MARK_STEP);
    replay.intake = slide_stream_take_in(model, state);
    put_earlier(&replay);
    return replay;
}

/* What a network gives after the samples from an age on. */
static const double *evaluate(const Replay *replay, const SlideNetwork *network,
                              const SlideExact *exact, size_t age) {
    const SlideIntake *intake = &replay->intake;
    const SlideExactRun run = {.samples = row_at(replay, age),
                               .n_taken = intake->count,
                               .anew = intake->anew,
                               .n_after = intake->n_after,
                               .settled = intake->settled,
                               .before = &replay->state->before.predictor};
    return network->family->run_exact(network, exact, &run);
}

/* Squares of estimates that the step did not move, or that the map bounds, are those of the
 * state. */
static void estimate(const Replay *replay, double *errors) {
    const SlideModel *model = replay->model;
    const SlideEstimator *estimator = &model->estimator;
    const uint64_t newest = *replay->state->samples.count - 1;
    const size_t n_outputs = model->n_outputs;
    const uint32_t n_moved = replay->intake.settled ? estimator->positions : replay->intake.count;
    memset(errors, 0, n_outputs * sizeof *errors);
    for (uint32_t age = 0; age < estimator->positions; ++age) {
        const double *values = NULL;
        if (age < n_moved) {
            values = evaluate(replay, &estimator->network, &replay->scratch->estimator, age);
        }
        for (size_t i = 0; i < n_outputs; ++i) {
            double square =
                *slide_estimate_square(estimator, &replay->state->estimate, i, newest - age);
            if (values != NULL && square < estimator->largest) {
                double mean = estimator->n_means > 0 ? values[i] : 0;
                square = slide_squared_error(estimator, mean, values[estimator->n_means + i]);
            }
            errors[i] += square;
        }
    }
    for (size_t i = 0; i < n_outputs; ++i) {
        errors[i] = sqrt(errors[i] / estimator->positions);
    }
}

/* What the step would have given, scaled. */
static void run(const Replay *replay, bool estimates, double *results) {
    const SlideModel *model = replay->model;
    const SlideDerivativeScratch *scratch = replay->scratch;
    const size_t n = model->n_outputs;
    memset(results, 0, 3 * n * sizeof *results);
    const double *found = evaluate(replay, &model->predictor, &scratch->predictor, 0);
    memcpy(results, found, n * sizeof *results);
    memcpy(results + SLIDE_OF_TRUNCATION_ERRORS * n, found + model->predictor.n_values,
           n * sizeof *results);
    if (estimates) {
        estimate(replay, results + SLIDE_OF_ESTIMATES * n);
    }
}

static double largest_change(const SlideModel *model, const double *d_inputs) {
    double largest = 0;
    for (size_t i = 0; i < model->n_inputs; ++i) {
        largest = fmax(largest, fabs(d_inputs[i] * model->input_scaling[i].factor));
    }
    return largest;
}

void slide_directional_derivative(const SlideModel *model, SlideState *state,
                                  const SlideDerivativeScratch *scratch, bool estimates) {
    const double largest = largest_change(model, scratch->direction);
    const size_t n = model->n_outputs, row = model->n_inputs * sizeof(double);
    const bool fresh = slide_stream_fresh(state);
    const bool known = fresh && state->head->prehistory != SLIDE_FIRST_HELD &&
                       !slide_stream_forecasts(model, state);
    memset(scratch->slopes, 0, 3 * n * sizeof *scratch->slopes);
    if (known || largest == 0) { /* no input was taken in yet, or none moves */
        return;
    }
    slide_model_form(model, state->acting);
    memcpy(scratch->inputs, state->inputs, row);
    const double *given = fresh ? scratch->inputs : state->before.given;
    for (size_t side = 0; side < 2; ++side) {
        const double amount = (side == 0 ? DISTANCE : -DISTANCE) / largest;
        const Replay replay = redo(model, state, scratch, given, amount);
        run(&replay, estimates, scratch->results[side]);
    }
    slide_history_go_back(&model->history, &state->history, SLIDE_MARK_STEP);
    if (!fresh) {
        memcpy(state->inputs, given, row);
        slide_stream_take_in(model, state);
    }
    memcpy(state->inputs, scratch->inputs, row);
    for (size_t i = 0; i < 3 * n; ++i) {
        double difference = scratch->results[0][i] - scratch->results[1][i];
        scratch->slopes[i] =
            difference * (largest / (2 * DISTANCE)) * model->output_scaling[i % n].scale;
    }
}

void slide_derivative_place(SlideDerivativeScratch *scratch, const SlideModel *model,
                            SlideArena *arena) {
    const size_t row = model->n_inputs * sizeof(double);
    const size_t results = 3 * model->n_outputs * sizeof(double);
    const SlideNetwork *predictor = &model->predictor, *estimator = &model->estimator.network;
    predictor->family->place_exact(&scratch->predictor, predictor, arena);
    if (model->estimator.positions > 0) {
        estimator->family->place_exact(&scratch->estimator, estimator, arena);
    }
    scratch->inputs = slide_place(arena, 1, row);
    scratch->results[0] = slide_place(arena, 1, results);
    scratch->results[1] = slide_place(arena, 1, results);
    scratch->direction = slide_place(arena, 1, row);
    scratch->slopes = slide_place(arena, 1, results);
}
