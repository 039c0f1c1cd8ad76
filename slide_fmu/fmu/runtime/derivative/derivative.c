#include "derivative.h"

#include "sampling.h"

#include <math.h>
#include <string.h>

/* How far inputs are moved to either side, scaled: what differs is then known to about 1e-10 of
 * the values, and the third derivative is felt with the square of this, though changes of inputs
 * count many times in second differences. */
static const double DISTANCE = 1e-6;

static const double SLACK = 1e-5; /* in sample steps */

/* The last step, done once more. */
typedef struct {
    const SlideModel *model;
    SlideState *state;
    const SlideDerivativeScratch *scratch;
    uint64_t n_moved; /* newest samples that the inputs of this step move */
    uint64_t n_taken; /* samples that come after what was before */
    uint64_t n_after; /* of a whole window: so many more */
    bool anew;        /* is the whole window taken in once more? else what came since */
    bool settled;     /* the inputs count as held for ever */
} Replay;

static double *row_at(const Replay *replay, size_t age) {
    return replay->model->taken + age * replay->model->n_inputs;
}

/* Samples that the inputs do not move are those that networks have seen. */
static void put_earlier(const Replay *replay) {
    const SlideModel *model = replay->model;
    const SlideSamples *samples = &slide_now(replay->state)->samples;
    const uint64_t newest = *samples->count - 1;
    for (uint64_t age = replay->n_moved; age < model->n_redone; ++age) {
        const double *before = slide_samples_at(&model->samples, samples, newest - age);
        for (size_t i = 0; i < model->n_inputs; ++i) {
            row_at(replay, age)[i] = replay->settled
                                         ? slide_scaled(model, i, replay->state->inputs[i])
                                         : before[i];
        }
    }
}

/* Were held inputs of the step before moved by derivatives? */
static bool were_told(const SlideModel *model, const SlideState *state) {
    const size_t count = model->history.first_order ? 0 : model->n_inputs;
    return memchr(state->before.moved, SLIDE_TOLD, count) != NULL;
}

/* Newest samples that end after the last communication point, or the one before it, where its inputs
 * are what the step before it ends with; and those that they change. */
static uint64_t n_moved_of(const SlideModel *model, const SlideState *state) {
    const SlideHead *head = state->head;
    const bool apart = head->known != 0 && !were_told(model, state);
    const double before = apart ? 0 : fmax(head->length_before, model->step);
    const double time = head->last_length + before;
    const double spread = model->n_unsettled > 0 ? SLIDE_SPREAD : 0;
    const double samples = ceil(time / model->step - SLACK) + spread;
    return samples < model->n_redone ? (uint64_t)samples : model->n_redone;
}

/* The samples of the last step under inputs that were moved from those given by a part of the
 * direction, or of what counts as it before the first step. */
static void redo(const Replay *replay, const double *given, double amount) {
    const SlideModel *model = replay->model;
    SlideState *state = replay->state;
    for (size_t i = 0; i < model->n_inputs; ++i) {
        state->inputs[i] = given[i] + amount * replay->scratch->direction[i];
    }
    if (slide_stream_fresh(state)) {
        if (!replay->settled) { /* they are reached by now */
            slide_sampling_scale(model, state->inputs, model->taken);
        }
    } else {
        slide_stream_set_again(model, state, state->inputs);
        slide_sample(model, state, replay->n_moved, 0);
    }
    put_earlier(replay);
}

/* What a network gives after the samples from an age on. */
static const double *evaluate(const Replay *replay, const SlideNetwork *network,
                              const SlideExact *exact, size_t age) {
    const SlideBeforeStep *before = &replay->state->before;
    const SlideExactRun run = {.samples = row_at(replay, age),
                               .n_taken = (uint32_t)replay->n_taken,
                               .n_after = (uint32_t)replay->n_after,
                               .anew = replay->anew,
                               .settled = replay->settled,
                               .before = &before->predictor[replay->state->head->before]};
    return network->family->run_exact(network, exact, &run);
}

/* Squares of estimates that the step did not move, or that the map bounds, are those of the
 * state. */
