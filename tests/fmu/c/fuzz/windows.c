/* The surrogate without FMI. */
#include "native.h"
#include "payload.h"
#include "surrogate.h"
#include "target.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_WINDOWS = 30, MOST_VALUES = 1 << 18 };

/* Rows that overlap, each one place behind the one before. */
static void run_layers(SlideNative *native, const SlideNetworkView *network, FuzzInput *input,
                       size_t count) {
    const size_t width = network->of.layers.n_first, n_values = network->n_values;
    if (width > MOST_VALUES || count * n_values > MOST_VALUES) {
        return;
    }
    const float *rows[MOST_WINDOWS];
    float *record = calloc(width + count, sizeof *record);
    float *values = calloc(count * n_values + 1, sizeof *values);
    for (size_t i = 0; i < width + count; ++i) {
        record[i] = (float)fuzz_value(input);
    }
    for (size_t i = 0; i < count; ++i) {
        rows[i] = record + i;
    }
    slide_native_layers(native, rows, count, values);
    free(values);
    free(record);
}

static void run_cells(SlideNative *native, const SlidePayload *payload, FuzzInput *input,
                      size_t count) {
    const size_t n_inputs = payload->n_inputs;
    const size_t window = (size_t)payload->n_in * n_inputs;
    const size_t found = (size_t)payload->n_out * payload->predictor.n_values;
    if (window > MOST_VALUES || count * found > MOST_VALUES) {
        return;
    }
    const double *windows[MOST_WINDOWS];
    double *record = calloc(window + count * n_inputs, sizeof *record);
    float *values = calloc(count * found + 1, sizeof *values);
    for (size_t i = 0; i < window + count * n_inputs; ++i) {
        record[i] = fuzz_value(input);
    }
    for (size_t i = 0; i < count; ++i) {
        windows[i] = record + i * n_inputs;
    }
    slide_native_cells(native, windows, count, values);
    free(values);
    free(record);
}

static void run(SlideNative *native, const SlidePayload *payload, FuzzInput *input) {
    const size_t count = fuzz_u8(input) % (MOST_WINDOWS + 1);
    if (slide_is_recurrent(payload->predictor.family)) {
        run_cells(native, payload, input, count);
    } else {
        run_layers(native, &payload->predictor, input, count);
    }
}

void fuzz_native(FuzzInput *input) {
    size_t size;
    char text[400] = "";
    SlideMessage message;
    SlidePayload payload;
    unsigned char *data = fuzz_surrogate(&size);
    SlideNative *native =
        slide_native_open(data, size, fuzz_u8(input) % 4, text, sizeof text);
    fuzz_expect(native != NULL || text[0] != '\0', "a message with a refusal");
    if (native != NULL) {
        fuzz_expect(slide_payload_read(&payload, data, size, &message), "a readable file");
        run(native, &payload, input);
    }
    slide_native_close(native);
    free(data);
}
