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
