#include "layers_view.h"

enum { N_ACTIVATIONS = 6 };

const unsigned char *slide_layer_view(const unsigned char *at, SlideLayerView *layer) {
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
