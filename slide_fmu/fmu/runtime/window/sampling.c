#include "sampling.h"

#include "ranges.h"

#include <math.h>
#include <string.h>

/* Shares of the moments of a sample, in the one after it, in itself and in those before it; of the newest,
 * which has none after it, in itself and in those before. What one mean less before the sample would
 * change, its fourth difference, may be wrong in part (SlideBound.doubt). */
typedef struct {
    double of[SLIDE_MOMENTS], in_doubt[SLIDE_MOMENTS];
} Share;
#define IN_DOUBT(factor) {(factor)*5.0 / 48, (factor) / 16.0, -(factor) / 12.0}
static const Share SHARES[SLIDE_SPREAD + 2] = {{{3.0 / 16, 7.0 / 16, 1.0 / 4}, {0, 0, 0}},
                                               {{25.0 / 24, -3.0 / 4, -5.0 / 6}, IN_DOUBT(1)},
                                               {{-7.0 / 4, 1.0 / 8, 1}, IN_DOUBT(-4)},
                                               {{5.0 / 8, 1.0 / 4, -1.0 / 2}, IN_DOUBT(6)},
                                               {{-5.0 / 48, -1.0 / 16, 1.0 / 12}, IN_DOUBT(-4)},
                                               {{0, 0, 0}, IN_DOUBT(1)}};
static const Share OF_NEWEST[SLIDE_SPREAD + 1] = {
    {{95.0 / 48, 23.0 / 16, 5.0 / 12}, IN_DOUBT(1)},
    {{-29.0 / 8, -17.0 / 4, -3.0 / 2}, IN_DOUBT(-4)},
    {{5.0 / 2, 37.0 / 8, 2}, IN_DOUBT(6)},
    {{-25.0 / 24, -9.0 / 4, -7.0 / 6}, IN_DOUBT(-4)},
    {{3.0 / 16, 7.0 / 16, 1.0 / 4}, IN_DOUBT(1)}};

/* A sum over the moments of an input, [SLIDE_MOMENTS][n_inputs]; 0 where it has none. */
static double weighed(const double *weights, const double *moments, size_t n_inputs) {
    double sum = 0;
    for (size_t order = 0; order < SLIDE_MOMENTS; ++order) {
        sum += weights[order] * moments[order * n_inputs];
    }
    return sum;
}

/* What a sample of an age has of moments goes to those beside it, of so many. */
static void spread(const SlideModel *model, uint64_t age, uint64_t count) {
    const size_t n_inputs = model->n_inputs;
    const Share *shares = age > 0 ? SHARES : OF_NEWEST;
    const uint64_t newest = age > 0 ? age - 1 : 0, oldest = age + SLIDE_SPREAD;
    for (size_t i = 0; i < n_inputs; ++i) {
        const double *moments = model->moments + (size_t)age * SLIDE_MOMENTS * n_inputs + i;
        const bool changes = moments[0] != 0 || moments[n_inputs] != 0 || moments[2 * n_inputs] != 0;
        for (uint64_t to = newest; changes && to <= oldest && to < count; ++to) {
            const Share *share = &shares[to - newest];
            const size_t place = (size_t)to * n_inputs + i;
            model->taken[place] += weighed(share->of, moments, n_inputs);
            if (model->others.capacity > 0) {
                model->others_taken[place] +=
                    model->bound.doubt * weighed(share->in_doubt, moments, n_inputs);
            }
        }
    }
}

/* Samples that move smoothly have no moments: what is held instead has their effect, as long as their
 * slopes go on from one to the next. Where they do not, at a kink or where samples begin to have moments, the
 * rest of this effect is that of the input's value at the edge. It is given to the older sample. */
static void bend(const SlideModel *model, uint64_t age) {
    const size_t n_inputs = model->n_inputs, place = (size_t)age * n_inputs;
    const double *ends = model->edges + 2 * place + n_inputs;
    const double *begins = model->edges + 2 * (place - n_inputs);
    double *moments = model->moments + SLIDE_MOMENTS * place;
    for (size_t i = 0; i < n_inputs; ++i) {
        const double less = ends[i] - begins[i];
        double part = less;
        model->taken[place + i] += part;
        for (size_t order = 0; order < SLIDE_MOMENTS; ++order) {
            part /= 2; /* the edge is at s = 1/2 */
            moments[order * n_inputs + i] += part;
        }
    }
}

/* Physical samples become those that networks see. The companion of the bound sees besides what may be wrong
 * in them: the disagreement shows what that does to the outputs. */
static void scale(const SlideModel *model, uint64_t count) {
    for (uint64_t age = 0; age < count; ++age) {
        double *inputs = model->taken + age * model->n_inputs;
        double *others = model->others_taken + age * model->n_inputs;
        for (size_t i = 0; model->others.capacity > 0 && i < model->n_inputs; ++i) {
            others[i] = slide_scaled(model, i, inputs[i] + others[i]);
        }
        slide_sampling_scale(model, inputs, inputs);
    }
}

/* Does the training have such a sample? */
static bool strays(const SlideModel *model, const double *inputs) {
    slide_sampling_scale(model, inputs, model->inputs);
    return !slide_in_range(model->inputs, model->n_inputs, model->cosine);
}

/* A hold can have the effect of a moving input in a sample up to the order of (w h)^2 (w0 h)^2, with w0 of the
 * system: of a correction, which is of the order of (w h)^2, about (w0 h)^2 may be wrong. Where w0 h is 0.4 the
 * doubt is 0.74, and this part 0.2. */
