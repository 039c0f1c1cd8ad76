#include "sampling.h"

#include <string.h>

void slide_sample(const SlideModel *model, const SlideState *state, uint64_t count, double before) {
    SlideReader reader = slide_history_reader(&model->history, &state->history);
    for (uint64_t left = count; left-- > 0;) {
        const double end = -(double)left * model->step - before;
        slide_history_sample(&reader, end - model->step, end, model->inputs);
        slide_sampling_scale(model, model->inputs, model->taken + left * model->n_inputs);
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
