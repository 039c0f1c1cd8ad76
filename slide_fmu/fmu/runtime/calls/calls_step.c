/* The communication step. */
#include "calls.h"

#include <math.h>
#include <string.h>

/* Why a step of this size cannot be taken, or NULL. */
static const char *fault_of(double time, double length, double sample_step) {
    if (!(length > 0) || !isfinite(length)) {
        return "expected a positive, finite step";
    }
    if (fabs(time + length) > slide_clock_farthest(sample_step)) {
        return "its end is so far from 0 that steps cannot be told apart there";
    }
    double seen = (time + length) - time;
    return fabs(seen - length) <= length / 4 ? NULL : "it is too small to be told apart from zero";
}

static const double SHORTEST_DIRECTOR = 1e-6;

/* An angle needs a direction. The file names inputs for people only: here they are references. */
static bool has_direction(const SlideInstance *instance, const double *inputs, const char *which,
                          const char *function) {
    size_t cosine = slide_without_direction(&instance->model, inputs, SHORTEST_DIRECTOR);
    if (cosine == instance->model.n_inputs) {
        return true;
    }
    slide_report(instance, SLIDE_ERROR,
                 "%s: %s with value references %u and %u = %g, %g, which gives no direction; "
                 "expected cosine and sine of an angle, not both zero (length at least %g): set "
                 "both and step again; nothing was changed",
                 function, which, (unsigned)cosine, (unsigned)cosine + 1, inputs[cosine],
                 inputs[cosine + 1], SHORTEST_DIRECTOR);
    return false;
}

static bool have_direction(const SlideInstance *instance, const char *function) {
    const SlideModel *model = &instance->model;
    const SlideState *state = &instance->state;
    if (!has_direction(instance, state->inputs, "inputs", function)) {
        return false;
    }
    if (!slide_stream_fresh(state)) {
        return true;
    }
    bool window = state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN;
    const double *inputs = slide_stream_prehistory(model, state);
    bool good = has_direction(instance, inputs, "initial inputs of those", function);
    for (size_t age = 1; window && good && age < model->n_sampled; ++age) {
        good = has_direction(instance, inputs - age * model->n_inputs, "initial window of those",
                             function);
    }
    return good;
}

static bool stream_step(SlideInstance *instance, double length, const char *function) {
    SlideState *state = &instance->state;
    if (!have_direction(instance, function)) {
        return false;
    }
    if (!slide_stream_step(&instance->model, state, length)) {
        slide_report(instance, SLIDE_ERROR,
                     "%s: the outputs at %.9g s are not finite; set inputs within their ranges and "
                     "step again; nothing was changed",
                     function, slide_clock_time(&state->head->clock) + length);
        return false;
    }
    return true;
}

/* Show the state to the master, which may ask to end the step at a time, until. True when that is
 * reached. */
static bool show(SlideInstance *instance, bool last, double *until) {
    SlideHead *head = instance->state.head;
    const double now = slide_clock_time(&head->clock);
    double asked = now;
    head->mode = SLIDE_BETWEEN;
    if (instance->watcher.show(&instance->watcher, now, last, &asked)) {
        *until = asked;
    }
    head->mode = SLIDE_STEPPING;
    return !last && slide_clock_reaches(&head->clock, now, *until, instance->model.step);
}

/* What ramps move between in the step that begins now. True when they move. */
static bool begin_ramps(SlideInstance *instance) {
    const SlideModel *model = &instance->model;
    SlideState *state = &instance->state;
    const bool first = slide_stream_fresh(state);
    const size_t row = model->n_inputs * sizeof(double);
    memcpy(instance->watcher.from,
           first ? slide_stream_prehistory(model, state)
                 : slide_history_newest(&model->history, &state->history),
           row);
    memcpy(instance->watcher.to, state->inputs, row);
    return model->history.ramp;
}

/* A communication step, as the stream takes it: so many parts of a length in s, each of which takes
 * the stride of the master's time. */
typedef struct {
    uint32_t count;
    double part, stride;
} Walk;

/* The parts one by one; when one fails, the state is what it was before the first. Ramps go on as if
 * nobody watched until inputs are set. */
static bool watched_steps(SlideInstance *instance, double point, Walk walk, bool *early,
                          const char *function) {
    const SlideModel *model = &instance->model;
    SlideWatcher *watcher = &instance->watcher;
    SlideState *state = &instance->state;
    bool moves = begin_ramps(instance) && walk.count > 1;
    double until = INFINITY;
    if (walk.count > 1) { /* a single one undoes itself */
        memcpy(watcher->undo, state->head, state->size);
    }
    for (uint32_t left = walk.count; left-- > 0 && !*early;) {
        if (moves) {
            slide_history_between(&model->history, watcher->from, watcher->to,
                                  (double)left / walk.count, state->inputs);
        }
        if (!stream_step(instance, walk.part, function)) {
            if (walk.count > 1) {
                memcpy(state->head, watcher->undo, state->size);
            }
            return false;
        }
        slide_clock_advance(&state->head->clock, point, walk.stride);
        point = slide_clock_time(&state->head->clock);
        watcher->was_set = false;
        *early = show(instance, left == 0, &until);
        moves = moves && !watcher->was_set;
    }
    if (moves) {
        memcpy(state->inputs, watcher->to, model->n_inputs * sizeof(double));
    }
    return true;
}

/* Wrong steps are errors, not discarded ones: a master may try a discarded step again for ever. */
SlideStatus slide_do_step(void *component, double point, double length, bool *early,
                          const char *function) {
    SlideInstance *instance = slide_enter(component, SLIDE_STEPPING, function);
    bool unwanted = false;
    early = early == NULL ? &unwanted : early;
    *early = false;
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    SlideClock *clock = &instance->state.head->clock;
    double step = instance->model.step, time = slide_clock_time(clock);
    if (!slide_clock_is_now(clock, point, step)) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: communication point %.15g s; expected %.15g s, the end of the "
                            "last step; nothing was changed",
                            function, point, time);
    }
    const char *fault = fault_of(time, length, step);
    if (fault != NULL) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: communication step %.9g s at %.9g s: %s; nothing was changed",
                            function, length, time, fault);
    }
    const double stop = instance->stop;
    if (!slide_clock_reaches(clock, stop, time + length, step)) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: communication step %.9g s at %.9g s ends after the stop time "
                            "%.9g s; nothing was changed",
                            function, length, time, stop);
    }
    double meant = slide_clock_meant(clock, length, step), samples = nearbyint(meant / step);
    if (instance->watcher.show != NULL) {
        /* derivatives of inputs, which a state of FMI 2.0 may bring, are those of a whole step */
        bool whole = meant == samples * step && samples <= UINT32_MAX &&
                     !instance->state.head->moving;
        Walk walk = {1, meant, length};
        if (whole) {
            walk = (Walk){(uint32_t)samples, step, length / samples};
        }
        return watched_steps(instance, point, walk, early, function) ? SLIDE_OK : SLIDE_ERROR;
    }
    if (!stream_step(instance, meant, function)) {
        return SLIDE_ERROR;
    }
    slide_clock_advance(clock, point, length);
    return SLIDE_OK;
}
