#include "payload.h"

#include "bound_reading.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { VERSION = 13 };
enum { MAX_CANDIDATES = 8, MAX_PAST = 8, MAX_SCORED = 64 };

static const double START_TOLERANCE = 1e-12; /* relative to |offset| + scale: rounding */

static void read_window(SlidePayload *payload, SlideCursor *file) {
    slide_open_section(file, "WIND");
    payload->step = slide_take_f64(file, "WIND");
    payload->n_in = slide_take_u32(file, "WIND");
    payload->n_out = slide_take_u32(file, "WIND");
    payload->n_inputs = slide_take_u32(file, "WIND");
    payload->n_outputs = slide_take_u32(file, "WIND");
    slide_check(file, isfinite(payload->step) && payload->step > 0,
                "surrogate file: step %g s; expected positive", payload->step);
    slide_check(file,
                payload->n_out >= 1 && payload->n_out <= payload->n_in &&
                    payload->n_in <= SLIDE_MAX_WINDOW,
                "surrogate file: n_in %u, n_out %u; expected 1 <= n_out <= n_in",
                (unsigned)payload->n_in, (unsigned)payload->n_out);
    slide_check(file, payload->n_inputs >= 1 && payload->n_outputs >= 1,
                "surrogate file: no inputs or no outputs; expected both");
    slide_close_section(file, "WIND");
}

static bool starts_inside(double offset, double scale, double start) {
    double allowed = scale + START_TOLERANCE * (fabs(offset) + scale);
    return isfinite(start) && fabs(start - offset) <= allowed;
}

/* Rows of offset and scale; those of inputs go on with a start value. */
static const unsigned char *read_scaling(uint32_t channels, size_t row_size, const char *tag,
                                         SlideCursor *file) {
    slide_open_section(file, tag);
    const unsigned char *rows = slide_take(file, channels, row_size, tag);
    for (size_t i = 0; file->good && i < channels; ++i) {
        const unsigned char *row = rows + row_size * i;
        double offset = slide_f64(row), scale = slide_f64(row + 8);
        slide_check(file, isfinite(offset) && isfinite(scale) && scale > 0,
                    "surrogate file, %s, channel %u: offset %g, scale %g; expected finite numbers "
                    "and a positive scale",
                    tag, (unsigned)i, offset, scale);
        if (row_size == SLIDE_INPUT_ROW) {
            double start = slide_f64(row + 16);
            slide_check(file, starts_inside(offset, scale, start),
                        "surrogate file: input %u starts at %g; expected it in %g -+ %g",
                        (unsigned)i, start, offset, scale);
        }
    }
    slide_close_section(file, tag);
    return rows;
}

/* Rows of cosine and sine follow each other; both have offset 0 and one scale. */
static bool is_angle(const SlidePayload *payload, uint32_t input) {
    const unsigned char *row = payload->input_scaling + SLIDE_INPUT_ROW * (size_t)input;
    const unsigned char *next = row + SLIDE_INPUT_ROW;
    return input + 1 < payload->n_inputs && slide_angle_of(payload, input + 1) == SLIDE_SINE &&
           slide_f64(row) == 0 && slide_f64(next) == 0 && slide_f64(row + 8) == slide_f64(next + 8);
}

/* One hold for all inputs, and every angle whole. */
static void read_meanings(SlidePayload *payload, SlideCursor *file) {
    uint32_t first = slide_u32(payload->input_scaling + 24);
    for (uint32_t i = 0; i < payload->n_inputs; ++i) {
        uint32_t hold = slide_u32(payload->input_scaling + SLIDE_INPUT_ROW * (size_t)i + 24);
        uint32_t angle = slide_angle_of(payload, i);
        bool cosine = angle == SLIDE_COSINE;
        bool sine = angle == SLIDE_SINE && i > 0 && slide_angle_of(payload, i - 1) == SLIDE_COSINE;
        slide_check(file, hold <= 1 && hold == first,
                    "surrogate file: hold %u of input %u; expected 0 or 1, and the same for all "
                    "inputs",
                    (unsigned)hold, (unsigned)i);
        slide_check(file, angle == SLIDE_NO_ANGLE || sine || (cosine && is_angle(payload, i)),
                    "surrogate file: angle %u of input %u; expected 0, or cosine (1) and sine (2) "
                    "in this order, both with offset 0 and the same scale",
                    (unsigned)angle, (unsigned)i);
    }
    payload->first_order = first == 1;
}

/* What features of an angle are formed of must be one. */
static void check_angle(const SlidePayload *payload, const SlideNetworkView *network,
                        SlideCursor *file) {
    const SlideFeatureSet *set = network->features.set;
    for (uint32_t i = 0; set->is_cosine != NULL && i < payload->n_inputs; ++i) {
        slide_check(file,
                    !set->is_cosine(&network->features, i) ||
                        slide_angle_of(payload, i) == SLIDE_COSINE,
                    "surrogate file: features of an angle (set %u) of inputs that are none; "
                    "expected its cosine and sine",
                    (unsigned)set->number);
    }
}

