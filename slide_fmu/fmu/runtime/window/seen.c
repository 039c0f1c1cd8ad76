#include "seen.h"

#include "ranges.h"

#include <math.h>
#include <string.h>

void slide_seen_place(SlideSeen *seen, const SlideModel *model, SlideArena *arena) {
    const SlideNetwork *predictor = &model->predictor;
    seen->head = slide_place(arena, 1, sizeof *seen->head);
    slide_samples_place(&seen->samples, &model->samples, arena);
    if (model->others.capacity > 0) {
        slide_samples_place(&seen->others, &model->others, arena);
    }
    predictor->family->place_state(&seen->predictor, predictor, arena);
    if (slide_is_recurrent(predictor->family)) {
        predictor->family->place_before(&seen->known, predictor, arena);
        for (size_t i = 0; model->n_unsettled > 0 && i < SLIDE_SPREAD; ++i) {
            predictor->family->place_before(&seen->later[i], predictor, arena);
        }
    }
    seen->given = slide_place(arena, model->n_outputs, sizeof *seen->given);
    seen->revised = slide_place(arena, model->n_unsettled > 0 ? model->n_outputs : 0,
                                sizeof *seen->revised);
    seen->kept = slide_place(arena, model->n_kept, sizeof *seen->kept);
    slide_estimate_place(&seen->estimate, &model->estimator, arena);
    slide_bound_place_state(&seen->bound, &model->bound, arena);
}

size_t slide_seen_size(const SlideModel *model) {
    SlideArena arena = {NULL, 0};
    SlideSeen measured;
    slide_seen_place(&measured, model, &arena);
    return arena.used;
}

void slide_seen_copy(const SlideModel *model, const SlideSeen *from, SlideSeen *to) {
    memcpy(to->head, from->head, slide_seen_size(model));
}

void slide_seen_clear(const SlideModel *model, SlideSeen *seen, const SlideSeen *other) {
    const SlideNetwork *network = &model->predictor;
    memset(seen->head, 0, slide_seen_size(model));
    if (other != NULL && slide_is_recurrent(network->family)) {
        network->family->keep(network, &other->predictor, &seen->predictor);
    }
}

/* A sample that is out of range leaves its number, once it is counted. */
static void append(const SlideModel *model, SlideSeen *seen, SlideSample sample) {
    slide_samples_append(&model->samples, &seen->samples, sample.inputs);
    if (model->others.capacity > 0) {
        slide_samples_append(&model->others, &seen->others, sample.others);
    }
    seen->head->since += 1;
    if (sample.strays) {
        seen->head->strayed = *seen->samples.count;
    }
}

/* What the predictor gave after a sample, for the bound; nothing, before it has seen all that this
 * depends on. */
static void remember(const SlideModel *model, SlideSeen *seen, uint64_t sample, bool given) {
    if (model->bound.memory_length > 0) {
        const bool whole =
            given && *seen->predictor.cells.taken >= model->predictor.memory_length;
        slide_bound_remember(&model->bound, &seen->bound, sample, whole ? seen->given : NULL);
    }
}

void slide_seen_restart(const SlideModel *model, SlideSeen *seen, SlideSample sample) {
    *seen->head = (SlideSeenHead){.since = INFINITY};
    slide_samples_fill(&model->samples, &seen->samples, sample.inputs);
    if (model->others.capacity > 0) {
        slide_samples_fill(&model->others, &seen->others, sample.others);
    }
    slide_network_restart(&model->predictor, &seen->predictor, sample.inputs,
                          slide_seen_newest(model, seen));
    slide_estimate_restart(&model->estimator, &seen->estimate);
    slide_bound_restart(&model->bound, &seen->bound);
    remember(model, seen, *seen->samples.count - 1, false);
    if (sample.strays) {
        seen->head->strayed = *seen->samples.count;
    }
}

/* The values that the network gives after the sample that it has seen. */
static bool evaluate(const SlideModel *model, SlideSeen *seen, uint64_t sample) {
    const SlideNetwork *network = &model->predictor;
    const float *values =
        network->family->evaluate(network, model->kernel, &seen->predictor, sample);
    bool finite = true;
    for (size_t i = 0; i < model->n_outputs; ++i) {
        seen->given[i] = values[i];
        finite = finite && isfinite(values[i]);
    }
    return finite;
}

/* The predictor goes on by a sample of this number. */
static bool advance(const SlideModel *model, SlideSeen *seen, SlideSample sample,
                    uint64_t number, bool wanted) {
    const SlideFamily *family = model->predictor.family;
    const bool evaluated = wanted || slide_is_recurrent(family);
    if (!slide_network_see(&model->predictor, &seen->predictor, number, sample.inputs,
                           slide_seen_newest(model, seen)) ||
        (evaluated && !evaluate(model, seen, number))) {
        return false;
    }
    family->accept(&model->predictor, &seen->predictor);
    return true;
}

/* What comes next may be taken back alone. */
static void note_later(const SlideModel *model, SlideSeen *seen, uint64_t number) {
    const SlideNetwork *network = &model->predictor;
    if (model->n_unsettled > 0) {
        seen->head->strayed_later[number % SLIDE_SPREAD] = seen->head->strayed;
    }
    if (model->n_unsettled > 0 && slide_is_recurrent(network->family)) {
        network->family->keep(network, &seen->predictor, &seen->later[number % SLIDE_SPREAD]);
    }
}

