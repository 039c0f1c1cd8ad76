#include "forecast_step.h"

#include "aside.h"
#include "ranges.h"

#include <math.h>
#include <string.h>

/* The outputs that the network gives after the sample that it has seen. */
static bool predict(const SlideModel *model, const SlideState *state, uint64_t sample) {
    bool finite = true;
    const float *values = model->predictor.family->evaluate(&model->predictor, model->kernel,
                                                            &state->predictor, sample);
    for (size_t i = 0; i < model->n_outputs; ++i) {
        const SlideScaling *scaling = &model->output_scaling[i];
        model->predicted[i] = values[i];
        model->candidate[i] = values[i] * scaling->scale + scaling->offset;
        finite = finite && isfinite(model->candidate[i]);
    }
    return finite;
}

static const double *newest_sample(const SlideModel *model, const SlideState *state) {
    return slide_samples_at(&model->samples, &state->samples, *state->samples.count - 1);
}

/* The predictor looks at the next sample. */
static bool see(const SlideModel *model, SlideState *state, const double *sample) {
    return slide_network_see(&model->predictor, &state->predictor, *state->samples.count, sample,
                             newest_sample(model, state));
}

/* The predictor goes on by a sample. Layers are evaluated at the last one of a step only. */
static bool advance(const SlideModel *model, SlideState *state, const double *sample, bool last) {
    const bool evaluated = last || slide_is_recurrent(model->predictor.family);
    const uint64_t number = *state->samples.count;
    if (!see(model, state, sample) || (evaluated && !predict(model, state, number))) {
        return false;
    }
    if (evaluated) {
        model->predictor.family->accept(&model->predictor, &state->predictor);
    }
    return true;
}

/* A sample that is out of range leaves its number, once it is counted. */
static void watch_range(const SlideModel *model, SlideState *state, const double *sample) {
    if (!slide_in_range(sample, model->n_inputs, model->cosine)) {
        *state->strayed = *state->samples.count;
    }
}

/* The values that the predictor gave after a sample, once it has seen all that they depend on; only
 * with an error bound. */
static const float *predicted(const SlideModel *model, const SlideState *state) {
    const uint64_t seen = *state->predictor.cells.taken;
    return seen >= model->predictor.memory_length ? model->predicted : NULL;
}

static void remember_predicted(const SlideModel *model, SlideState *state, uint64_t sample,
                               bool given) {
    if (model->bound.memory_length > 0) {
        slide_bound_remember(&model->bound, &state->bound, sample,
                             given ? predicted(model, state) : NULL);
    }
}

static void append_sample(const SlideModel *model, SlideState *state, const double *sample) {
    slide_samples_append(&model->samples, &state->samples, sample);
    watch_range(model, state, sample);
}

/* given: did the predictor see the sample? */
static void remember(const SlideModel *model, SlideState *state, const double *sample,
                     bool given) {
    remember_predicted(model, state, *state->samples.count, given);
    append_sample(model, state, sample);
}

/* Keep what derivatives need of the state before what the inputs that were set change. */
void slide_step_keep(const SlideModel *model, SlideState *state) {
    const SlideNetwork *network = &model->predictor;
    const size_t row = model->n_inputs * sizeof(double);
    if (slide_is_recurrent(network->family)) {
        network->family->keep(network, &state->predictor, &state->before.predictor);
    }
    memcpy(state->before.given, state->inputs, row);
    memcpy(state->before.samples, newest_sample(model, state), SLIDE_BEFORE * row);
    slide_history_begin(&model->history, &state->history, SLIDE_MARK_STEP,
                        slide_stream_forecasts(model, state));
}

/* A step begins. The derivatives of the inputs count for this step only. */
void slide_step_begin(const SlideModel *model, SlideState *state, double length) {
    const size_t row = model->n_inputs * sizeof(double);
    state->head->last_length = length;
    state->head->moved = state->head->moving;
    if (state->head->moving) {
        memcpy(state->before.rates, state->rates, row);
        memcpy(state->before.told, state->told, model->n_inputs * sizeof *state->told);
        memset(state->rates, 0, row);
        memset(state->told, 0, model->n_inputs * sizeof *state->told);
        state->head->moving = 0;
    }
}

static bool take(const SlideModel *model, SlideState *state, const double *sample, bool last) {
    bool good = advance(model, state, sample, last);
    if (good) {
        remember(model, state, sample, true);
    }
    return good;
}

/* A sample that was forecast is known now. What the importer was given after it stays what the
 * predictor gave, where the bound judges that. */
