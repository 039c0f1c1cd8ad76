#include "derivative.h"

#include <math.h>
#include <string.h>

/* How far inputs are moved to either side, scaled: what differs is then known to about 1e-10 of
 * the values, and the third derivative is felt with the square of this, though changes of inputs
 * count many times in second differences. */
static const double DISTANCE = 1e-6;

/* The last step with inputs moved by a part of a direction. */
typedef struct {
    const SlideModel *model;
    const SlideState *state;
    const SlideDerivativeScratch *scratch;
    double amount;
    bool held;        /* the present inputs count as held for ever */
    bool follow;      /* what was before the step moves with its inputs */
    uint32_t n_taken; /* samples that the step took in; of held inputs, those after the first */
} Replay;

static Replay replay_of(const SlideModel *model, const SlideState *state,
                        const SlideDerivativeScratch *scratch) {
    const uint64_t steps = *state->history.count;
    const uint32_t taken = state->last->n_taken < model->n_in ? state->last->n_taken : model->n_in;
    Replay replay = {.model = model,
                     .state = state,
                     .scratch = scratch,
                     .held = steps < 2,
                     .n_taken = taken};
    replay.follow = replay.held || state->last->began;
    if (replay.held) {
        replay.n_taken = steps == 0 || taken == 0 ? 0 : taken - 1;
    }
    return replay;
}

static void move(const Replay *replay, const double *inputs, double *moved) {
    for (size_t i = 0; i < replay->model->n_inputs; ++i) {
        moved[i] = inputs[i] + replay->amount * replay->scratch->direction[i];
    }
}

static double *row_at(const Replay *replay, size_t age) {
    return replay->scratch->samples + age * replay->model->n_inputs;
}

static void put(const Replay *replay, size_t age, const double *sample) {
    for (size_t i = 0; i < replay->model->n_inputs; ++i) {
        row_at(replay, age)[i] = slide_scaled(replay->model, i, sample[i]);
    }
}

/* Samples that the step did not take in, from an age on. */
static void put_earlier(const Replay *replay, size_t age) {
    const SlideModel *model = replay->model;
    const SlideSamples *samples = &replay->state->samples;
    for (; age < (size_t)model->memory_length + SLIDE_BEFORE; ++age) {
        if (replay->follow) {
            put(replay, age, replay->scratch->given);
        } else {
            memcpy(row_at(replay, age),
                   slide_samples_at(&model->samples, samples, *samples->count - 1 - age),
                   model->n_inputs * sizeof(double));
        }
    }
}

/* The inputs of the step, as they would have been set. */
static SlideStepInputs inputs_of(const Replay *replay) {
    const SlideModel *model = replay->model;
    const SlideDerivativeScratch *scratch = replay->scratch;
    const SlideState *state = replay->state;
    const bool moved = !replay->held && state->last->moved;
    const double *given = *state->history.count == 0
                              ? state->inputs
                              : slide_history_newest(&model->history, &state->history);
    move(replay, moved ? state->before.given : given, scratch->given);
    if (replay->follow) {
        move(replay, state->before.inputs, scratch->from);
    } else {
        memcpy(scratch->from, state->before.inputs, model->n_inputs * sizeof(double));
    }
    const bool between = model->history.first_order && replay->n_taken > 1;
    return (SlideStepInputs){between ? scratch->from : NULL, scratch->given,
                             moved ? state->before.rates : NULL,
                             slide_stream_parts(model, state->last->length)};
}

/* The sample read last of the step's history, had it been of these inputs. */
static void sample_with(const Replay *replay, const SlideStepInputs *inputs,
                        const SlideReader *reader, double begin, double end, double *sample) {
    const SlideModel *model = replay->model;
    const double *earlier = replay->follow ? inputs->given : NULL;
    double *newest = replay->scratch->from; /* of no other use here */
    const uint64_t after = reader->at + inputs->parts.count, count = *replay->state->history.count;
    if (inputs->rates != NULL && !model->history.first_order && after >= count) {
        slide_step_part(&model->history, inputs, (uint32_t)(after - count), sample);
        return;
    }
    slide_step_part(&model->history, inputs, 0, newest);
    slide_history_sample_with(reader, begin, end, newest, earlier, sample);
}

