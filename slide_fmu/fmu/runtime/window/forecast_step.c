#include "forecast_step.h"

#include <math.h>
#include <string.h>

/* Where a part of what networks have seen is kept in state->known. */
static void *kept(const SlideState *state, const void *part) {
    const ptrdiff_t place = (const unsigned char *)part - (const unsigned char *)state->strayed;
    return (unsigned char *)state->known + place;
}

/* The number of samples known before the forecast; 0 where all are others since. */
static uint64_t n_known(const SlideState *state) {
    uint64_t count, restarts;
    memcpy(&count, kept(state, state->samples.count), sizeof count);
    memcpy(&restarts, kept(state, state->restarts), sizeof restarts);
    return restarts == *state->restarts ? count : 0;
}

/* What the importer was given stays, where the bound judges it, unless all samples are others. */
static void keep_given(const SlideModel *model, SlideState *state) {
    const SlideBoundState *bound = &state->bound;
    const uint64_t first = n_known(state);
    if (!model->bound.judges_given || first == 0) {
        return;
    }
    for (uint64_t k = first; k < *state->samples.count; ++k) {
        const float *given = slide_bound_predicted(&model->bound, bound, k);
        memcpy(kept(state, given), given, model->n_outputs * sizeof *given);
    }
}

/* What was only forecast is forgotten: the networks and the history are at the start of the last
 * step. */
static void forget_forecast(const SlideModel *model, SlideState *state) {
    slide_history_go_back(&model->history, &state->history, SLIDE_MARK_FORECAST);
    keep_given(model, state);
    memcpy(state->strayed, state->known, state->seen_size);
}

/* The inputs that were set are those of now. Before a step for which all samples are taken anew,
 * the networks need not see them. */
static bool reach_now(const SlideModel *model, SlideState *state, double length) {
    const bool first = slide_stream_fresh(state);
    if (first) {
        if (!slide_step_begin_run(model, state)) {
            return false;
        }
        state->head->reached_length = model->step;
    } else {
        forget_forecast(model, state);
        state->head->reached_length = state->head->last_length;
    }
    slide_step_keep(model, state);
    const SlideIntake intake = slide_intake_end(model, state);
    if (slide_intake_whole(model, length) > 0) {
        const bool again = !first && !intake.anew;
        if (!(again ? slide_step_take_again : slide_step_take)(model, state, &intake)) {
            return false;
        }
    }
    memcpy(state->known, state->strayed, state->seen_size);
    return true;
}

static bool step_forecast(const SlideModel *model, SlideState *state) {
    const SlideIntake intake = slide_intake_forecast(model, state);
    bool done = slide_step_take(model, state, &intake);
    if (done) {
        slide_step_accept(model, state);
    }
    return done;
}

/* Back to before a step that failed, with what was forecast then. The room for a state holds all
 * but the steps of the history, and what the networks have seen before the forecast. */
static void undo_forecast(const SlideModel *model, SlideState *state) {
    unsigned char *backup = state->backup;
    SlideHistory *history = &state->history;
    slide_history_go_back(&model->history, history, SLIDE_MARK_STEP);
    memcpy(state->head, backup, state->before_steps);
    memcpy(state->known, backup + state->before_steps, state->seen_size);
    if (!slide_stream_fresh(state)) {
        slide_history_go_back(&model->history, history, SLIDE_MARK_FORECAST);
        slide_history_append(&model->history, history, state->head->last_length, state->goal,
                             false);
    }
}

bool slide_forecast_step(const SlideModel *model, SlideState *state, double length) {
    unsigned char *backup = state->backup;
    memcpy(backup, state->head, state->before_steps);
    memcpy(backup + state->before_steps, state->known, state->seen_size);
    bool done = reach_now(model, state, length);
    if (done) {
        slide_step_begin(model, state, length);
        done = step_forecast(model, state);
    }
    if (!done) {
        undo_forecast(model, state);
        return false;
    }
    slide_step_count(model, state, length);
    return true;
}

bool slide_stream_go_on(const SlideModel *model, SlideState *state) {
    const double n_before = nearbyint(state->head->last_length / model->step);
    forget_forecast(model, state);
    state->head->last_length = (n_before + 1) * model->step;
    slide_step_count(model, state, model->step);
    return step_forecast(model, state);
}

uint64_t slide_forecast_known(const SlideModel *model, const SlideState *state) {
    const bool forecasts = slide_stream_forecasts(model, state) && !slide_stream_fresh(state);
    return forecasts ? n_known(state) : 0;
}

void slide_forecast_keep(const SlideState *state, SlideFound found) {
    memcpy(kept(state, found.known), found.known, found.size);
}
