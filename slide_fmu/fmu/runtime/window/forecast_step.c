#include "forecast_step.h"

#include "seen.h"

#include <math.h>
#include <string.h>

/* The number of samples known before the forecast; 0 where all are others since. */
static uint64_t n_known(const SlideState *state) {
    uint64_t count, restarts;
    memcpy(&count, slide_seen_part(state, state->aside, state->samples.count), sizeof count);
    memcpy(&restarts, slide_seen_part(state, state->aside, state->restarts), sizeof restarts);
    return restarts == *state->restarts ? count : 0;
}

/* What was only forecast is forgotten: the networks and the history are at the start of the last
 * step. What the importer was given stays, where the bound judges it, unless all samples are
 * others. */
static void forget_forecast(const SlideModel *model, SlideState *state) {
    const SlideSeenCopy back = {state->aside, state->strayed, n_known(state),
                                *state->samples.count};
    slide_history_go_back(&model->history, &state->history, SLIDE_MARK_FORECAST);
    if (back.first == 0) {
        slide_seen_copy_all(state, state->aside, state->strayed);
        return;
    }
    slide_seen_copy_samples(model, state, &back);
    if (!model->bound.judges_given) {
        slide_seen_copy_predicted(model, state, &back);
    }
    slide_seen_copy_found(model, state, &back);
}

/* What networks have seen by now is known; the rest is forecast. */
static void keep_known(const SlideModel *model, SlideState *state, bool first) {
    const SlideSeenCopy copy = {state->strayed, state->aside, n_known(state),
                                *state->samples.count};
    if (first || copy.first == 0) {
        slide_seen_copy_all(state, state->strayed, state->aside);
        return;
    }
    slide_seen_copy_samples(model, state, &copy);
    slide_seen_copy_predicted(model, state, &copy);
    slide_seen_copy_found(model, state, &copy);
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
    keep_known(model, state, first);
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

/* What a step may change, to undo it when it fails. The room for it holds the state but the steps of
 * its history, then what was known before the forecast. Where few samples change, the rest is not
 * written to, but for what the estimator and the bound found: they find it again. */
typedef struct {
    unsigned char *state, *known;
    uint64_t first, end; /* numbers of the samples that may change; first 0: all */
} Backup;

/* Before it, samples are taken again that were forecast, then others are forecast. */
static Backup backup_of(const SlideModel *model, const SlideState *state, double length) {
    const uint64_t n_again = slide_intake_whole(model, state->head->last_length);
    const uint64_t n_ahead = slide_intake_whole(model, length);
    unsigned char *room = state->backup;
    Backup backup = {room, room + state->before_steps, 0, 0};
    if (!slide_stream_fresh(state) && n_again > 0 && n_ahead > 0) {
        backup.first = n_known(state);
        backup.end = backup.first + n_again + n_ahead;
    }
    return backup;
}

static void copy_seen(const SlideModel *model, const SlideState *state, const Backup *backup,
                      const void *from, void *to) {
    if (backup->first == 0) {
        slide_seen_copy_all(state, from, to);
        return;
    }
    const SlideSeenCopy copy = {from, to, backup->first, backup->end};
    slide_seen_copy_samples(model, state, &copy);
    slide_seen_copy_predicted(model, state, &copy);
}

/* From the state to its backup, or back; what networks have seen lies between two other parts. */
static void copy_state(const SlideModel *model, const SlideState *state, const Backup *backup,
                       const unsigned char *from, unsigned char *to) {
    const unsigned char *start = (const unsigned char *)state->head;
    const size_t seen = (size_t)((const unsigned char *)state->strayed - start);
    const size_t after = seen + state->seen_size;
    memcpy(to, from, seen);
    copy_seen(model, state, backup, from + seen, to + seen);
    memcpy(to + after, from + after, state->before_steps - after);
}

/* Back to before a step that failed, with what was forecast then. */
static void undo_forecast(const SlideModel *model, SlideState *state, const Backup *backup) {
    SlideHistory *history = &state->history;
    slide_history_go_back(&model->history, history, SLIDE_MARK_STEP);
    copy_state(model, state, backup, backup->state, (unsigned char *)state->head);
    copy_seen(model, state, backup, backup->known, state->aside);
    if (!slide_stream_fresh(state)) {
        slide_history_go_back(&model->history, history, SLIDE_MARK_FORECAST);
        slide_history_append(&model->history, history, state->head->last_length, state->goal,
                             false);
    }
}

bool slide_forecast_step(const SlideModel *model, SlideState *state, double length) {
    const Backup backup = backup_of(model, state, length);
    copy_state(model, state, &backup, (const unsigned char *)state->head, backup.state);
    copy_seen(model, state, &backup, state->aside, backup.known);
    bool done = reach_now(model, state, length);
    if (done) {
        slide_step_begin(model, state, length);
        done = step_forecast(model, state);
    }
    if (!done) {
        undo_forecast(model, state, &backup);
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
    const ptrdiff_t place =
        (const unsigned char *)found.known - (const unsigned char *)state->strayed;
    memcpy((unsigned char *)state->aside + place, found.known, found.size);
}
