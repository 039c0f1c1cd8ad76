#include "phase.h"

#include "ranges.h"

#include <math.h>
#include <string.h>

void slide_phase_place(SlidePhase *phase, const SlideModel *model, SlideArena *arena) {
    const SlideNetwork *predictor = &model->predictor;
    slide_samples_place(&phase->samples, &model->samples, arena);
    if (model->others.capacity > 0) {
        slide_samples_place(&phase->others, &model->others, arena);
    }
    predictor->family->place_state(&phase->predictor, predictor, arena);
    if (slide_is_recurrent(predictor->family)) {
        predictor->family->place_before(&phase->known, predictor, arena);
        for (size_t i = 0; model->n_unsettled > 0 && i < SLIDE_SPREAD; ++i) {
            predictor->family->place_before(&phase->later[i], predictor, arena);
        }
    }
    phase->given = slide_place(arena, model->n_outputs, sizeof *phase->given);
    phase->revised = slide_place(arena, model->n_unsettled > 0 ? model->n_outputs : 0,
                                sizeof *phase->revised);
    phase->kept = slide_place(arena, model->n_kept, sizeof *phase->kept);
    slide_estimate_place(&phase->estimate, &model->estimator, arena);
    slide_bound_place_state(&phase->bound, &model->bound, arena);
}

size_t slide_phase_size(const SlideModel *model) {
    SlideArena arena = {NULL, 0};
    SlidePhase measured;
    slide_phase_place(&measured, model, &arena);
    return arena.used;
}

void slide_phase_copy(const SlideModel *model, const SlidePhase *from, SlidePhase *to) {
    *to->head = *from->head;
    memcpy(to->samples.count, from->samples.count, slide_phase_size(model));
}

void slide_phase_clear(const SlideModel *model, SlidePhase *phase, const SlidePhase *other) {
    const SlideNetwork *network = &model->predictor;
    *phase->head = (SlidePhaseHead){0};
    memset(phase->samples.count, 0, slide_phase_size(model));
    if (other != NULL && slide_is_recurrent(network->family)) {
        network->family->keep(network, &other->predictor, &phase->predictor);
    }
}

/* A sample that is out of range leaves its number, once it is counted. */
static void append(const SlideModel *model, SlidePhase *phase, SlideSample sample) {
    slide_samples_append(&model->samples, &phase->samples, sample.inputs);
    if (model->others.capacity > 0) {
        slide_samples_append(&model->others, &phase->others, sample.others);
    }
    phase->head->since += 1;
    if (sample.strays) {
        phase->head->strayed = *phase->samples.count;
    }
}

/* What the predictor gave after a sample, for the bound; nothing, before it has seen all that this
 * depends on. */
static void remember(const SlideModel *model, SlidePhase *phase, uint64_t sample, bool given) {
    if (model->bound.memory_length > 0) {
        const bool whole =
            given && *phase->predictor.cells.taken >= model->predictor.memory_length;
        slide_bound_remember(&model->bound, &phase->bound, sample, whole ? phase->given : NULL);
    }
}

void slide_phase_restart(const SlideModel *model, SlidePhase *phase, SlideSample sample) {
    *phase->head = (SlidePhaseHead){.since = INFINITY};
    slide_samples_fill(&model->samples, &phase->samples, sample.inputs);
    if (model->others.capacity > 0) {
        slide_samples_fill(&model->others, &phase->others, sample.others);
    }
    slide_network_restart(&model->predictor, &phase->predictor, sample.inputs,
                          slide_phase_newest(model, phase));
    slide_estimate_restart(&model->estimator, &phase->estimate);
    slide_bound_restart(&model->bound, &phase->bound);
    remember(model, phase, *phase->samples.count - 1, false);
    if (sample.strays) {
        phase->head->strayed = *phase->samples.count;
    }
}

/* The values that the network gives after the sample that it has seen. */
static bool evaluate(const SlideModel *model, SlidePhase *phase, uint64_t sample) {
    const SlideNetwork *network = &model->predictor;
    const float *values =
        network->family->evaluate(network, model->kernel, &phase->predictor, sample);
    bool finite = true;
    for (size_t i = 0; i < model->n_outputs; ++i) {
        phase->given[i] = values[i];
        finite = finite && isfinite(values[i]);
    }
    return finite;
}

/* The predictor goes on by a sample of this number. */
static bool advance(const SlideModel *model, SlidePhase *phase, SlideSample sample,
                    uint64_t number, bool wanted) {
    const SlideFamily *family = model->predictor.family;
    const bool evaluated = wanted || slide_is_recurrent(family);
    if (!slide_network_see(&model->predictor, &phase->predictor, number, sample.inputs,
                           slide_phase_newest(model, phase)) ||
        (evaluated && !evaluate(model, phase, number))) {
        return false;
    }
    family->accept(&model->predictor, &phase->predictor);
    return true;
}

/* What comes next may be taken back alone. */
static void note_later(const SlideModel *model, SlidePhase *phase, uint64_t number) {
    const SlideNetwork *network = &model->predictor;
    if (model->n_unsettled > 0) {
        phase->head->strayed_later[number % SLIDE_SPREAD] = phase->head->strayed;
    }
    if (model->n_unsettled > 0 && slide_is_recurrent(network->family)) {
        network->family->keep(network, &phase->predictor, &phase->later[number % SLIDE_SPREAD]);
    }
}

