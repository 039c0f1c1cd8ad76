#include "batch.h"

#include <stdlib.h>
#include <string.h>

enum { CHUNK = 8 * SLIDE_ROWS }; /* rows that pass through a layer before the next layer */

static void affine(const SlideKernel *kernel, const SlideLayer *layer, const SlideRows *rows) {
    kernel->affine_rows(layer->weights, layer->n_in, layer->n_panels, rows);
}

/* CHUNK rows; gives [CHUNK][panels of the last layer][SLIDE_PANEL]. */
static const float *evaluate_chunk(const SlideFeedForward *network, const SlideKernel *kernel,
                                   const float *const *windows, float *scratch) {
    const float *inner[CHUNK], *const *x = windows;
    const size_t half = CHUNK * network->widest * SLIDE_PANEL;
    float *y = NULL;
    for (uint32_t i = 0; i < network->n_layers; ++i) {
        const SlideLayer *layer = &network->layers[i];
        const size_t width = layer->n_panels * SLIDE_PANEL;
        y = scratch + i % 2 * half;
        affine(kernel, layer, &(SlideRows){CHUNK, x, layer->bias, 0, y});
        kernel->activate(layer->activation, y, CHUNK * width);
        for (size_t row = 0; row < CHUNK; ++row) {
            inner[row] = y + row * width;
        }
        x = inner;
    }
    const size_t width = network->skip.n_panels * SLIDE_PANEL;
    affine(kernel, &network->skip, &(SlideRows){CHUNK, windows, y, width, y});
    return y;
}

bool slide_batch_layers(const SlideFeedForward *network, const SlideKernel *kernel,
                        const float *const *rows, size_t count, size_t n_values, float *values) {
    const SlideLayer *last = &network->layers[network->n_layers - 1];
    const size_t width = last->n_panels * SLIDE_PANEL;
    float *scratch = malloc(2 * CHUNK * network->widest * SLIDE_PANEL * sizeof(float));
    for (size_t first = 0; scratch != NULL && first < count; first += CHUNK) {
        const size_t left = count - first, n_rows = left < CHUNK ? left : CHUNK;
        const float *chunk[CHUNK];
        for (size_t row = 0; row < CHUNK; ++row) { /* the last row fills the chunk */
            chunk[row] = rows[first + (row < n_rows ? row : n_rows - 1)];
        }
        const float *found = evaluate_chunk(network, kernel, chunk, scratch);
        for (size_t row = 0; row < n_rows; ++row) {
            memcpy(values + (first + row) * n_values, found + row * width,
                   n_values * sizeof(float));
        }
    }
    free(scratch);
    return scratch != NULL;
}

/* The inputs before a sample of a window [SLIDE_BEFORE][n_inputs], newest first. */
static void gather(const double *window, size_t sample, size_t n_inputs, double *before) {
    for (size_t age = 1; age <= SLIDE_BEFORE; ++age) {
        const size_t place = sample > age ? sample - age : 0;
        memcpy(before + (age - 1) * n_inputs, window + place * n_inputs,
               n_inputs * sizeof(double));
    }
}

bool slide_batch_cells(const SlideNetwork *network, const SlideKernel *kernel,
                       SlideNetworkState *state, const double *const *windows, size_t count,
                       double *before, float *values) {
    const size_t n_inputs = network->seen.n_inputs;
    const size_t n_skipped = network->n_samples - network->n_block;
    float *const turns[2] = {state->cells.states, network->of.cells.next};
    for (size_t window = 0; window < count; ++window) {
        network->family->restart(network, state);
        for (size_t sample = 0; sample < network->n_samples; ++sample) {
            const double *input = windows[window] + sample * n_inputs;
            gather(windows[window], sample, n_inputs, before);
            if (!slide_features_write(&network->seen, input, before, network->features)) {
                return false;
            }
            slide_cells_advance(network, kernel, turns[sample % 2], turns[(sample + 1) % 2]);
            if (sample >= n_skipped) {
                slide_cells_values(network, values);
                values += network->n_values;
            }
        }
    }
    return true;
}
