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
        return "so far from 0, steps cannot be told apart";
    }
    double advance = (time + length) - time;
    return fabs(advance - length) <= length / 4 ? NULL : "it is too small to be told apart from zero";
}

static const double SHORTEST_DIRECTOR = 1e-6;

/* An angle needs a direction. The file names inputs for people only: here they are references. */
static bool has_direction(const SlideInstance *instance, const double *inputs, const char *which) {
    const SlideModel *model = &instance->model;
    for (unsigned i = 0; i < model->n_inputs; ++i) {
        if (model->cosine[i] && !(hypot(inputs[i], inputs[i + 1]) >= SHORTEST_DIRECTOR)) {
            slide_report(instance, SLIDE_ERROR,
                         "%s with value references %u and %u = %g, %g, which gives no direction; "
                         "expected cosine and sine of an angle (length at least %g); nothing was "
                         "changed",
                         which, i, i + 1, inputs[i], inputs[i + 1], SHORTEST_DIRECTOR);
            return false;
        }
    }
    return true;
}

static bool have_direction(const SlideInstance *instance) {
    const SlideModel *model = &instance->model;
    const SlideState *state = &instance->state;
    const char *which = slide_window_is_known(state) ? "initial window of those" : "initial inputs of those";
    const double *before = slide_stream_reached(model, state);
    const size_t n_before =
        slide_stream_fresh(state) ? (size_t)slide_stream_n_before(model, state) : 0;
    bool good = has_direction(instance, state->inputs, "inputs");
    for (size_t age = 0; good && age < n_before; ++age) {
        good = has_direction(instance, before - age * model->n_inputs, which);
    }
    return good;
}

/* further: the last step goes on, since its inputs are forecast and were not set again. It is forecast
 * as if it had had its whole length from the begin. */
static bool stream_step(SlideInstance *instance, double length, bool further) {
    SlideState *state = &instance->state;
    if (!further && !have_direction(instance)) {
        return false;
    }
    bool done = further ? slide_stream_go_on(&instance->model, state)
                        : slide_stream_step(&instance->model, state, length);
    if (!done) {
        slide_report(instance, SLIDE_ERROR,
                     "the outputs at %.9g s are not finite; set inputs within their ranges and "
                     "step again; nothing was changed",
                     slide_clock_time(&state->head->clock) + length);
        return false;
    }
    return true;
}

/* Show the state to the importer, which may ask to end the step at a time, until. True when that
 * is reached. */
static bool show(SlideInstance *instance, bool last, double *until) {
    SlideHead *head = instance->state.head;
    const double now = slide_clock_time(&head->clock);
    const char *function = instance->function; /* the importer may call others in between */
    double asked = now;
    head->mode = SLIDE_BETWEEN;
    if (instance->watcher.show(&instance->watcher, now, last, &asked)) {
        *until = asked;
    }
    head->mode = SLIDE_STEPPING;
    instance->function = function;
    return !last && slide_clock_reaches(&head->clock, now, *until, instance->model.step);
}

/* What inputs move between in the step that begins now, where each part of it is told the inputs
 * at its end. */
static void begin_parts(SlideInstance *instance) {
    const SlideModel *model = &instance->model;
    SlideWatcher *watcher = &instance->watcher;
    const size_t row = model->n_inputs * sizeof(double);
    memcpy(watcher->from, slide_stream_reached(model, &instance->state), row);
    memcpy(watcher->to, instance->state.inputs, row);
    memset(watcher->set, 0, model->n_inputs * sizeof(bool));
}

/* Inputs that the importer did not set have these values. */
static void give_others(SlideInstance *instance, const double *values) {
    for (size_t i = 0; i < instance->model.n_inputs; ++i) {
        if (!instance->watcher.set[i]) {
            instance->state.inputs[i] = values[i];
        }
    }
}

static bool any_set(const SlideInstance *instance) {
    bool any = false;
    for (size_t i = 0; i < instance->model.n_inputs; ++i) {
        any |= instance->watcher.set[i];
    }
    return any;
}

/* A part where inputs move to what was set for the end of the step: those that the importer set on
 * the way have reached it, the others go on. */
static bool take_part_known(SlideInstance *instance, double length, double left) {
    const SlideModel *model = &instance->model;
    const SlideWatcher *watcher = &instance->watcher;
    slide_history_between(&model->history, watcher->from, watcher->to, left, model->inputs);
    give_others(instance, model->inputs);
    return stream_step(instance, length, false);
}

/* A part where inputs are forecast. Where the importer set some, the forecast begins anew there, and
 * the others are what they were expected to be. */
