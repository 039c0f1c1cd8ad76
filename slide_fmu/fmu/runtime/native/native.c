#include "native.h"

#include "calls.h"
#include "payload.h"
#include "slopes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The network of a surrogate, with all the values it gives. */
struct SlideNative {
    unsigned char *block;
    const SlideKernel *kernel;
    SlideNetwork network;
    SlideParameters parameters; /* at their start values */
    size_t n_values;
    SlideRecords records; /* of cells */
    SlideSlopes *slopes;  /* from the first call on that needs them */
};

const char *slide_native_kernel(size_t index) {
    const SlideKernel *kernel = slide_kernel(index);
    return kernel == NULL ? NULL : kernel->name;
}

static void place(SlideNative *native, const SlidePayload *payload, SlideArena *arena) {
    const SlideNetworkView *view = &payload->predictor;
    native->n_values = view->n_values;
    slide_network_place(&native->network, view, view->n_values, arena);
    slide_parameters_place(&native->parameters, &payload->parameters, arena);
    if (native->network.family == &slide_state_space_family) {
        slide_records_place(&native->records, payload, &native->network, native->kernel, arena);
    }
}

static bool build(SlideNative *native, const SlidePayload *payload) {
    SlideArena arena = {NULL, 0};
    place(native, payload, &arena);
    native->block = calloc(arena.used + SLIDE_ALIGNMENT, 1);
    if (native->block == NULL) {
        return false;
    }
    const size_t misaligned = (size_t)((uintptr_t)native->block % SLIDE_ALIGNMENT);
    arena = (SlideArena){native->block + (SLIDE_ALIGNMENT - misaligned), 0};
    place(native, payload, &arena);
    if (native->parameters.count > 0) {
        slide_parameters_form(&native->parameters, &native->network.of.cells.terms,
                              native->parameters.start);
    }
    return true;
}

SlideNative *slide_native_open(const unsigned char *data, size_t size, size_t kernel,
                               char *message, size_t message_size) {
    SlideMessage why = {"out of memory"};
    SlidePayload payload;
    SlideNative *native = calloc(1, sizeof *native);
    bool good = native != NULL && slide_payload_read(&payload, data, size, &why);
    if (good && payload.predictor.family == &slide_state_space_family) {
        good = slide_records_know(payload.predictor.features.set) ||
               slide_say(&why, "its features are of set %u, which is not evaluated along "
                               "records; expected another set: use Surrogate.predict, which "
                               "evaluates it with numpy, or run its FMU",
                         (unsigned)payload.predictor.features.set->number);
    }
    if (good && slide_kernel(kernel) == NULL) {
        good = slide_say(&why, "kernel %u; expected one that this processor supports",
                         (unsigned)kernel);
    }
    if (good) {
        native->kernel = slide_kernel(kernel);
        good = build(native, &payload) || slide_say(&why, "out of memory");
    }
    if (!good) {
        snprintf(message, message_size, "%s", why.text);
        slide_native_close(native);
        return NULL;
    }
    return native;
}

void slide_native_close(SlideNative *native) {
    if (native != NULL) {
        slide_slopes_close(native->slopes);
        free(native->block);
        free(native);
    }
}

int slide_native_sizes(const unsigned char *data, size_t size, uint32_t fmi,
                       uint32_t steps_per_sample, size_t *sizes, char *message,
                       size_t message_size) {
    SlideMessage why;
    SlidePayload payload;
    if (!slide_payload_read(&payload, data, size, &why)) {
        snprintf(message, message_size, "%s", why.text);
        return 1;
    }
    const SlideSizes of_instance = slide_measure(&payload, fmi == 3, steps_per_sample);
    sizes[0] = of_instance.instance;
    sizes[1] = of_instance.saved_state;
    return 0;
}

enum { CHUNK = 8 * SLIDE_ROWS }; /* rows that pass through a layer before the next layer */

static void affine(const SlideKernel *kernel, const SlideLayer *layer, const SlideRows *rows) {
    kernel->affine_rows(layer->weights, layer->n_in, layer->n_panels, rows);
}

/* CHUNK rows; gives [CHUNK][panels of the last layer][SLIDE_PANEL]. */
static const float *evaluate_chunk(const SlideFeedForward *network, const SlideKernel *kernel,
                                   const float *const *windows, float *scratch) {
    const float *inner[CHUNK], *const *x = windows;
    const size_t half = CHUNK * network->widest * SLIDE_PANEL;
    float *y = NULL;
    for (uint32_t i = 0; i < network->n_layers; ++i) {
        const SlideLayer *layer = &network->layers[i];
        const size_t width = layer->n_panels * SLIDE_PANEL;
        y = scratch + i % 2 * half;
        affine(kernel, layer, &(SlideRows){CHUNK, x, layer->bias, 0, y});
        kernel->activate(layer->activation, y, CHUNK * width);
        for (size_t row = 0; row < CHUNK; ++row) {
            inner[row] = y + row * width;
        }
        x = inner;
    }
    const size_t width = network->skip.n_panels * SLIDE_PANEL;
    affine(kernel, &network->skip, &(SlideRows){CHUNK, windows, y, width, y});
    return y;
}

/* Layers on rows of features, [count] of them, each as wide as the first layer; they may overlap.
 * values: [count][n_values], all that the network gives. False when there is no memory for it;
 * nothing but values is changed, so that threads may share the network. */
static bool evaluate_rows(const SlideFeedForward *network, const SlideKernel *kernel,
                          const float *const *rows, size_t count, size_t n_values, float *values) {
    const SlideLayer *last = &network->layers[network->n_layers - 1];
    const size_t width = last->n_panels * SLIDE_PANEL;
    float *scratch = malloc(2 * CHUNK * network->widest * SLIDE_PANEL * sizeof(float));
    for (size_t first = 0; scratch != NULL && first < count; first += CHUNK) {
        const size_t left = count - first, n_rows = left < CHUNK ? left : CHUNK;
        const float *chunk[CHUNK];
        for (size_t row = 0; row < CHUNK; ++row) { /* the last row fills the chunk */
            chunk[row] = rows[first + (row < n_rows ? row : n_rows - 1)];
        }
        const float *chunk_values = evaluate_chunk(network, kernel, chunk, scratch);
        for (size_t row = 0; row < n_rows; ++row) {
            memcpy(values + (first + row) * n_values, chunk_values + row * width,
                   n_values * sizeof(float));
        }
    }
    free(scratch);
    return scratch != NULL;
}

int slide_native_layers(const SlideNative *native, const float *const *rows, size_t count,
                        float *values) {
    return evaluate_rows(&native->network.of.layers.stack, native->kernel, rows, count,
                         native->n_values, values)
               ? 0
               : 1;
}

int slide_native_records(SlideNative *native, const double *inputs, size_t count, size_t length,
                         size_t stride, size_t n_held, size_t n_given, double *outputs) {
    const SlideRecordList list = {inputs, count, length, stride};
    return slide_records_run(&native->records, &list, n_held, n_given, outputs) ? 0 : 1;
}

int slide_native_slopes(SlideNative *native, const double *inputs, const double *weights,
                        size_t count, size_t length, double *gradient) {
    const SlideRecordList list = {inputs, count, length, length};
    if (native->slopes == NULL) {
        native->slopes = slide_slopes_open(&native->records);
    }
    return native->slopes != NULL &&
                   slide_slopes_run(native->slopes, &list, weights, gradient)
               ? 0
               : 1;
}
