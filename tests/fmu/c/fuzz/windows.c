/* The surrogate without FMI. */
#include "native.h"
#include "payload.h"
#include "surrogate.h"
#include "target.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_WINDOWS = 30, MOST_SAMPLES = 40, MOST_VALUES = 1 << 18 };

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

/* Numbers of any size; as many as an array of the library may be read. */
static double *fuzz_values(FuzzInput *input, size_t count) {
    double *values = calloc(count + 1, sizeof *values);
    for (size_t i = 0; i < count; ++i) {
        values[i] = fuzz_value(input);
    }
    return values;
}

/* Records that overlap, and the gradient of others that lie one after the other. */
static void run_cells(SlideNative *native, const SlidePayload *payload, FuzzInput *input,
                      size_t count) {
    const size_t n_inputs = payload->n_inputs, n_values = payload->predictor.n_values;
    const size_t length = 1 + fuzz_u8(input) % MOST_SAMPLES, stride = fuzz_u8(input) % length;
    const size_t n_given = 1 + fuzz_u8(input) % length, n_held = fuzz_u8(input);
    const size_t n_seen = count * length * n_inputs, n_found = count * length * n_values;
    const size_t n_scratch = (size_t)payload->n_in * (n_inputs + n_values);
    if (n_seen > MOST_VALUES || n_found > MOST_VALUES || n_scratch > MOST_VALUES) {
        return;
    }
    double *inputs = fuzz_values(input, n_seen), *weights = fuzz_values(input, n_found);
    double *outputs = calloc(n_found + 1, sizeof *outputs);
    double *gradient = calloc(n_seen + 1, sizeof *gradient);
    slide_native_records(native, inputs, count, length, stride, n_held, n_given, outputs);
    slide_native_slopes(native, inputs, weights, count, length, gradient);
    free(inputs);
    free(weights);
    free(outputs);
    free(gradient);
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
