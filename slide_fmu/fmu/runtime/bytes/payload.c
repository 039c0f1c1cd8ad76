#include "payload.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { VERSION = 5, MAX_WINDOW = 1 << 20 };

static const double START_TOLERANCE = 1e-12; /* relative to |offset| + scale: rounding */

static bool open_section(SlideCursor *file, const char *tag, SlideCursor *section,
                         SlideMessage *message) {
    const unsigned char *found = slide_take(file, 4, 1);
    uint32_t length;
    if (found == NULL || memcmp(found, tag, 4) != 0) {
        return slide_say(message, "surrogate file is damaged: expected section %s", tag);
    }
    if (!slide_take_u32(file, &length)) {
        return slide_too_short(message, tag);
    }
    section->at = slide_take(file, length, 1);
    section->end = section->at == NULL ? NULL : section->at + length;
    return section->at != NULL || slide_too_short(message, tag);
}

static bool close_section(const SlideCursor *section, const char *tag, SlideMessage *message) {
    return section->at == section->end ||
           slide_say(message, "surrogate file is damaged: %u bytes too many in section %s",
                     (unsigned)(section->end - section->at), tag);
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
        return slide_too_short(message, "WIND");
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

static bool starts_inside(double offset, double scale, double start) {
    double allowed = scale + START_TOLERANCE * (fabs(offset) + scale);
    return isfinite(start) && fabs(start - offset) <= allowed;
}

/* Rows of offset and scale; those of inputs go on with a start value. */
static bool read_scaling(const unsigned char **scaling, uint32_t channels, size_t row_size,
                         const char *tag, SlideCursor *file, SlideMessage *message) {
    SlideCursor section;
    if (!open_section(file, tag, &section, message)) {
        return false;
    }
    *scaling = slide_take(&section, channels, row_size);
    if (*scaling == NULL) {
        return slide_too_short(message, tag);
    }
    for (size_t i = 0; i < channels; ++i) {
        const unsigned char *row = *scaling + row_size * i;
        double offset = slide_f64(row), scale = slide_f64(row + 8);
        if (!isfinite(offset) || !isfinite(scale) || !(scale > 0)) {
            return slide_say(message,
                             "surrogate file, %s, channel %u: offset %g, scale %g; expected "
                             "finite numbers and a positive scale",
                             tag, (unsigned)i, offset, scale);
        }
        if (row_size == SLIDE_INPUT_ROW && !starts_inside(offset, scale, slide_f64(row + 16))) {
            return slide_say(message,
                             "surrogate file: input %u starts at %g; expected it in %g -+ %g",
                             (unsigned)i, slide_f64(row + 16), offset, scale);
        }
    }
    return close_section(&section, tag, message);
}

/* Rows of cosine and sine follow each other; both have offset 0 and one scale. */
static bool is_angle(const SlidePayload *payload, uint32_t input) {
    const unsigned char *row = payload->input_scaling + SLIDE_INPUT_ROW * (size_t)input;
    const unsigned char *next = row + SLIDE_INPUT_ROW;
    return input + 1 < payload->n_inputs && slide_angle_of(payload, input + 1) == SLIDE_SINE &&
           slide_f64(row) == 0 && slide_f64(next) == 0 && slide_f64(row + 8) == slide_f64(next + 8);
}

/* One hold for all inputs, and every angle whole. */
static bool read_meanings(SlidePayload *payload, SlideMessage *message) {
    uint32_t first = slide_u32(payload->input_scaling + 24);
    for (uint32_t i = 0; i < payload->n_inputs; ++i) {
        uint32_t hold = slide_u32(payload->input_scaling + SLIDE_INPUT_ROW * (size_t)i + 24);
        if (hold > 1 || hold != first) {
            return slide_say(message, "surrogate file: hold %u of input %u; expected 0 or 1, and "
                                      "the same for all inputs",
                             (unsigned)hold, (unsigned)i);
        }
        uint32_t angle = slide_angle_of(payload, i);
        bool cosine = angle == SLIDE_COSINE;
        bool sine = angle == SLIDE_SINE && i > 0 && slide_angle_of(payload, i - 1) == SLIDE_COSINE;
        if (!(angle == SLIDE_NO_ANGLE || sine || (cosine && is_angle(payload, i)))) {
            return slide_say(message,
                             "surrogate file: angle %u of input %u; expected 0, or cosine (1) and "
                             "sine (2) in this order, both with offset 0 and the same scale",
                             (unsigned)angle, (unsigned)i);
        }
    }
    payload->ramp = first == 1;
    return true;
}

/* What features of an angle are formed of must be one. */
static bool sees_angle(const SlidePayload *payload, const SlideNetworkView *network,
                       SlideMessage *message) {
    return !network->features.set->of_angle || slide_angle_of(payload, 0) == SLIDE_COSINE ||
           slide_say(message, "surrogate file: features of an angle (set %d) of inputs that are "
                              "none; expected its cosine and sine",
                     (int)network->features.set->number);
}

static bool read_predictor(SlidePayload *payload, SlideCursor *file, SlideMessage *message) {
    SlideCursor section;
    if (!open_section(file, "PRED", &section, message) ||
        !slide_network_read(&payload->predictor, payload->n_inputs, &section, message) ||
        !close_section(&section, "PRED", message) ||
        !sees_angle(payload, &payload->predictor, message)) {
        return false;
    }
    return payload->predictor.family->fits(&payload->predictor, payload->n_in, payload->n_out,
                                           payload->n_outputs) ||
           slide_say(message, "surrogate file: the network maps %u samples to %u values, which "
                              "does not fit the window",
                     (unsigned)payload->predictor.n_samples,
                     (unsigned)payload->predictor.n_values);
}

static bool check_estimator(const SlidePayload *payload, SlideMessage *message) {
    const SlideNetworkView *network = &payload->estimator;
    uint64_t n_values = network->n_values, n_outputs = payload->n_outputs;
    if (network->family != &slide_feed_forward_family) {
        return slide_say(message,
                         "surrogate file: the error estimator is a network of kind %u; expected "
                         "%d (feed-forward)",
                         (unsigned)network->family->number, (int)slide_feed_forward_family.number);
    }
    if (n_values != n_outputs && n_values != 2 * n_outputs) {
        return slide_say(message,
                         "surrogate file: the error estimator gives %llu values; expected %llu "
                         "or %llu",
                         (unsigned long long)n_values, (unsigned long long)n_outputs,
                         (unsigned long long)(2 * n_outputs));
    }
    bool fits = payload->positions >= 1 && payload->positions <= MAX_WINDOW &&
                network->n_samples <= MAX_WINDOW;
    return fits ||
           slide_say(message,
                     "surrogate file: the error estimator sees %u samples at %u positions; "
                     "expected at least one position, and at most %d of both",
                     (unsigned)network->n_samples, (unsigned)payload->positions,
                     (int)MAX_WINDOW);
}

static bool check_ranges(const SlidePayload *payload, SlideMessage *message) {
    uint32_t count = payload->estimator.features.chosen.count;
    for (uint32_t i = 0; i < count; ++i) {
        double least = slide_f32(payload->ranges + 4 * (size_t)i);
        double largest = slide_f32(payload->ranges + 4 * ((size_t)count + i));
        if (!(least <= largest)) {
            return slide_say(message,
                             "surrogate file: feature %u of the error estimator lies in %g .. %g; "
                             "expected the smaller number first",
                             (unsigned)i, least, largest);
        }
    }
    return true;
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
        return slide_too_short(message, "ESTI");
    }
    if (!isfinite(payload->low) || !isfinite(payload->high) || !(payload->low < payload->high)) {
        return slide_say(message, "surrogate file: error exponents %g, %g; expected low < high",
                         payload->low, payload->high);
    }
    if (!slide_network_read(&payload->estimator, payload->n_inputs, &section, message) ||
        !check_estimator(payload, message) ||
        !sees_angle(payload, &payload->estimator, message) ||
        !slide_read_f32(&payload->ranges, 2, payload->estimator.features.chosen.count, &section,
                        "range", message) ||
        !close_section(&section, "ESTI", message)) {
        return false;
    }
    return check_ranges(payload, message);
}

static bool read_sections(SlidePayload *payload, SlideCursor *file, SlideMessage *message) {
    SlideCursor metadata;
    if (!read_window(payload, file, message) ||
        !read_scaling(&payload->input_scaling, payload->n_inputs, SLIDE_INPUT_ROW, "SCIN", file,
                      message) ||
        !read_meanings(payload, message) ||
        !read_scaling(&payload->output_scaling, payload->n_outputs, SLIDE_OUTPUT_ROW, "SCOU", file,
                      message) ||
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
        return slide_say(message,
                         "surrogate file of version %u; expected version %d: make the FMU again "
                         "with slide-fmu export OLD.fmu -o NEW.fmu",
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