static bool take_again(const SlideModel *model, SlideState *state, const double *sample) {
    if (!model->bound.judges_given) {
        return take(model, state, sample, false);
    }
    bool good = advance(model, state, sample, false);
    if (good) {
        append_sample(model, state, sample);
    }
    return good;
}

/* The parameters that are set are those behind the outputs. */
static void accept_parameters(const SlideModel *model, SlideState *state) {
    const size_t row = model->parameters.count * sizeof(double);
    if (row > 0 && memcmp(state->acting, state->parameters, row) != 0) {
        memcpy(state->acting, state->parameters, row);
        *state->since = 0;
    }
}

void slide_step_accept(const SlideModel *model, SlideState *state) {
    accept_parameters(model, state);
    memcpy(state->outputs, model->candidate, model->n_outputs * sizeof(double));
    state->head->current = 1;
}

/* Forget all samples; this one counts for all. */
static void restart(const SlideModel *model, SlideState *state, const double *sample) {
    slide_samples_fill(&model->samples, &state->samples, sample);
    slide_network_restart(&model->predictor, &state->predictor, sample,
                          newest_sample(model, state));
    slide_estimate_restart(&model->estimator, &state->estimate);
    slide_bound_restart(&model->bound, &state->bound);
    remember_predicted(model, state, *state->samples.count - 1, false);
    *state->restarts += 1;
    *state->strayed = 0;
    watch_range(model, state, sample);
}

/* The predictor goes on by what is taken in; it sees its own part of what is taken in anew. */
bool slide_step_take(const SlideModel *model, SlideState *state, const SlideIntake *intake) {
    for (uint32_t left = intake->count; left-- > 0;) {
        const double *sample = model->taken + left * model->n_inputs;
        if (intake->anew && left == intake->count - 1) {
            restart(model, state, sample);
        }
        if (intake->anew && left >= model->predictor.n_samples) {
            remember(model, state, sample, false);
        } else if (!take(model, state, sample, left == 0)) {
            return false;
        }
    }
    return true;
}

/* The predictor goes on by samples that were forecast before. */
bool slide_step_take_again(const SlideModel *model, SlideState *state, const SlideIntake *intake) {
    for (uint32_t left = intake->count; left-- > 0;) {
        if (!take_again(model, state, model->taken + left * model->n_inputs)) {
            return false;
        }
    }
    return true;
}

static bool hold(const SlideModel *model, SlideState *state) {
    slide_intake_scale(model, slide_stream_prehistory(model, state), model->taken);
    restart(model, state, model->taken);
    for (uint64_t left = model->predictor.n_settling; left > 0; --left) {
        if (!advance(model, state, model->taken, left == 1)) {
            return false;
        }
    }
    remember_predicted(model, state, *state->samples.count - 1, true);
    return true;
}

/* What is known of the time before the start, when the parameters were those of now. */
bool slide_step_begin_run(const SlideModel *model, SlideState *state) {
    if (model->parameters.count > 0) {
        accept_parameters(model, state);
        *state->since = INFINITY;
    }
    if (state->head->prehistory != SLIDE_INITIAL_WINDOW_KNOWN) {
        return hold(model, state);
    }
    slide_intake_recall(model, state);
    slide_intake_sample(model, state, model->memory_length, NULL);
    const SlideIntake intake = {model->memory_length, .anew = true};
    const bool done = slide_step_take(model, state, &intake);
    *state->history.count = 0;
    return done;
}

/* The inputs that were set come after what is known of those until the start. */
static bool reach_start(const SlideModel *model, SlideState *state) {
    state->head->reached_length = model->step;
    slide_step_keep(model, state);
    const SlideIntake intake = slide_intake_end(model, state);
    return slide_step_take(model, state, &intake);
}

bool slide_stream_hold(const SlideModel *model, SlideState *state) {
    slide_model_form(model, state->parameters);
    bool done = slide_step_begin_run(model, state);
    if (done && slide_stream_forecasts(model, state) &&
        state->head->prehistory != SLIDE_FIRST_HELD) {
        done = reach_start(model, state);
        *state->history.count = 0;
    }
    if (done) {
        slide_step_accept(model, state);
    }
    return done;
}

void slide_step_count(const SlideModel *model, SlideState *state, double length) {
    const uint32_t n_whole = slide_intake_whole(model, length);
    state->head->filled += n_whole > 0 ? n_whole : length / model->step;
    const bool between = n_whole > 1 && slide_stream_forecasts(model, state); /* nobody knows these */
    state->head->given = n_whole > 0 && !between ? state->head->given + n_whole : 0;
    if (model->parameters.count > 0) { /* a window taken in anew knows no other parameters */
        const uint32_t count = n_whole > 0 ? n_whole : slide_aside_resumed(model, state);
        *state->since = count > 0 ? *state->since + count : INFINITY;
    }
}

