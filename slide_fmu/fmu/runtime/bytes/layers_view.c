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

static bool read_layer(uint64_t *width, SlideCursor *section, SlideMessage *message) {
    uint32_t n_in, n_out, activation;
    const unsigned char *weights, *bias;
    if (!slide_take_u32(section, &n_in) || !slide_take_u32(section, &n_out) ||
        !slide_take_u32(section, &activation)) {
        return slide_too_short(message, "a layer");
    }
    if (n_in != *width) {
        return slide_say(message, "surrogate file: a layer takes %u values; expected %llu",
                         (unsigned)n_in, (unsigned long long)*width);
    }
    if (activation >= N_ACTIVATIONS) {
        return slide_say(message, "surrogate file: activation %u; expected less than %d",
                         (unsigned)activation, (int)N_ACTIVATIONS);
    }
    *width = n_out;
    return slide_read_f32(&weights, n_out, n_in, section, "weight", message) &&
           slide_read_f32(&bias, n_out, 1, section, "bias", message);
}

static bool read_skip(SlideLayersView *layers, SlideCursor *section, SlideMessage *message) {
    uint32_t has_skip;
    if (!slide_take_u32(section, &has_skip)) {
        return slide_too_short(message, "a network");
    }
    if (has_skip > 1) {
        return slide_say(message, "surrogate file: skip flag %u; expected 0 or 1",
                         (unsigned)has_skip);
    }
    layers->skip = NULL;
    return has_skip == 0 || slide_read_f32(&layers->skip, layers->n_values, layers->n_first,
                                           section, "skip weight", message);
}

/* The oldest sample of the window comes first, and each is newer than the one before. */
static bool read_ages(SlideLayersView *layers, SlideCursor *section, SlideMessage *message) {
    if (!slide_read_indices(&layers->ages, layers->n_samples, section, "ages", message)) {
        return false;
    }
    uint32_t last = layers->n_samples;
    for (size_t i = 0; i < layers->ages.count; ++i) {
        uint32_t age = slide_u32(layers->ages.at + 4 * i);
        if (age >= last || (i == 0 && age != last - 1)) {
            return slide_say(message,
                             "surrogate file: a network looks at a sample of age %u; expected "
                             "ages that fall from %u on",
                             (unsigned)age, (unsigned)layers->n_samples - 1);
        }
        last = age;
    }
    return true;
}

bool slide_layers_read(SlideLayersView *layers, uint32_t n_features, SlideCursor *section,
                       SlideMessage *message) {
    if (!slide_take_u32(section, &layers->n_samples) ||
        !slide_take_u32(section, &layers->n_layers)) {
        return slide_too_short(message, "a network");
    }
    if (layers->n_samples < 1 || layers->n_layers < 1) {
        return slide_say(message, "surrogate file: a network has no samples or no layers");
    }
    if (!read_ages(layers, section, message)) {
        return false;
    }
    uint32_t n_seen = layers->ages.count > 0 ? layers->ages.count : layers->n_samples;
    uint64_t width = (uint64_t)n_seen * n_features;
    layers->n_first = (uint32_t)width; /* exact once the first layer fits */
    layers->layers = section->at;
    for (uint32_t i = 0; i < layers->n_layers; ++i) {
        if (!read_layer(&width, section, message)) {
            return false;
        }
    }
    layers->n_values = (uint32_t)width;
    return read_skip(layers, section, message);
}