static void read_predictor(SlidePayload *payload, SlideCursor *file) {
    const SlideNetworkView *network = &payload->predictor;
    slide_open_section(file, "PRED");
    slide_network_read(&payload->predictor, payload->n_inputs, file);
    slide_close_section(file, "PRED");
    if (file->good) {
        check_angle(payload, network, file);
        slide_check(file,
                    network->family->fits(network, payload->n_in, payload->n_out,
                                          payload->n_outputs),
                    "surrogate file: the network maps %u samples to %u values, which does not fit "
                    "the window",
                    (unsigned)network->n_samples, (unsigned)network->n_values);
    }
}

static void check_estimator(const SlidePayload *payload, SlideCursor *file) {
    const SlideNetworkView *network = &payload->estimator;
    uint64_t n_values = network->n_values, n_outputs = payload->n_outputs;
    slide_check(file, network->family == &slide_feed_forward_family,
                "surrogate file: the error estimator is a network of kind %u; expected %u "
                "(feed-forward)",
                (unsigned)network->family->number, (unsigned)slide_feed_forward_family.number);
    slide_check(file, n_values == n_outputs || n_values == 2 * n_outputs,
                "surrogate file: the error estimator gives %llu values; expected %llu or %llu",
                (unsigned long long)n_values, (unsigned long long)n_outputs,
                (unsigned long long)(2 * n_outputs));
    slide_check(file,
                payload->positions >= 1 && payload->positions <= SLIDE_MAX_WINDOW &&
                    network->n_samples <= SLIDE_MAX_WINDOW,
                "surrogate file: the error estimator sees %u samples at %u positions; expected at "
                "least one position, and at most %d of both",
                (unsigned)network->n_samples, (unsigned)payload->positions, (int)SLIDE_MAX_WINDOW);
    check_angle(payload, network, file);
}

static void read_ranges(SlidePayload *payload, SlideCursor *file) {
    uint32_t count = payload->estimator.features.chosen.count;
    payload->ranges = slide_take_f32s(file, 2, count, "range");
    slide_close_section(file, "ESTI");
    for (uint32_t i = 0; file->good && i < count; ++i) {
        double least = slide_f32(payload->ranges + 4 * (size_t)i);
        double largest = slide_f32(payload->ranges + 4 * ((size_t)count + i));
        slide_check(file, least <= largest,
                    "surrogate file: feature %u of the error estimator lies in %g .. %g; expected "
                    "the smaller number first",
                    (unsigned)i, least, largest);
    }
}

static void read_estimator(SlidePayload *payload, SlideCursor *file) {
    slide_open_section(file, "ESTI");
    payload->low = slide_take_f64(file, "ESTI");
    payload->high = slide_take_f64(file, "ESTI");
    payload->positions = slide_take_u32(file, "ESTI");
    slide_check(file,
                isfinite(payload->low) && isfinite(payload->high) && payload->low < payload->high,
                "surrogate file: error exponents %g, %g; expected low < high", payload->low,
                payload->high);
    slide_network_read(&payload->estimator, payload->n_inputs, file);
    if (file->good) {
        check_estimator(payload, file);
    }
    read_ranges(payload, file);
}

static bool is_next(const SlideCursor *file, const char *tag) {
    return file->end - file->at >= 4 && memcmp(file->at, tag, 4) == 0;
}

static void read_forecast_rows(SlidePayload *payload, SlideCursor *file) {
    SlideForecastView *view = &payload->forecast;
    const uint64_t columns = 1 + (uint64_t)view->n_candidates * view->n_past;
    view->rows = slide_take_f64s(file, payload->n_inputs, columns, "forecast");
    for (uint32_t i = 0; file->good && i < payload->n_inputs; ++i) {
        const double largest = slide_f64(view->rows + 8 * columns * i);
        slide_check(file, largest >= 0,
                    "surrogate file: largest change %g of input %u in a step; expected it not "
                    "negative",
                    largest, (unsigned)i);
    }
}

