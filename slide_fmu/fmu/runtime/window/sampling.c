#include "sampling.h"

#include "ranges.h"

#include <string.h>

/* A hold can have the effect of a moving input in a sample up to the order of (w h)^2 (w0 h)^2, with w0
 * of the system: so much of a correction may be wrong. The companion of the bound sees it, so that the
 * disagreement shows what that does to the outputs. */
static const double IN_DOUBT = 1.0;

/* The same of what samples next to each other give one another. */
static const double SPREAD_IN_DOUBT = 0.5;

/* What a sample gives another one; the companion sees more of it. */
static void give(const SlideModel *model, uint64_t age, size_t input, double amount) {
    const size_t place = (size_t)age * model->n_inputs + input;
    model->taken[place] += amount;
    if (model->others.capacity > 0) {
        model->others_taken[place] += SPREAD_IN_DOUBT * amount;
    }
}

/* Shares of a moment, of the sample that is next to the one that has it, of itself, and of the one before;
 * of the newest, of itself and those before. */
static const double SHARES[] = {0.5, 0, -0.5}, OF_NEWEST[] = {1.5, -2, 0.5};

/* What a sample of an age has of a moment goes to those beside it, of so many. */
static void spread(const SlideModel *model, uint64_t age, uint64_t count) {
    const double *moments = model->moments + (size_t)age * model->n_inputs;
    const double *shares = age > 0 ? SHARES : OF_NEWEST;
    const uint64_t first = age > 0 ? age - 1 : 0;
    for (size_t i = 0; i < model->n_inputs; ++i) {
        for (size_t n = 0; moments[i] != 0 && n <= SLIDE_SPREAD && first + n < count; ++n) {
            give(model, first + n, i, shares[n] * moments[i]);
        }
    }
}

/* Physical samples become those that networks see, and what of a correction the companion sees more is
 * added to them. */
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

static void sample(const SlideModel *model, const SlideState *state, uint64_t count, double before,
                   bool spreads) {
    const size_t n_inputs = model->n_inputs;
    const uint64_t n_read = count + spreads; /* the one before gives something, too */
    SlideReader reader = slide_history_reader(&model->history, &state->history);
    reader.straight = state->head->known != 0;
    for (uint64_t left = n_read; left-- > 0;) {
        const double end = -(double)left * model->step - before;
        const SlideActing acting = {model->inputs, model->corrected,
                                    model->moments + left * n_inputs};
        slide_history_sample(&reader, end - model->step, end, &acting);
        for (size_t i = 0; left < count && model->others.capacity > 0 && i < n_inputs; ++i) {
            model->others_taken[left * n_inputs + i] = IN_DOUBT * model->corrected[i];
        }
        if (left < count) {
            memcpy(model->taken + left * n_inputs, model->inputs, n_inputs * sizeof(double));
            model->strays[left] = strays(model, model->taken + left * n_inputs);
        }
    }
    for (uint64_t age = spreads ? 0 : n_read; age < n_read; ++age) {
        spread(model, age, count);
    }
    scale(model, count);
}

void slide_sample(const SlideModel *model, const SlideState *state, uint64_t count, double before) {
    sample(model, state, count, before, model->n_unsettled > 0);
}

void slide_sample_newest(const SlideModel *model, const SlideState *state) {
    sample(model, state, 1 + SLIDE_BEFORE, 0, false);
}

void slide_sampling_recall(const SlideModel *model, SlideState *state) {
    const bool window = state->head->prehistory == SLIDE_INITIAL_WINDOW_KNOWN;
    const size_t n_inputs = model->n_inputs, count = window ? model->memory_length : 1;
    const double *rows = window ? state->window : slide_stream_prehistory(model, state);
    for (size_t sample = 0; sample < count; ++sample) {
        /* inputs that move reach the value of a sample by its end */
        const size_t begin = model->history.first_order && sample > 0 ? sample - 1 : sample;
        slide_history_append(&model->history, &state->history, model->step,
                             rows + begin * n_inputs);
    }
    memcpy(state->history.end, rows + (count - 1) * n_inputs, n_inputs * sizeof *rows);
}
