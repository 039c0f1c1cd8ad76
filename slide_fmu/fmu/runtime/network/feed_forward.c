#include "feed_forward.h"

#include <string.h>

typedef struct {
    uint32_t n_in, n_out, activation;
    const unsigned char *weights; /* f32 [n_out][n_in] */
    const unsigned char *bias;    /* f32 [n_out] */
} LayerView;

enum { N_ACTIVATIONS = 6 };

/* Describe the layer at a place of a checked network; gives the place of the next one. */
static const unsigned char *layer_at(const unsigned char *at, LayerView *layer) {
    layer->n_in = slide_u32(at);
    layer->n_out = slide_u32(at + 4);
    layer->activation = slide_u32(at + 8);
    layer->weights = at + 12;
    layer->bias = layer->weights + 4 * (uint64_t)layer->n_in * layer->n_out;
    return layer->bias + (uint64_t)layer->n_out * 4;
}

static void read_layer(uint64_t *width, SlideCursor *cursor) {
    const uint32_t n_in = slide_take_u32(cursor, "a layer");
    const uint32_t n_out = slide_take_u32(cursor, "a layer");
    const uint32_t activation = slide_take_u32(cursor, "a layer");
    slide_check(cursor, n_in == *width, "surrogate file: a layer takes %u values; expected %llu",
                (unsigned)n_in, (unsigned long long)*width);
    slide_check(cursor, activation < N_ACTIVATIONS,
                "surrogate file: activation %u; expected less than %d", (unsigned)activation,
                (int)N_ACTIVATIONS);
    slide_take_f32s(cursor, n_out, n_in, "weight");
    slide_take_f32s(cursor, n_out, 1, "bias");
    *width = n_out;
}

static void read_skip(SlideLayersView *layers, SlideCursor *cursor) {
    const uint32_t has_skip = slide_take_u32(cursor, "a network");
    slide_check(cursor, has_skip <= 1, "surrogate file: skip flag %u; expected 0 or 1",
                (unsigned)has_skip);
    layers->skip = has_skip == 0 ? NULL
                                 : slide_take_f32s(cursor, layers->n_values, layers->n_first,
                                                   "skip weight");
}

/* The oldest sample of the window comes first, and each is newer than the one before. */
static void read_ages(SlideLayersView *layers, SlideCursor *cursor) {
    layers->ages = slide_take_indices(cursor, layers->n_samples, "ages");
    uint32_t last = layers->n_samples;
    for (size_t i = 0; cursor->good && i < layers->ages.count; ++i) {
        uint32_t age = slide_u32(layers->ages.at + 4 * i);
        slide_check(cursor, age < last && (i > 0 || age == last - 1),
                    "surrogate file: a network looks at a sample of age %u; expected ages that "
                    "fall from %u on",
                    (unsigned)age, (unsigned)layers->n_samples - 1);
        last = age;
    }
}

void slide_layers_read(SlideLayersView *layers, uint32_t n_features, SlideCursor *cursor) {
    layers->n_samples = slide_take_u32(cursor, "a network");
    layers->n_layers = slide_take_u32(cursor, "a network");
    slide_check(cursor, layers->n_samples >= 1 && layers->n_layers >= 1,
                "surrogate file: a network has no samples or no layers");
    read_ages(layers, cursor);
    uint32_t n_seen = layers->ages.count > 0 ? layers->ages.count : layers->n_samples;
    uint64_t width = (uint64_t)n_seen * n_features;
    layers->n_first = (uint32_t)width; /* exact once the first layer fits */
    layers->layers = cursor->at;
    for (uint32_t i = 0; cursor->good && i < layers->n_layers; ++i) {
        read_layer(&width, cursor);
    }
    layers->n_values = (uint32_t)width;
    read_skip(layers, cursor);
}

/* A matrix in the file, and its bias, f32, or NULL for none. */
typedef struct {
    const unsigned char *rows, *bias;
    size_t n_in, n_out;
    size_t first; /* the row that comes first; those before it follow after the last one */
} Source;

static void fill_layer(SlideLayer *layer, const Source *source) {
    for (size_t place = 0; place < source->n_out; ++place) {
        const size_t panel = place / SLIDE_PANEL, lane = place % SLIDE_PANEL;
        const size_t row = (place + source->first) % source->n_out;
        float *weights = layer->weights + panel * source->n_in * SLIDE_PANEL + lane;
        for (size_t i = 0; i < source->n_in; ++i) {
            weights[i * SLIDE_PANEL] = slide_f32(source->rows + 4 * (row * source->n_in + i));
        }
        layer->bias[place] = source->bias == NULL ? 0 : slide_f32(source->bias + 4 * row);
    }
}

static size_t panels_for(size_t rows) { return (rows + SLIDE_PANEL - 1) / SLIDE_PANEL; }