bool slide_seen_take(const SlideModel *model, SlideSeen *seen, SlideSample sample,
                     bool wanted) {
    const uint64_t number = *seen->samples.count;
    note_later(model, seen, number);
    if (!advance(model, seen, sample, number, wanted)) {
        return false;
    }
    remember(model, seen, number, true);
    append(model, seen, sample);
    return true;
}

void slide_seen_pass(const SlideModel *model, SlideSeen *seen, SlideSample sample) {
    remember(model, seen, *seen->samples.count, false);
    append(model, seen, sample);
}

bool slide_seen_settle(const SlideModel *model, SlideSeen *seen, SlideSample sample,
                       uint64_t less) {
    const uint64_t number = *seen->samples.count;
    const uint64_t n_settling = model->predictor.n_settling;
    for (uint64_t left = n_settling > less ? n_settling - less : 0; left > 0; --left) {
        if (!advance(model, seen, sample, number, left == 1)) {
            return false;
        }
    }
    remember(model, seen, number - 1, true);
    return true;
}

void slide_seen_number_back(const SlideModel *model, SlideSeen *seen, uint64_t count) {
    *seen->samples.count -= count;
    if (model->others.capacity > 0) {
        *seen->others.count -= count;
    }
}

void slide_seen_open(const SlideModel *model, SlideSeen *seen) {
    const SlideNetwork *network = &model->predictor;
    if (slide_is_recurrent(network->family)) {
        network->family->keep(network, &seen->predictor, &seen->known);
    }
    seen->head->strayed_known = seen->head->strayed;
    seen->head->n_open = 0;
}

/* Layers remember one sample more than they look at. So many of the newest slots have samples that
 * are taken back: in their place they see what was there. */
static void see_again(const SlideModel *model, SlideSeen *seen, uint64_t n_lost) {
    const SlideNetwork *network = &model->predictor;
    const uint64_t n_slots = (uint64_t)network->n_samples + 1, count = *seen->samples.count;
    for (uint64_t i = 0; i < n_lost && i < n_slots; ++i) {
        const uint64_t number = count - n_slots + i;
        const double *sample = slide_samples_at(&model->samples, &seen->samples, number);
        slide_network_see(network, &seen->predictor, number, sample, sample + model->n_inputs);
    }
}

static void forget(const SlideModel *model, SlideSeen *seen, const SlideNetworkState *known,
                   uint64_t n_lost) {
    const SlideNetwork *network = &model->predictor;
    if (slide_is_recurrent(network->family)) {
        network->family->keep(network, known, &seen->predictor);
    } else {
        see_again(model, seen, n_lost);
    }
}

static void count_back(const SlideModel *model, SlideSeen *seen, uint64_t count) {
    *seen->samples.count = count;
    if (model->others.capacity > 0) {
        *seen->others.count = count;
    }
}

/* The head, without its open samples. */
static void close_head(const SlideModel *model, SlideSeenHead *head) {
    head->end -= (double)head->n_open * model->step;
    head->since = fmax(head->since - (double)head->n_open, 0);
    head->strayed = head->strayed_known;
    head->n_open = 0;
}

/* So many samples are lost; before them, the predictor and what strayed were so. */
static void lose(const SlideModel *model, SlideSeen *seen, uint64_t count,
                 const SlideNetworkState *before, uint64_t strayed) {
    SlideSeenHead *head = seen->head;
    count_back(model, seen, *seen->samples.count - count);
    head->end -= (double)count * model->step;
    head->since = fmax(head->since - (double)count, 0);
    head->strayed = strayed;
    head->n_open -= count;
    forget(model, seen, before, count > 1 ? count : 0);
    slide_estimate_take_back(&model->estimator, &seen->estimate, *seen->samples.count);
    slide_bound_take_back(&model->bound, &seen->bound, *seen->samples.count);
}

void slide_seen_take_back(const SlideModel *model, SlideSeen *seen) {
    lose(model, seen, seen->head->n_open, &seen->known, seen->head->strayed_known);
}

uint64_t slide_seen_take_some_back(const SlideModel *model, SlideSeen *seen, uint64_t count) {
    if (count >= seen->head->n_open || count > SLIDE_SPREAD || model->n_unsettled == 0) {
        count = seen->head->n_open;
        slide_seen_take_back(model, seen);
    } else {
        const size_t place = (size_t)((*seen->samples.count - count) % SLIDE_SPREAD);
        lose(model, seen, count, &seen->later[place], seen->head->strayed_later[place]);
    }
    return count;
}

void slide_seen_know(const SlideModel *model, SlideSeen *seen, uint64_t n_open) {
    const SlideNetwork *network = &model->predictor;
    if (n_open > 0 && (n_open >= seen->head->n_open || n_open > SLIDE_SPREAD)) {
        return;
    }
    if (n_open > 0) {
        const size_t place = (size_t)((*seen->samples.count - n_open) % SLIDE_SPREAD);
        seen->head->strayed_known = seen->head->strayed_later[place];
        if (slide_is_recurrent(network->family)) {
            network->family->keep(network, &seen->later[place], &seen->known);
        }
    }
    seen->head->n_open = n_open;
}

void slide_seen_restore(const SlideModel *model, SlideSeen *seen, const SlideSeenHead *head,
                        uint64_t count, const SlideNetworkState *known) {
    count_back(model, seen, count - head->n_open);
    *seen->head = *head;
    close_head(model, seen->head);
    forget(model, seen, known, UINT64_MAX);
}
