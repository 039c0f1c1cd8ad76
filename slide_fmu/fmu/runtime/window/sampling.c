#include "sampling.h"

#include <string.h>

/* A hold can have the effect of a moving input in a sample up to the order of (w h)^2 (w0 h)^2, with w0
 * of the system: so much of a correction may be wrong. The companion of the bound sees it, so that the
 * disagreement shows what that does to the outputs. */
static const double IN_DOUBT = 1.0;

void slide_sample(const SlideModel *model, const SlideState *state, uint64_t count, double before) {
    SlideReader reader = slide_history_reader(&model->history, &state->history);
    reader.straight = state->head->known != 0;
    for (uint64_t left = count; left-- > 0;) {
        const double end = -(double)left * model->step - before;
        slide_history_sample(&reader, end - model->step, end, model->inputs, model->corrected);
        slide_sampling_scale(model, model->inputs, model->taken + left * model->n_inputs);
        if (model->others.capacity > 0) {
            for (size_t i = 0; i < model->n_inputs; ++i) {
                model->inputs[i] += IN_DOUBT * model->corrected[i];
            }
            slide_sampling_scale(model, model->inputs, model->others_taken + left * model->n_inputs);
        }
    }
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
