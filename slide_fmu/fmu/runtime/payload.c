#include "payload.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { VERSION = 1, FEED_FORWARD = 1, N_ACTIVATIONS = 5, MAX_WINDOW = 1 << 20 };

static bool too_short(SlideMessage *message, const char *what) {
    return slide_say(message, "surrogate file is damaged: %s ends too early", what);
}

static bool open_section(SlideCursor *file, const char *tag, SlideCursor *section,
                         SlideMessage *message) {
    const unsigned char *found = slide_take(file, 4, 1);
    uint32_t length;
    if (found == NULL || memcmp(found, tag, 4) != 0) {
        return slide_say(message, "surrogate file is damaged: expected section %s", tag);
    }
    if (!slide_take_u32(file, &length)) {
        return too_short(message, tag);
    }
    section->at = slide_take(file, length, 1);
    section->end = section->at == NULL ? NULL : section->at + length;
    return section->at != NULL || too_short(message, tag);
}

static bool close_section(const SlideCursor *section, const char *tag, SlideMessage *message) {
    return section->at == section->end ||
           slide_say(message, "surrogate file is damaged: %u bytes too many in section %s",
                     (unsigned)(section->end - section->at), tag);
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

static bool read_window(SlidePayload *payload, SlideCursor *file, SlideMessage *message) {
    SlideCursor section;
    if (!open_section(file, "WIND", &section, message)) {
        return false;
    }
    if (!slide_take_f64(&section, &payload->step) || !slide_take_u32(&section, &payload->n_in) ||
        !slide_take_u32(&section, &payload->n_out) ||
        !slide_take_u32(&section, &payload->n_inputs) ||
        !slide_take_u32(&section, &payload->n_outputs)) {
        return too_short(message, "WIND");
    }
    if (!(isfinite(payload->step) && payload->step > 0)) {
        return slide_say(message, "surrogate file: step %g s; expected positive", payload->step);
    }
    if (payload->n_out < 1 || payload->n_out > payload->n_in || payload->n_in > MAX_WINDOW) {
        return slide_say(message, "surrogate file: n_in %u, n_out %u; expected 1 <= n_out <= n_in",
                         (unsigned)payload->n_in, (unsigned)payload->n_out);
    }
    if (payload->n_inputs < 1 || payload->n_outputs < 1) {
        return slide_say(message, "surrogate file: no inputs or no outputs; expected both");
    }
    return close_section(&section, "WIND", message);
}

static bool read_scaling(const unsigned char **scaling, uint32_t channels, const char *tag,
                         SlideCursor *file, SlideMessage *message) {
    SlideCursor section;
    if (!open_section(file, tag, &section, message)) {
        return false;
    }
    *scaling = slide_take(&section, channels, 16);
    if (*scaling == NULL) {
        return too_short(message, tag);
    }
    for (size_t i = 0; i < channels; ++i) {
        double offset = slide_f64(*scaling + 16 * i), scale = slide_f64(*scaling + 16 * i + 8);
        if (!isfinite(offset) || !isfinite(scale) || !(scale > 0)) {
            return slide_say(message,
                             "surrogate file, %s, channel %u: offset %g, scale %g; expected "
                             "finite numbers and a positive scale",
                             tag, (unsigned)i, offset, scale);
        }
    }
    return close_section(&section, tag, message);
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

static bool read_skip(SlideNetworkView *network, SlideCursor *section, SlideMessage *message) {
    uint32_t has_skip;
    if (!slide_take_u32(section, &has_skip)) {
        return too_short(message, "a network");
    }
    if (has_skip > 1) {
        return slide_say(message, "surrogate file: skip flag %u; expected 0 or 1",
                         (unsigned)has_skip);
    }
    network->skip = NULL;
    if (has_skip == 0) {
        return true;
    }
    uint64_t count = (uint64_t)network->n_values * network->n_first;
    network->skip = slide_take(section, count, 4);
    return network->skip == NULL ? too_short(message, "the linear skip")
                                 : check_finite(network->skip, count, "skip weight", message);
}

static bool read_network(SlideNetworkView *network, uint32_t n_inputs, SlideCursor *section,
                         SlideMessage *message) {
    uint32_t kind;
    if (!slide_take_u32(section, &kind) || !slide_take_u32(section, &network->n_samples) ||
        !slide_take_u32(section, &network->n_layers)) {
        return too_short(message, "a network");
    }
    if (kind != FEED_FORWARD) {
        return slide_say(message, "surrogate file: network of kind %u; expected %d (feed-forward)",
                         (unsigned)kind, (int)FEED_FORWARD);
    }
    if (network->n_samples < 1 || network->n_layers < 1) {
        return slide_say(message, "surrogate file: a network has no samples or no layers");
    }
    uint64_t width = (uint64_t)network->n_samples * n_inputs;
    network->n_first = (uint32_t)width; /* exact once the first layer fits */
    network->layers = section->at;
    for (uint32_t i = 0; i < network->n_layers; ++i) {
        if (!read_layer(&width, section, message)) {
            return false;
        }
    }
    network->n_values = (uint32_t)width;
    return read_skip(network, section, message);
}

static bool read_predictor(SlidePayload *payload, SlideCursor *file, SlideMessage *message) {
    SlideCursor section;
    if (!open_section(file, "PRED", &section, message) ||
        !read_network(&payload->predictor, payload->n_inputs, &section, message) ||
        !close_section(&section, "PRED", message)) {
        return false;
    }
    uint32_t samples = payload->predictor.n_samples, values = payload->predictor.n_values;
    bool one =
        samples == payload->n_in - payload->n_out + 1 && values == payload->n_outputs;
    bool block = samples == payload->n_in &&
                 values == (uint64_t)payload->n_out * payload->n_outputs;
    return one || block ||
           slide_say(message, "surrogate file: the network maps %u samples to %u values, which "
                              "fits neither one sample nor one block of the window",
                     (unsigned)samples, (unsigned)values);
}

static bool read_estimator(SlidePayload *payload, SlideCursor *file, SlideMessage *message) {
    SlideCursor section;
    payload->has_estimator = file->end - file->at >= 4 && memcmp(file->at, "ESTI", 4) == 0;
    if (!payload->has_estimator) {
        return true;
    }
    if (!open_section(file, "ESTI", &section, message)) {
        return false;
    }
    if (!slide_take_f64(&section, &payload->low) || !slide_take_f64(&section, &payload->high) ||
        !slide_take_u32(&section, &payload->positions)) {
        return too_short(message, "ESTI");
    }
    if (!isfinite(payload->low) || !isfinite(payload->high) || !(payload->low < payload->high)) {
        return slide_say(message, "surrogate file: error exponents %g, %g; expected low < high",
                         payload->low, payload->high);
    }
    if (!read_network(&payload->estimator, payload->n_inputs, &section, message) ||
        !close_section(&section, "ESTI", message)) {
        return false;
    }
    uint64_t seen = (uint64_t)payload->estimator.n_samples + payload->positions;
    uint64_t n_values = payload->estimator.n_values, n_outputs = payload->n_outputs;
    return ((n_values == n_outputs || n_values == 2 * n_outputs) && payload->positions >= 1 &&
            seen - 1 <= payload->n_in) ||
           slide_say(message, "surrogate file: the error estimator does not fit the window");
}

static bool read_sections(SlidePayload *payload, SlideCursor *file, SlideMessage *message) {
    SlideCursor metadata;
    if (!read_window(payload, file, message) ||
        !read_scaling(&payload->input_scaling, payload->n_inputs, "SCIN", file, message) ||
        !read_scaling(&payload->output_scaling, payload->n_outputs, "SCOU", file, message) ||
        !read_predictor(payload, file, message) || !read_estimator(payload, file, message) ||
        !open_section(file, "META", &metadata, message)) {
        return false;
    }
    return file->at == file->end ||
           slide_say(message, "surrogate file is damaged: unexpected bytes after the last section");
}

bool slide_payload_read(SlidePayload *payload, const unsigned char *data, size_t size,
                        SlideMessage *message) {
    if (size < 16 || memcmp(data, "SLIDEFMU", 8) != 0) {
        return slide_say(message, "not a surrogate file: expected it to begin with SLIDEFMU");
    }
    if (slide_u32(data + 8) != VERSION) {
        return slide_say(message, "surrogate file of version %u; expected version %d",
                         (unsigned)slide_u32(data + 8), (int)VERSION);
    }
    uint32_t checksum = slide_u32(data + size - 4);
    if (slide_crc32(data, size - 4) != checksum) {
        return slide_say(message,
                         "surrogate file is damaged: its checksum does not match its content");
    }
    snprintf(payload->guid, sizeof payload->guid, "slide-%08x-%08x-%llx", (unsigned)checksum,
             (unsigned)slide_adler32(data, size), (unsigned long long)size);
    SlideCursor file = {data + 12, data + size - 4};
    return read_sections(payload, &file, message);
}