static bool step_of(const SlideModel *model, SlideState *state, double length) {
    if (slide_stream_fresh(state) && !slide_stream_hold(model, state)) {
        return false;
    }
    slide_aside_begin(model, state, length);
    slide_step_keep(model, state);
    slide_step_begin(model, state, length);
    const SlideIntake intake = slide_intake_step(model, state);
    if (!slide_step_take(model, state, &intake)) {
        return false;
    }
    slide_step_accept(model, state);
    slide_step_count(model, state, length);
    return true;
}

/* The most frequent step, of one sample; until all is found, it changes nothing that counts. */
static bool step_once(const SlideModel *model, SlideState *state) {
    slide_intake_scale(model, state->inputs, model->taken);
    if (!see(model, state, model->taken) || !predict(model, state, *state->samples.count)) {
        return false;
    }
    slide_aside_begin(model, state, model->step);
    slide_step_keep(model, state);
    slide_step_begin(model, state, model->step);
    model->predictor.family->accept(&model->predictor, &state->predictor);
    remember(model, state, model->taken, true);
    slide_step_accept(model, state);
    slide_history_append(&model->history, &state->history, model->step, state->inputs, false);
    state->head->filled += 1;
    state->head->given += 1;
    if (model->parameters.count > 0) {
        *state->since += 1;
    }
    return true;
}

bool slide_stream_step(const SlideModel *model, SlideState *state, double length) {
    slide_model_form(model, state->parameters); /* what is remembered is kept */
    if (slide_stream_forecasts(model, state)) {
        return slide_forecast_step(model, state, length);
    }
    if (length == model->step && !slide_stream_fresh(state) && !state->head->moving) {
        return step_once(model, state);
    }
    const bool between = slide_intake_whole(model, length) == 0;
    memcpy(state->backup, state->head, state->before_steps);
    if (between) {
        slide_aside_keep(state);
    }
    bool done = step_of(model, state, length);
    if (!done) {
        slide_history_go_back(&model->history, &state->history, SLIDE_MARK_STEP);
        memcpy(state->head, state->backup, state->before_steps);
        if (between) {
            slide_aside_undo(state);
        }
    }
    return done;
}

bool slide_stream_in_range(const SlideModel *model, const SlideState *state) {
    const uint64_t behind = *state->samples.count - *state->strayed;
    return *state->strayed == 0 || behind >= model->predictor.memory_length;
}

const float *slide_stream_block(const SlideModel *model, const SlideState *state) {
    return model->predictor.family->block(&model->predictor, model->kernel, &state->predictor,
                                          *state->samples.count - 1);
}

static void estimate_until(const SlideModel *model, SlideState *state, uint64_t count) {
    slide_estimate_catch_up(&model->estimator, model->kernel, &model->samples, &state->samples,
                            count, &state->estimate);
}

static void bound_until(const SlideModel *model, SlideState *state, uint64_t count) {
    slide_bound_catch_up(slide_stream_judge(model, state), model->kernel, &model->samples,
                         &state->samples, count, &state->bound);
}

/* To the newest sample. What is found before a forecast begins stays when that is forgotten: else
 * each step would have to find all of it again. */
static void find(const SlideModel *model, SlideState *state, SlideFound found,
                 void (*until)(const SlideModel *, SlideState *, uint64_t)) {
    const uint64_t known = slide_forecast_known(model, state);
    if (*found.known < known) {
        until(model, state, known);
        slide_forecast_keep(state, found);
    }
    until(model, state, *state->samples.count);
}

void slide_stream_estimate(const SlideModel *model, SlideState *state) {
    const SlideFound found = {state->estimate.known, state->estimate.evaluated};
    find(model, state, found, estimate_until);
}

void slide_stream_bound(const SlideModel *model, SlideState *state) {
    const SlideFound found = {state->bound.known, state->bound.evaluated};
    find(model, state, found, bound_until);
    if (model->bound.n_expected > 0) {
        slide_stream_estimate(model, state);
    }
    for (size_t i = 0; i < model->bound.n_expected; ++i) {
        model->bound.expected[i] = *slide_estimate_square(&model->estimator, &state->estimate, i,
                                                          *state->samples.count - 1);
    }
    slide_bound_conclude(slide_stream_judge(model, state), model->kernel, &state->bound);
}
