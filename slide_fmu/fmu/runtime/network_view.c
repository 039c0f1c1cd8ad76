#include "network_view.h"

#include <math.h>

/* Numbers of activations, as in slide_fmu/payload.py. */
enum { TANH = 3, CUBIC = 5, N_ACTIVATIONS = 6, MAX_DIFFERENCES = 2 };

static bool too_short(SlideMessage *message, const char *what) {
    return slide_say(message, "surrogate file is damaged: %s ends too early", what);
}

static bool check_finite(const unsigned char *values, uint64_t count, const char *what,
                         SlideMessage *message) {
    for (uint64_t i = 0; i < count; ++i) {
        if (!isfinite(slide_f32(values + 4 * i))) {
            return slide_say(message, "surrogate file: %s number %llu is not finite", what,
                             (unsigned long long)i);
        }
    }
    return true;
}

const unsigned char *slide_layer_view(const unsigned char *at, SlideLayerView *layer) {
    layer->n_in = slide_u32(at);
    layer->n_out = slide_u32(at + 4);
    layer->activation = slide_u32(at + 8);
    layer->weights = at + 12;
    layer->bias = layer->weights + (uint64_t)layer->n_in * layer->n_out * 4;
    return layer->bias + (uint64_t)layer->n_out * 4;
}

static bool read_layer(uint64_t *width, SlideCursor *section, SlideMessage *message) {
    uint32_t n_in, n_out, activation;
    if (!slide_take_u32(section, &n_in) || !slide_take_u32(section, &n_out) ||
        !slide_take_u32(section, &activation)) {
        return too_short(message, "a layer");
    }
    if (n_in != *width) {
        return slide_say(message, "surrogate file: a layer takes %u values; expected %llu",
                         (unsigned)n_in, (unsigned long long)*width);
    }
    if (activation >= N_ACTIVATIONS) {
        return slide_say(message, "surrogate file: activation %u; expected less than %d",
                         (unsigned)activation, (int)N_ACTIVATIONS);
    }
    uint64_t count = (uint64_t)n_in * n_out;
    const unsigned char *weights = slide_take(section, count, 4);
    const unsigned char *bias = weights == NULL ? NULL : slide_take(section, n_out, 4);
    if (bias == NULL) {
        return too_short(message, "a layer");
    }
    *width = n_out;
    return check_finite(weights, count, "weight", message) &&
           check_finite(bias, n_out, "bias", message);
}

static bool read_skip(SlideLayersView *layers, uint64_t n_values, SlideCursor *section,
                      SlideMessage *message) {
    uint32_t has_skip;
    if (!slide_take_u32(section, &has_skip)) {
        return too_short(message, "a network");
    }
    if (has_skip > 1) {
        return slide_say(message, "surrogate file: skip flag %u; expected 0 or 1",
                         (unsigned)has_skip);
    }
    layers->skip = NULL;
    if (has_skip == 0) {
        return true;
    }
    uint64_t count = n_values * layers->n_first;
    layers->skip = slide_take(section, count, 4);
    return layers->skip == NULL ? too_short(message, "the linear skip")
                                : check_finite(layers->skip, count, "skip weight", message);
}

static bool read_layers(SlideNetworkView *network, uint32_t n_inputs, SlideCursor *section,
                        SlideMessage *message) {
    SlideLayersView *layers = &network->layers;
    if (!slide_take_u32(section, &network->n_samples) ||
        !slide_take_u32(section, &layers->n_layers)) {
        return too_short(message, "a network");
    }
    if (network->n_samples < 1 || layers->n_layers < 1) {
        return slide_say(message, "surrogate file: a network has no samples or no layers");
    }
    uint64_t width = (uint64_t)network->n_samples * n_inputs;
    layers->n_first = (uint32_t)width; /* exact once the first layer fits */
    layers->layers = section->at;
    for (uint32_t i = 0; i < layers->n_layers; ++i) {
        if (!read_layer(&width, section, message)) {
            return false;
        }
    }
    network->n_values = (uint32_t)width;
    return read_skip(layers, width, section, message);
}

