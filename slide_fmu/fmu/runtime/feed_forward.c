#include "feed_forward.h"

static void fill_layer(SlideLayer *layer, const unsigned char *weights, const unsigned char *bias,
                       size_t n_out) {
    for (size_t row = 0; row < n_out; ++row) {
        size_t panel = row / SLIDE_PANEL, lane = row % SLIDE_PANEL;
        float *column = layer->weights + panel * layer->n_in * SLIDE_PANEL + lane;
        for (size_t i = 0; i < layer->n_in; ++i) {
            column[i * SLIDE_PANEL] = slide_f32(weights + 4 * (row * layer->n_in + i));
        }
        layer->bias[row] = bias == NULL ? 0 : slide_f32(bias + 4 * row);
    }
}

/* The block comes zeroed, so the padding of the last panel needs no care. */
static SlideLayer place_layer(const unsigned char *weights, const unsigned char *bias, size_t n_in,
                              size_t n_out, SlideArena *arena) {
    SlideLayer layer = {n_in, (n_out + SLIDE_PANEL - 1) / SLIDE_PANEL, 0, NULL, NULL};
    layer.weights = slide_place(arena, layer.n_panels * n_in, SLIDE_PANEL * sizeof(float));
    layer.bias = slide_place(arena, layer.n_panels, SLIDE_PANEL * sizeof(float));
    if (arena->base != NULL) {
        fill_layer(&layer, weights, bias, n_out);
    }
    return layer;
}

void slide_feed_forward_place(SlideFeedForward *network, const SlideLayersView *view,
                              uint32_t n_kept, SlideArena *arena) {
    size_t widest = 0, n_dropped = view->n_values - n_kept;
    const unsigned char *at = view->layers;
    network->n_layers = view->n_layers;
    network->layers = slide_place(arena, view->n_layers, sizeof *network->layers);
    for (uint32_t i = 0; i < view->n_layers; ++i) {
        SlideLayerView source;
        at = slide_layer_view(at, &source);
        size_t first = i + 1 == view->n_layers ? n_dropped : 0;
        SlideLayer layer = place_layer(source.weights + 4 * first * source.n_in,
                                       source.bias + 4 * first, source.n_in,
                                       source.n_out - first, arena);
        layer.activation = source.activation;
        widest = layer.n_panels > widest ? layer.n_panels : widest;
        if (arena->base != NULL) {
            network->layers[i] = layer;
        }
    }
    network->skip = (SlideLayer){0, 0, 0, NULL, NULL};
    if (view->skip != NULL) {
        const unsigned char *rows = view->skip + 4 * n_dropped * view->n_first;
        network->skip = place_layer(rows, NULL, view->n_first, n_kept, arena);
    }
    network->widest = widest;
    network->scratch[0] = slide_place(arena, widest, SLIDE_PANEL * sizeof(float));
    network->scratch[1] = slide_place(arena, widest, SLIDE_PANEL * sizeof(float));
}

const float *slide_feed_forward_evaluate(const SlideFeedForward *network,
                                         const SlideKernel *kernel, const float *window) {
    const float *x = window;
    float *y = NULL;
    for (uint32_t i = 0; i < network->n_layers; ++i) {
        const SlideLayer *layer = &network->layers[i];
        y = network->scratch[i % 2];
        kernel->affine(layer->weights, layer->bias, x, layer->n_in, layer->n_panels, y);
        kernel->activate(layer->activation, y, layer->n_panels * SLIDE_PANEL);
        x = y;
    }
    const SlideLayer *skip = &network->skip;
    kernel->affine(skip->weights, y, window, skip->n_in, skip->n_panels, y);
    return y;
}