static double doubted(const SlideBound *bound) {
    const double part = 0.6 * bound->doubt;
    return fmin(part * part, 1);
}

/* A sample makes up for the jumps before it; so it may go beyond the range, where no input was. */
static void make_up(const SlideModel *model, uint64_t age) {
    const double *left = model->moments + (size_t)age * SLIDE_MOMENTS * model->n_inputs;
    double *inputs = model->taken + (size_t)age * model->n_inputs;
    for (size_t i = 0; i < model->n_inputs; ++i) {
        inputs[i] += left[i];
    }
}

/* Where what acts in a sample of an age comes to. */
static SlideActing acting_at(const SlideModel *model, uint64_t age) {
    const size_t n_inputs = model->n_inputs, place = (size_t)age * n_inputs;
    const bool apart = model->others.capacity > 0;
    return (SlideActing){model->taken + place, apart ? model->others_taken + place : model->corrected,
                         model->moments + place * SLIDE_MOMENTS, model->edges + place * 2};
}

/* Samples come from the history, unless they are kept: those from an age on. */
static void read(const SlideModel *model, const SlideState *state, uint64_t n_read,
                 uint64_t n_fresh, const double *kept, double before) {
    const size_t n_inputs = model->n_inputs, row = n_inputs * sizeof(double);
    SlideReader reader = slide_history_reader(&model->history, &state->history);
    reader.straight = state->head->known != 0;
    reader.doubted = model->history.first_order ? model->bound.doubt : doubted(&model->bound);
    for (uint64_t left = n_read; left-- > 0;) {
        const SlideActing acting = acting_at(model, left);
        if (left < n_fresh) {
            const double end = -(double)left * model->step - before;
            slide_history_sample(&reader, end - model->step, end, &acting);
        } else {
            const double *of = kept + (size_t)(left - n_fresh) * SLIDE_ACTING * n_inputs;
            memcpy(acting.inputs, of, row);
            memcpy(acting.corrected, of + n_inputs, row);
            memcpy(acting.moments, of + 2 * n_inputs, SLIDE_MOMENTS * row);
            memcpy(acting.edges, of + (2 + SLIDE_MOMENTS) * n_inputs, 2 * row);
        }
    }
}

/* What acts in samples becomes what networks see. They may be felt in each other; then the oldest only
 * counts for its moments. */
static void form(const SlideModel *model, uint64_t count, bool spreads) {
    for (uint64_t age = 0; age < count; ++age) {
        model->strays[age] = strays(model, model->taken + age * model->n_inputs);
    }
    for (uint64_t age = 0; model->history.jumps && age < count; ++age) {
        make_up(model, age);
    }
    for (uint64_t age = 1; spreads && age <= count; ++age) {
        bend(model, age);
    }
    for (uint64_t age = 0; spreads && age <= count; ++age) {
        spread(model, age, count);
    }
    scale(model, count);
}

void slide_sample(const SlideModel *model, const SlideState *state, uint64_t count, double before) {
    const bool spreads = model->n_unsettled > 0; /* the one before gives something, too */
    read(model, state, count + spreads, count + spreads, NULL, before);
    form(model, count, spreads);
}

bool slide_sample_phase(const SlideModel *model, const SlideState *state, SlidePhase *phase,
                        uint64_t count, uint64_t n_open, double before) {
    if (model->n_unsettled == 0) {
        slide_sample(model, state, count, before);
        return false;
    }
    const size_t n_inputs = model->n_inputs, row = n_inputs * sizeof(double);
    const bool kept = phase->head->kept == *phase->samples.count && phase->head->kept > 0;
    read(model, state, count + 1, kept ? count - SLIDE_SPREAD : count + 1, phase->kept, before);
    const bool keeps = n_open >= SLIDE_SPREAD && n_open <= count;
    for (uint64_t i = 0; keeps && i <= SLIDE_SPREAD; ++i) {
        double *of = phase->kept + i * SLIDE_ACTING * n_inputs;
        const SlideActing acting = acting_at(model, n_open - SLIDE_SPREAD + i);
        memcpy(of, acting.inputs, row);
        memcpy(of + n_inputs, acting.corrected, row);
        memcpy(of + 2 * n_inputs, acting.moments, SLIDE_MOMENTS * row);
        memcpy(of + (2 + SLIDE_MOMENTS) * n_inputs, acting.edges, 2 * row);
    }
    form(model, count, true);
    return keeps;
}

void slide_sample_newest(const SlideModel *model, const SlideState *state) {
    const uint64_t count = 1 + SLIDE_BEFORE;
    read(model, state, count, count, NULL, 0);
    form(model, count, false);
}

void slide_sampling_recall(const SlideModel *model, SlideState *state) {
    const size_t n_inputs = model->n_inputs, count = (size_t)slide_stream_n_before(model, state);
    const double *rows = slide_stream_prehistory(model, state) - (count - 1) * n_inputs;
    for (size_t sample = 0; sample < count; ++sample) {
        /* inputs that move reach the value of a sample by its end */
        const size_t begin = model->history.first_order && sample > 0 ? sample - 1 : sample;
        slide_history_append(&model->history, &state->history, model->step,
                             rows + begin * n_inputs);
    }
    memcpy(state->history.end, rows + (count - 1) * n_inputs, n_inputs * sizeof *rows);
}