static void read_forecast(SlidePayload *payload, SlideCursor *file) {
    SlideForecastView *view = &payload->forecast;
    slide_open_section(file, "MOVE");
    const uint32_t flags = slide_take_u32(file, "MOVE"); /* 1, 4: Python's alone */
    view->at_step_end = (flags & 2u) != 0;
    view->jumps = (flags & 8u) != 0;
    view->n_candidates = slide_take_u32(file, "MOVE");
    view->n_past = slide_take_u32(file, "MOVE");
    view->n_scored = slide_take_u32(file, "MOVE");
    slide_check(file,
                payload->first_order && flags <= 15 &&
                    view->n_candidates <= MAX_CANDIDATES && view->n_past >= 1 &&
                    view->n_past <= MAX_PAST && view->n_scored >= 1 &&
                    view->n_scored <= MAX_SCORED,
                "surrogate file: a forecast by %u candidates of %u and %u samples; expected at "
                "most %d, 1 to %d and 1 to %d, of inputs with a first-order hold",
                (unsigned)view->n_candidates, (unsigned)view->n_past, (unsigned)view->n_scored,
                (int)MAX_CANDIDATES, (int)MAX_PAST, (int)MAX_SCORED);
    if (file->good) {
        read_forecast_rows(payload, file);
    }
    slide_close_section(file, "MOVE");
}

static void read_output_ranges(SlidePayload *payload, SlideCursor *file) {
    slide_open_section(file, "RANG");
    payload->output_ranges = slide_take_f64s(file, payload->n_outputs, 2, "output ranges");
    for (uint32_t i = 0; file->good && i < payload->n_outputs; ++i) {
        const unsigned char *row = payload->output_ranges + 16 * (size_t)i;
        slide_check(file, slide_f64(row) <= slide_f64(row + 8),
                    "surrogate file: range %g .. %g of output %u; expected the lower end first",
                    slide_f64(row), slide_f64(row + 8), (unsigned)i);
    }
    slide_close_section(file, "RANG");
}

static void read_parameters(SlidePayload *payload, SlideCursor *file) {
    SlideNetworkView *network = &payload->predictor;
    slide_check(file, network->family == &slide_state_space_family,
                "surrogate file: parameters of a network of kind %u; expected %u (state space)",
                (unsigned)network->family->number, (unsigned)slide_state_space_family.number);
    if (file->good) {
        SlideCellView *cell = &network->of.cell;
        slide_parameters_read(&cell->parameters, cell->n_weights, file);
        payload->parameters = cell->parameters;
    }
}

static void read_sections(SlidePayload *payload, SlideCursor *file) {
    read_window(payload, file);
    payload->input_scaling = read_scaling(payload->n_inputs, SLIDE_INPUT_ROW, "SCIN", file);
    if (file->good) {
        read_meanings(payload, file);
    }
    payload->output_scaling = read_scaling(payload->n_outputs, SLIDE_OUTPUT_ROW, "SCOU", file);
    read_predictor(payload, file);
    if (file->good && is_next(file, "PARA")) {
        read_parameters(payload, file);
    }
    payload->has_estimator = is_next(file, "ESTI");
    if (payload->has_estimator) {
        read_estimator(payload, file);
    }
    payload->has_bound = file->good && is_next(file, "BOUN");
    if (payload->has_bound) {
        slide_bound_read(payload, file);
    }
    if (payload->has_bound && file->good) {
        check_angle(payload, &payload->bound.companion, file);
    }
    if (payload->has_bound && file->good && is_next(file, "SPAN")) {
        slide_span_read(payload, file);
    }
    if (payload->has_bound && file->good) {
        slide_bound_check_head(payload, &payload->bound, file);
    }
    payload->forecast = (SlideForecastView){false, false, 0, 1, 1, NULL};
    if (is_next(file, "MOVE")) {
        read_forecast(payload, file);
    }
    if (file->good && is_next(file, "RANG")) {
        read_output_ranges(payload, file);
    }
    slide_open_section(file, "META"); /* only people and Python read it */
    slide_check(file, file->end == file->file_end,
                "surrogate file is damaged: unexpected bytes after the last section");
}

bool slide_payload_read(SlidePayload *payload, const unsigned char *data, size_t size,
                        SlideMessage *message) {
    if (size < 16 || memcmp(data, "SLIDEFMU", 8) != 0) {
        return slide_say(message, "not a surrogate file: expected it to begin with SLIDEFMU");
    }
    const unsigned char *end = data + size - 4;
    const uint32_t version = slide_u32(data + 8), checksum = slide_u32(end);
    SlideCursor file = {data + 12, end, end, message, true};
    slide_check(&file, version == VERSION,
                "surrogate file of version %u; expected version %d: make the FMU again with this "
                "version of slide-fmu",
                (unsigned)version, (int)VERSION);
    slide_check(&file, slide_crc32(data, size - 4) == checksum,
                "surrogate file is damaged: its checksum does not match its content");
    *payload = (SlidePayload){0};
    snprintf(payload->guid, sizeof payload->guid, "slide-%08x-%08x-%llx", (unsigned)checksum,
             (unsigned)slide_adler32(data, size), (unsigned long long)size);
    read_sections(payload, &file);
    return file.good;
}
