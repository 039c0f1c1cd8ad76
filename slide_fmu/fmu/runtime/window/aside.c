#include "aside.h"

#include "intake.h"
#include "seen.h"

#include <math.h>
#include <string.h>

static const double SLACK = 1e-6; /* in sample steps: lengths of steps are rounded */

/* Where the backup of a state holds what lay aside. */
static unsigned char *aside_of_backup(const SlideState *state) {
    return (unsigned char *)state->backup + state->before_steps;
}

static bool same_parameters(const SlideModel *model, const SlideState *state) {
    const size_t row = model->parameters.count * sizeof(double);
    return row == 0 || memcmp(state->acting, state->parameters, row) == 0;
}

/* More samples than a window cost as much as to see it anew. */
static bool is_whole(const SlideModel *model, double samples) {
    return samples >= 1 && samples <= model->n_in && samples == nearbyint(samples);
}

uint32_t slide_aside_resumed(const SlideModel *model, const SlideState *state) {
    const double resumed = state->head->resumed;
    return !slide_stream_fresh(state) && is_whole(model, resumed) ? (uint32_t)resumed : 0;
}

/* Samples from what is aside to the end of a step of so many; 0: it does not go on from there. */
static double samples_since(const SlideModel *model, const SlideState *state, double step) {
    const double samples = state->head->aside + step, whole = nearbyint(samples);
    const bool goes_on = state->head->aside > 0 && fabs(samples - whole) <= SLACK;
    return goes_on && is_whole(model, whole) ? whole : 0;
}

void slide_aside_pass(const SlideModel *model, SlideState *state, double samples) {
    if (!same_parameters(model, state)) {
        state->head->aside = 0;
    } else if (state->head->aside > 0) {
        state->head->aside += samples;
    }
}

/* What networks have seen is put aside. What was there comes to their place, if the step goes on from
 * it. */
static void put_aside(const SlideModel *model, SlideState *state) {
    SlideHead *head = state->head;
    const bool goes_on = head->resumed > 0;
    slide_seen_copy_all(state, state->strayed, state->aside);
    if (goes_on) {
        slide_seen_copy_all(state, aside_of_backup(state), state->strayed);
    }
    if (model->parameters.count > 0) {
        const double since = *state->since;
        *state->since = goes_on ? head->aside_since : since;
        head->aside_since = since;
    }
}

void slide_aside_begin(const SlideModel *model, SlideState *state, double length) {
    SlideHead *head = state->head;
    const double samples = length / model->step;
    head->resumed = 0;
    if (slide_intake_whole(model, length) > 0 || !same_parameters(model, state)) {
        slide_aside_pass(model, state, samples);
        return;
    }
    head->resumed = samples_since(model, state, samples);
    put_aside(model, state);
    head->aside = samples;
}

void slide_aside_keep(const SlideState *state) {
    memcpy(aside_of_backup(state), state->aside, state->seen_size);
}

void slide_aside_undo(const SlideState *state) {
    memcpy(state->aside, aside_of_backup(state), state->seen_size);
}