bool slide_phase_take(const SlideModel *model, SlidePhase *phase, SlideSample sample,
                     bool wanted) {
    const uint64_t number = *phase->samples.count;
    note_later(model, phase, number);
    if (!advance(model, phase, sample, number, wanted)) {
        return false;
    }
    remember(model, phase, number, true);
    append(model, phase, sample);
    return true;
}

void slide_phase_pass(const SlideModel *model, SlidePhase *phase, SlideSample sample) {
    remember(model, phase, *phase->samples.count, false);
    append(model, phase, sample);
}

bool slide_phase_settle(const SlideModel *model, SlidePhase *phase, SlideSample sample,
                       uint64_t less) {
    const uint64_t number = *phase->samples.count;
    const uint64_t n_settling = model->predictor.n_settling;
    for (uint64_t left = n_settling > less ? n_settling - less : 0; left > 0; --left) {
        if (!advance(model, phase, sample, number, left == 1)) {
            return false;
        }
    }
    remember(model, phase, number - 1, true);
    return true;
}

void slide_phase_number_back(const SlideModel *model, SlidePhase *phase, uint64_t count) {
    *phase->samples.count -= count;
    if (model->others.capacity > 0) {
        *phase->others.count -= count;
    }
}

void slide_phase_open(const SlideModel *model, SlidePhase *phase) {
    const SlideNetwork *network = &model->predictor;
    if (slide_is_recurrent(network->family)) {
        network->family->keep(network, &phase->predictor, &phase->known);
    }
    phase->head->strayed_known = phase->head->strayed;
    phase->head->n_open = 0;
}

/* Layers remember one sample more than they look at. So many of the newest slots have samples that
 * are taken back: in their place they see what was there. */
static void see_again(const SlideModel *model, SlidePhase *phase, uint64_t n_lost) {
    const SlideNetwork *network = &model->predictor;
    const uint64_t n_slots = (uint64_t)network->n_samples + 1, count = *phase->samples.count;
    for (uint64_t i = 0; i < n_lost && i < n_slots; ++i) {
        const uint64_t number = count - n_slots + i;
        const double *sample = slide_samples_at(&model->samples, &phase->samples, number);
        slide_network_see(network, &phase->predictor, number, sample, sample + model->n_inputs);
    }
}

static void forget(const SlideModel *model, SlidePhase *phase, const SlideNetworkState *known,
                   uint64_t n_lost) {
    const SlideNetwork *network = &model->predictor;
    if (slide_is_recurrent(network->family)) {
        network->family->keep(network, known, &phase->predictor);
    } else {
        see_again(model, phase, n_lost);
    }
}

static void count_back(const SlideModel *model, SlidePhase *phase, uint64_t count) {
    *phase->samples.count = count;
    if (model->others.capacity > 0) {
        *phase->others.count = count;
    }
}

/* The head, without its open samples. */
static void close_head(const SlideModel *model, SlidePhaseHead *head) {
    head->end -= (double)head->n_open * model->step;
    head->since = fmax(head->since - (double)head->n_open, 0);
    head->strayed = head->strayed_known;
    head->n_open = 0;
}

/* So many samples are lost; before them, the predictor and what strayed were so. */
static void lose(const SlideModel *model, SlidePhase *phase, uint64_t count,
                 const SlideNetworkState *before, uint64_t strayed) {
    SlidePhaseHead *head = phase->head;
    count_back(model, phase, *phase->samples.count - count);
    head->end -= (double)count * model->step;
    head->since = fmax(head->since - (double)count, 0);
    head->strayed = strayed;
    head->n_open -= count;
    forget(model, phase, before, count > 1 ? count : 0);
    slide_estimate_take_back(&model->estimator, &phase->estimate, *phase->samples.count);
    slide_bound_take_back(&model->bound, &phase->bound, *phase->samples.count);
}

void slide_phase_take_back(const SlideModel *model, SlidePhase *phase) {
    lose(model, phase, phase->head->n_open, &phase->known, phase->head->strayed_known);
}

uint64_t slide_phase_take_some_back(const SlideModel *model, SlidePhase *phase, uint64_t count) {
    if (count >= phase->head->n_open || count > SLIDE_SPREAD || model->n_unsettled == 0) {
        count = phase->head->n_open;
        slide_phase_take_back(model, phase);
    } else {
        const size_t place = (size_t)((*phase->samples.count - count) % SLIDE_SPREAD);
        lose(model, phase, count, &phase->later[place], phase->head->strayed_later[place]);
    }
    return count;
}

void slide_phase_know(const SlideModel *model, SlidePhase *phase, uint64_t n_open) {
    const SlideNetwork *network = &model->predictor;
    if (n_open > 0 && (n_open >= phase->head->n_open || n_open > SLIDE_SPREAD)) {
        return;
    }
    if (n_open > 0) {
        const size_t place = (size_t)((*phase->samples.count - n_open) % SLIDE_SPREAD);
        phase->head->strayed_known = phase->head->strayed_later[place];
        if (slide_is_recurrent(network->family)) {
            network->family->keep(network, &phase->later[place], &phase->known);
        }
    }
    phase->head->n_open = n_open;
}

void slide_phase_restore(const SlideModel *model, SlidePhase *phase, uint64_t count,
                        const SlideNetworkState *known) {
    count_back(model, phase, count - phase->head->n_open);
    close_head(model, phase->head);
    forget(model, phase, known, UINT64_MAX);
}
