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

/* Rows of a matrix in the file, and how they are placed. */
typedef struct {
    const unsigned char *rows, *bias; /* bias: f32, or NULL for none */
    size_t n_in, n_out;
} Source;

static void fill_layer(SlideLayer *layer, const Source *source) {
    for (size_t row = 0; row < source->n_out; ++row) {
        size_t panel = row / SLIDE_PANEL, lane = row % SLIDE_PANEL;
        for (size_t i = 0; i < source->n_in; ++i) {
            size_t place = (panel * source->n_in + i) * SLIDE_PANEL + lane;
            layer->weights[place] = slide_f32(source->rows + 4 * (row * source->n_in + i));
        }
        layer->bias[row] = source->bias == NULL ? 0 : slide_f32(source->bias + 4 * row);
    }
}

/* Some rows of a matrix and its bias, where there are any. */
static Source rows_of(const unsigned char *weights, const unsigned char *bias, size_t n_in,
                      size_t first, size_t count) {
    return (Source){weights + 4 * first * n_in, bias == NULL ? NULL : bias + 4 * first, n_in,
                    count};
}

/* The block comes zeroed, so the padding of the last panel needs no care. */
static SlideLayer place_layer(const Source *source, SlideArena *arena) {
    SlideLayer layer = {.n_in = source->n_in,
                        .n_panels = (source->n_out + SLIDE_PANEL - 1) / SLIDE_PANEL};
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
    const size_t n_dropped = view->n_values - n_kept;
    const unsigned char *at = view->layers;
    network->n_layers = view->n_layers;
    network->layers = slide_place(arena, view->n_layers, sizeof *network->layers);
    network->widest = 0;
    for (uint32_t i = 0; i < view->n_layers; ++i) {
        LayerView found;
        at = layer_at(at, &found);
        size_t first = i + 1 == view->n_layers ? n_dropped : 0;
        Source source =
            rows_of(found.weights, found.bias, found.n_in, first, found.n_out - first);
        SlideLayer layer = place_layer(&source, arena);
        layer.activation = found.activation;
        network->widest = layer.n_panels > network->widest ? layer.n_panels : network->widest;
        if (arena->base != NULL) {
            network->layers[i] = layer;
        }
    }
    network->skip = (SlideLayer){0};
    if (view->skip != NULL) {
        Source source = rows_of(view->skip, NULL, view->n_first, n_dropped, n_kept);
        network->skip = place_layer(&source, arena);
    }
    network->scratch[0] = slide_place(arena, network->widest, SLIDE_PANEL * sizeof(float));
    network->scratch[1] = slide_place(arena, network->widest, SLIDE_PANEL * sizeof(float));
}

void slide_feed_forward_place_block(SlideFeedForward *network, const SlideLayersView *view,
                                    uint32_t n_kept, SlideArena *arena) {
    const unsigned char *at = view->layers;
    LayerView last = {0};
    for (uint32_t i = 0; i < view->n_layers; ++i) {
        at = layer_at(at, &last);
    }
    network->n_kept = n_kept;
    network->n_older = view->n_values - n_kept;
    Source source = rows_of(last.weights, last.bias, last.n_in, 0, network->n_older);
    network->older = place_layer(&source, arena);
    network->older.activation = last.activation;
    network->older_skip = (SlideLayer){0};
    if (view->skip != NULL) {
        source = rows_of(view->skip, NULL, view->n_first, 0, network->n_older);
        network->older_skip = place_layer(&source, arena);
    }
    size_t padded = network->older.n_panels * SLIDE_PANEL;
    network->block = slide_place(arena, padded + n_kept, sizeof(float));
}

void slide_layer_affine(const SlideLayer *layer, const SlideKernel *kernel, const float *start,
                        const float *x, float *y) {
    kernel->affine(layer->weights, start, x, layer->n_in, layer->n_panels, y);
}

const float *slide_feed_forward_evaluate(const SlideFeedForward *network,
                                         const SlideKernel *kernel, const float *window) {
    const float *x = window;
    float *y = NULL;
    for (uint32_t i = 0; i < network->n_layers; ++i) {
        const SlideLayer *layer = &network->layers[i];
        y = network->scratch[i % 2];
        slide_layer_affine(layer, kernel, layer->bias, x, y);
        kernel->activate(layer->activation, y, layer->n_panels * SLIDE_PANEL);
        x = y;
    }
    slide_layer_affine(&network->skip, kernel, y, window, y);
    return y;
}

const float *slide_feed_forward_block(const SlideFeedForward *network, const SlideKernel *kernel,
                                      const float *window) {
    const SlideLayer *older = &network->older;
    const float *kept = slide_feed_forward_evaluate(network, kernel, window);
    const float *x = network->n_layers > 1 ? network->scratch[network->n_layers % 2] : window;
    slide_layer_affine(older, kernel, older->bias, x, network->block);
    kernel->activate(older->activation, network->block, older->n_panels * SLIDE_PANEL);
    slide_layer_affine(&network->older_skip, kernel, network->block, window, network->block);
    memcpy(network->block + network->n_older, kept, network->n_kept * sizeof *kept);
    return network->block;
}