static void estimate(const Replay *replay, double *errors) {
    const SlideModel *model = replay->model;
    const SlideEstimator *estimator = &model->estimator;
    const SlideEstimate *estimate = slide_stream_estimate(model, replay->state);
    const uint64_t newest = *slide_now(replay->state)->samples.count - 1;
    const size_t n_outputs = model->n_outputs;
    const uint64_t n_moved = replay->settled ? estimator->positions : replay->n_moved;
    memset(errors, 0, n_outputs * sizeof *errors);
    for (uint32_t age = 0; age < estimator->positions; ++age) {
        const double *values = NULL;
        if (age < n_moved) {
            values = evaluate(replay, &estimator->network, &replay->scratch->estimator, age);
        }
        for (size_t i = 0; i < n_outputs; ++i) {
            double square = age == 0 ? estimate->newest[i]
                                     : *slide_estimate_square(estimator, estimate, i, newest - age);
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
    const double *values = evaluate(replay, &model->predictor, &scratch->predictor, 0);
    memcpy(results, values, n * sizeof *results);
    memcpy(results + SLIDE_OF_TRUNCATION_ERRORS * n, values + model->predictor.n_values,
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

/* What is done again: after a step what networks took in since a state that is kept, if all that the
 * inputs move is in it; else all samples. */
static Replay replay_of(const SlideModel *model, SlideState *state,
                        const SlideDerivativeScratch *scratch) {
    Replay replay = {.model = model, .state = state, .scratch = scratch};
    const SlidePhase *phase = slide_now(state);
    const uint64_t most = model->n_redone - SLIDE_BEFORE, looked = state->head->n_looked;
    const uint64_t n_window = model->predictor.n_samples;
    const uint64_t n_after = looked > n_window ? (looked < most ? looked : most) - n_window : 0;
    replay.n_taken = state->head->n_since;
    if (slide_stream_fresh(state)) {
        const bool found = state->head->prehistory == SLIDE_OUTPUTS_KNOWN;
        replay.n_taken = found ? phase->head->n_open : 0;
        replay.settled = state->head->prehistory == SLIDE_FIRST_HELD;
        replay.n_moved = replay.settled ? 0 : phase->head->n_open;
        replay.anew = !replay.settled && !found;
    } else if (slide_stream_first_held(state)) {
        /* the first sample counts as settled, too, where it is held, and those it may change */
        const uint64_t n_settled = (slide_stream_forecasts(model, state) ? 0 : 1) +
                                   (model->n_unsettled > 0 ? SLIDE_SPREAD : 0);
        replay.settled = true;
        replay.n_moved = state->head->n_since;
        replay.anew = state->head->moved != 0 || replay.n_moved == 0 || replay.n_moved < n_settled;
        replay.n_moved = replay.anew ? model->n_redone : replay.n_moved;
        replay.n_after = n_after;
        replay.n_taken -= replay.anew ? 0 : n_settled;
    } else if (state->head->between || looked > 0) {
        /* what networks have seen ends at other times, or all was read from the history */
        replay.n_moved = model->n_redone;
        replay.n_after = n_after;
        replay.anew = true;
    } else {
        replay.n_moved = n_moved_of(model, state);
        replay.anew = state->head->n_since < replay.n_moved ||
                      !slide_is_recurrent(model->predictor.family);
    }
    return replay;
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
    memcpy(scratch->given, fresh ? state->inputs : state->before.given, row);
    const Replay replay = replay_of(model, state, scratch);
    for (size_t side = 0; side < 2; ++side) {
        const double amount = (side == 0 ? DISTANCE : -DISTANCE) / largest;
        redo(&replay, scratch->given, amount);
        run(&replay, estimates, scratch->results[side]);
    }
    if (!fresh) {
        slide_stream_set_again(model, state, scratch->given);
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
    scratch->given = slide_place(arena, 1, row);
    scratch->results[0] = slide_place(arena, 1, results);
    scratch->results[1] = slide_place(arena, 1, results);
    scratch->direction = slide_place(arena, 1, row);
    scratch->slopes = slide_place(arena, 1, results);
}