/* The block comes zeroed, so the padding of the last panel needs no care. */
static SlideLayer place_layer(const Source *source, uint32_t activation, SlideArena *arena) {
    SlideLayer layer = {.n_in = source->n_in,
                        .n_panels = panels_for(source->n_out),
                        .activation = activation};
    size_t rows = layer.n_panels * source->n_in;
    layer.weights = slide_place(arena, rows, SLIDE_PANEL * sizeof(float));
    layer.bias = slide_place(arena, layer.n_panels, SLIDE_PANEL * sizeof(float));
    if (arena->base != NULL) {
        fill_layer(&layer, source);
    }
    return layer;
}

void slide_feed_forward_place(SlideFeedForward *network, const SlideLayersView *view,
                              uint32_t n_kept, SlideArena *arena) {
    const size_t n_older = view->n_values - n_kept;
    const unsigned char *at = view->layers;
    network->n_layers = view->n_layers;
    network->n_values = view->n_values;
    network->n_kept = n_kept;
    network->layers = slide_place(arena, view->n_layers, sizeof *network->layers);
    network->widest = 0;
    for (uint32_t i = 0; i < view->n_layers; ++i) {
        LayerView layer_view;
        at = layer_at(at, &layer_view);
        const Source source = {layer_view.weights, layer_view.bias, layer_view.n_in, layer_view.n_out,
                               i + 1 == view->n_layers ? n_older : 0};
        const SlideLayer layer = place_layer(&source, layer_view.activation, arena);
        network->widest = layer.n_panels > network->widest ? layer.n_panels : network->widest;
        if (arena->base != NULL) {
            network->layers[i] = layer;
        }
    }
    network->skip = (SlideLayer){0};
    if (view->skip != NULL) {
        const Source source = {view->skip, NULL, view->n_first, view->n_values, n_older};
        network->skip = place_layer(&source, 0, arena);
    }
    network->scratch[0] = slide_place(arena, 2 * network->widest, SLIDE_PANEL * sizeof(float));
    network->scratch[1] = slide_place(arena, 2 * network->widest, SLIDE_PANEL * sizeof(float));
    network->block = slide_place(arena, view->n_values, sizeof(float));
}

/* So many of the values that are placed first. */
static float *evaluate(const SlideFeedForward *network, const SlideKernel *kernel,
                       const float *window, size_t n_wanted) {
    const SlideLayer *skip = &network->skip;
    const size_t n_last = panels_for(n_wanted);
    const float *x = window;
    float *y = NULL;
    for (uint32_t i = 0; i < network->n_layers; ++i) {
        const SlideLayer *layer = &network->layers[i];
        const size_t n_panels = i + 1 == network->n_layers ? n_last : layer->n_panels;
        y = network->scratch[i % 2];
        kernel->affine(layer->weights, layer->bias, x, layer->n_in, n_panels, y);
        kernel->activate(layer->activation, y, n_panels * SLIDE_PANEL);
        x = y;
    }
    kernel->affine(skip->weights, y, window, skip->n_in, skip->n_panels > 0 ? n_last : 0, y);
    return y;
}

const float *slide_feed_forward_evaluate(const SlideFeedForward *network,
                                         const SlideKernel *kernel, const float *window) {
    return evaluate(network, kernel, window, network->n_kept);
}

void slide_feed_forward_evaluate_two(const SlideFeedForward *network, const SlideKernel *kernel,
                                     const float *const windows[2], const float *values[2]) {
    const SlideLayer *skip = &network->skip;
    const size_t n_last = panels_for(network->n_kept), second = network->widest * SLIDE_PANEL;
    const float *x[2] = {windows[0], windows[1]};
    float *y[2] = {NULL, NULL};
    for (uint32_t i = 0; i < network->n_layers; ++i) {
        const SlideLayer *layer = &network->layers[i];
        const size_t n_panels = i + 1 == network->n_layers ? n_last : layer->n_panels;
        const float *const start[2] = {layer->bias, layer->bias};
        y[0] = network->scratch[i % 2];
        y[1] = y[0] + second;
        kernel->affine_two(layer->weights, start, x, layer->n_in, n_panels, y);
        for (size_t row = 0; row < 2; ++row) {
            kernel->activate(layer->activation, y[row], n_panels * SLIDE_PANEL);
            x[row] = y[row];
        }
    }
    const float *const start[2] = {y[0], y[1]};
    kernel->affine_two(skip->weights, start, windows, skip->n_in,
                       skip->n_panels > 0 ? n_last : 0, y);
    values[0] = y[0];
    values[1] = y[1];
}

const float *slide_feed_forward_block(const SlideFeedForward *network, const SlideKernel *kernel,
                                      const float *window) {
    const size_t n_kept = network->n_kept, n_older = network->n_values - n_kept;
    const float *values = evaluate(network, kernel, window, network->n_values);
    memcpy(network->block, values + n_kept, n_older * sizeof *values);
    memcpy(network->block + n_older, values, n_kept * sizeof *values);
    return network->block;
}