static bool take_part_forecast(SlideInstance *instance, double length, bool first) {
    const SlideState *state = &instance->state;
    SlideWatcher *watcher = &instance->watcher;
    const size_t row = instance->model.n_inputs * sizeof(double);
    if (first || !any_set(instance)) {
        return stream_step(instance, length, !first);
    }
    give_others(instance, state->history.end);
    const bool done = stream_step(instance, length, false);
    give_others(instance, watcher->to);
    memcpy(watcher->to, state->inputs, row);
    memset(watcher->set, 0, instance->model.n_inputs * sizeof(bool));
    return done;
}

/* A communication step, as the stream takes it: so many parts of a length in s, each of which
 * takes the stride of the importer's time. */
typedef struct {
    uint32_t count;
    double part, stride;
} Walk;

/* One part, or as many as samples where the importer watches: not while inputs have derivatives,
 * which a state of FMI 2.0 may bring, since they are those of a whole step. */
static Walk walk_of(const SlideInstance *instance, double length) {
    const double step = instance->model.step;
    const double meant = slide_clock_meant(&instance->state.head->inner, length, step);
    const double samples = nearbyint(meant / step);
    const bool apart = instance->watcher.show != NULL && !instance->state.head->moving &&
                       meant == samples * step && samples <= UINT32_MAX;
    return apart ? (Walk){(uint32_t)samples, step, length / samples} : (Walk){1, meant, length};
}

static bool take_part(SlideInstance *instance, Walk walk, uint32_t left) {
    const SlideModel *model = &instance->model;
    if (walk.count == 1) {
        return stream_step(instance, walk.part, false);
    }
    return model->history.first_order && !slide_stream_forecasts(model, &instance->state)
               ? take_part_known(instance, walk.part, (double)left / walk.count)
               : take_part_forecast(instance, walk.part, left + 1 == walk.count);
}

/* The parts one by one; when one fails, the state is what it was before the first. Inputs go on as
 * if nobody watched until they are set. */
static bool take_parts(SlideInstance *instance, double point, Walk walk, bool *early) {
    SlideWatcher *watcher = &instance->watcher;
    SlideState *state = &instance->state;
    double until = INFINITY;
    if (walk.count > 1) { /* a single one undoes itself */
        memcpy(watcher->undo, state->head, state->size);
        begin_parts(instance);
    }
    for (uint32_t left = walk.count; left-- > 0 && !*early;) {
        if (!take_part(instance, walk, left)) {
            if (walk.count > 1) {
                memcpy(state->head, watcher->undo, state->size);
            }
            return false;
        }
        slide_clock_advance(&state->head->clock, point, walk.stride);
        point = slide_clock_time(&state->head->clock);
        *early = watcher->show != NULL && show(instance, left == 0, &until);
    }
    if (walk.count > 1) {
        give_others(instance, watcher->to);
    }
    return true;
}

/* Wrong steps are errors, not discarded ones: an importer may try a discarded step again for
 * ever. */
static SlideStatus check_step(const SlideInstance *instance, double point, double length) {
    const SlideClock *clock = &instance->state.head->clock;
    const double step = instance->model.step, time = slide_clock_time(clock);
    if (!slide_clock_is_now(clock, point, step)) {
        return slide_report(instance, SLIDE_ERROR,
                            "communication point %.15g s; expected %.15g s, the end of the last "
                            "step; nothing was changed",
                            point, time);
    }
    const char *fault = fault_of(time, length, step);
    if (fault != NULL) {
        return slide_report(instance, SLIDE_ERROR,
                            "communication step %.9g s at %.9g s: %s; nothing was changed", length,
                            time, fault);
    }
    const double samples = slide_clock_meant(&instance->state.head->inner, length, step) / step;
    if (instance->state.head->prehistory == SLIDE_OUTPUTS_KNOWN && samples != nearbyint(samples)) {
        return slide_report(instance, SLIDE_ERROR,
                            "communication step %.9g s with prehistory_known = 3; expected a multiple "
                            "of %.9g s, the own step of the FMU: outputs before the start show a state "
                            "at its samples only; nothing was changed",
                            length, step);
    }
    if (slide_stream_fresh(&instance->state)) { /* outputs may be missing that show the state */
        const SlideStatus status = slide_check_start(instance);
        if (status != SLIDE_OK) {
            return status;
        }
    }
    return slide_clock_reaches(clock, instance->stop, time + length, step)
               ? SLIDE_OK
               : slide_report(instance, SLIDE_ERROR,
                              "communication step %.9g s at %.9g s ends after the stop time %.9g "
                              "s; nothing was changed",
                              length, time, instance->stop);
}

SlideStatus slide_do_step(SlideInstance *instance, double point, double length, bool *early) {
    bool unwanted = false;
    early = early == NULL ? &unwanted : early;
    *early = false;
    SlideStatus status = check_step(instance, point, length);
    if (status == SLIDE_OK && !take_parts(instance, point, walk_of(instance, length), early)) {
        status = SLIDE_ERROR;
    }
    return status;
}