/* All samples after a step that took them anew. */
static void put_anew(const Replay *replay, const SlideStepInputs *inputs) {
    const SlideModel *model = replay->model;
    double *sample = replay->scratch->sample;
    SlideReader reader = slide_history_reader(&model->history, &replay->state->history);
    for (size_t age = model->memory_length; age-- > 0;) {
        double end = -(double)age * model->step, begin = -(double)(age + 1) * model->step;
        slide_history_sample(&reader, begin, end, sample);
        sample_with(replay, inputs, &reader, begin, end, sample);
        put(replay, age, sample);
    }
    for (size_t age = 0; age < SLIDE_BEFORE; ++age) {
        memcpy(row_at(replay, model->memory_length + age), row_at(replay, model->memory_length - 1),
               model->n_inputs * sizeof(double));
    }
}

static void put_samples(const Replay *replay) {
    const SlideModel *model = replay->model;
    const SlideStepInputs inputs = inputs_of(replay);
    if (replay->held) {
        put_earlier(replay, 0);
    } else if (replay->n_taken == 0) {
        put_anew(replay, &inputs);
    } else {
        for (uint32_t left = 0; left < replay->n_taken; ++left) {
            slide_step_sample(&model->history, &inputs, replay->n_taken, left,
                              replay->scratch->sample);
            put(replay, left, replay->scratch->sample);
        }
        put_earlier(replay, replay->n_taken);
    }
}

/* What a network gives after the samples from an age on. */
static const double *evaluate(const Replay *replay, const SlideNetwork *network,
                              const SlideExact *exact, size_t age) {
    const SlideExactRun run = {row_at(replay, age), replay->n_taken,
                               !replay->held && replay->n_taken == 0, replay->follow,
                               &replay->state->before.predictor};
    return network->family->run_exact(network, exact, &run);
}

/* Squares of estimates that the step did not move, or that the map bounds, are those of the state;
 * beyond its samples, where all are the same, one stands for all. */
static void estimate(const Replay *replay, double *errors) {
    const SlideModel *model = replay->model;
    const SlideEstimator *estimator = &model->estimator;
    const uint64_t newest = *replay->state->samples.count - 1;
    const bool anew = !replay->held && replay->n_taken == 0;
    const size_t n_outputs = model->n_outputs;
    const uint32_t n_moved = anew ? model->memory_length : replay->n_taken;
    const double *values = NULL;
    memset(errors, 0, n_outputs * sizeof *errors);
    for (uint32_t age = 0; age < estimator->positions; ++age) {
        if (age < n_moved || (age == n_moved && replay->follow)) {
            values = evaluate(replay, &estimator->network, &replay->scratch->estimator, age);
        }
        for (size_t i = 0; i < n_outputs; ++i) {
            double square =
                *slide_estimate_square(estimator, &replay->state->estimate, i, newest - age);
            if ((age < n_moved || replay->follow) && square < estimator->largest) {
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
    put_samples(replay);
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

void slide_directional_derivative(const SlideModel *model, const SlideState *state,
                                  const SlideDerivativeScratch *scratch, bool estimates) {
    const double largest = largest_change(model, scratch->direction);
    const size_t n = model->n_outputs;
    const bool known = slide_stream_fresh(state) && state->head->prehistory != SLIDE_FIRST_HELD;
    memset(scratch->slopes, 0, 3 * n * sizeof *scratch->slopes);
    if (known || largest == 0) { /* no input was taken in yet, or none moves */
        return;
    }
    Replay replay = replay_of(model, state, scratch);
    for (size_t side = 0; side < 2; ++side) {
        replay.amount = (side == 0 ? DISTANCE : -DISTANCE) / largest;
        run(&replay, estimates, scratch->results[side]);
    }
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
    scratch->samples = slide_place(arena, (size_t)model->memory_length + SLIDE_BEFORE, row);
    scratch->given = slide_place(arena, 1, row);
    scratch->from = slide_place(arena, 1, row);
    scratch->sample = slide_place(arena, 1, row);
    scratch->results[0] = slide_place(arena, 1, results);
    scratch->results[1] = slide_place(arena, 1, results);
    scratch->direction = slide_place(arena, 1, row);
    scratch->slopes = slide_place(arena, 1, results);
}