static bool read_matrix(const unsigned char **matrix, uint64_t rows, uint64_t columns,
                        SlideCursor *section, SlideMessage *message) {
    *matrix = slide_take(section, rows * columns, 4);
    return *matrix == NULL ? too_short(message, "a cell")
                           : check_finite(*matrix, rows * columns, "weight", message);
}

/* Every product of two sizes stays below 2^64: where a matrix was taken before, its sizes are
 * bounded by the file's. */
static bool read_weights(SlideCellView *cell, uint64_t n_values, SlideCursor *section,
                         SlideMessage *message) {
    uint64_t n = cell->n_states, q = cell->n_features, units = cell->n_units;
    return read_matrix(&cell->a, n, n, section, message) &&
           read_matrix(&cell->b, n, q, section, message) &&
           read_matrix(&cell->e, n, units, section, message) &&
           read_matrix(&cell->w, units, n + q + 1, section, message) &&
           read_matrix(&cell->c, n_values, n, section, message) &&
           read_matrix(&cell->d, n_values, q, section, message) &&
           read_matrix(&cell->d0, n_values, 1, section, message);
}

static bool check_cell(const SlideNetworkView *network, SlideMessage *message) {
    const SlideCellView *cell = &network->cell;
    if (cell->n_out < 1 || cell->n_out > network->n_samples) {
        return slide_say(message,
                         "surrogate file: n_samples %u, n_out %u of a cell; expected 1 <= n_out "
                         "<= n_samples",
                         (unsigned)network->n_samples, (unsigned)cell->n_out);
    }
    if (cell->n_states < 1 || network->n_values < 1) {
        return slide_say(message, "surrogate file: a cell has no states or no values");
    }
    if (cell->activation != TANH && cell->activation != CUBIC) {
        return slide_say(message, "surrogate file: activation %u of a cell; expected %d or %d",
                         (unsigned)cell->activation, (int)TANH, (int)CUBIC);
    }
    return cell->differences <= MAX_DIFFERENCES ||
           slide_say(message, "surrogate file: differences %u; expected at most %d",
                     (unsigned)cell->differences, (int)MAX_DIFFERENCES);
}

static bool read_cell(SlideNetworkView *network, uint32_t n_inputs, SlideCursor *section,
                      SlideMessage *message) {
    SlideCellView *cell = &network->cell;
    if (!slide_take_u32(section, &network->n_samples) || !slide_take_u32(section, &cell->n_out) ||
        !slide_take_u32(section, &cell->n_states) || !slide_take_u32(section, &cell->n_units) ||
        !slide_take_u32(section, &network->n_values) ||
        !slide_take_u32(section, &cell->activation) ||
        !slide_take_u32(section, &cell->differences)) {
        return too_short(message, "a cell");
    }
    if (!check_cell(network, message)) {
        return false;
    }
    uint64_t n_features = (uint64_t)n_inputs * (cell->differences + 1);
    if (!read_matrix(&cell->feature_scale, n_features, 1, section, message)) {
        return false;
    }
    cell->n_features = (uint32_t)n_features;
    for (uint64_t i = 0; i < n_features; ++i) {
        if (!(slide_f32(cell->feature_scale + 4 * i) > 0)) {
            return slide_say(message, "surrogate file: a feature scale is not positive");
        }
    }
    return read_weights(cell, network->n_values, section, message);
}

bool slide_network_read(SlideNetworkView *network, uint32_t n_inputs, SlideCursor *section,
                        SlideMessage *message) {
    if (!slide_take_u32(section, &network->kind)) {
        return too_short(message, "a network");
    }
    switch (network->kind) {
    case SLIDE_FEED_FORWARD:
        return read_layers(network, n_inputs, section, message);
    case SLIDE_STATE_SPACE:
        return read_cell(network, n_inputs, section, message);
    default:
        return slide_say(message,
                         "surrogate file: network of kind %u; expected %d (feed-forward) or %d "
                         "(state space)",
                         (unsigned)network->kind, (int)SLIDE_FEED_FORWARD, (int)SLIDE_STATE_SPACE);
    }
}
