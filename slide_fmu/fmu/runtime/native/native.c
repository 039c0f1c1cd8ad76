#include "native.h"

#include "batch.h"
#include "stream.h"

#include <stdio.h>
#include <stdlib.h>

/* The whole surrogate, as an FMU has it, and its network once more with all the values it gives. */
struct SlideNative {
    unsigned char *block;
    SlideModel model;
    SlideState state;
    const SlideKernel *kernel; /* of the network */
    SlideNetwork network;
    SlideNetworkState network_state;
    size_t n_values;
    double *before;       /* scratch [SLIDE_BEFORE][n_inputs] */
    const float *memory;  /* where the network lies */
    size_t memory_size;   /* bytes */
    volatile float found; /* keeps what was computed from being left out */
};

const char *slide_native_kernel(size_t index) {
    const SlideKernel *kernels[SLIDE_KERNELS];
    return index < slide_kernels(kernels) ? kernels[index]->name : NULL;
}

static void place(SlideNative *native, const SlidePayload *payload, SlideArena *arena) {
    const SlideNetworkView *view = &payload->predictor;
    slide_model_place(&native->model, payload, arena);
    slide_state_place(&native->state, &native->model, arena);
    native->n_values = view->n_values;
    native->before = slide_place(arena, SLIDE_BEFORE * payload->n_inputs, sizeof(double));
    slide_network_state_place(&native->network_state, &native->model.predictor, arena);
    native->memory = slide_place(arena, 0, 1);
    const size_t begin = arena->used;
    slide_network_place(&native->network, view, view->n_values, arena);
    native->memory_size = arena->used - begin;
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
    slide_state_reset(&native->model, &native->state);
    return true;
}

SlideNative *slide_native_open(const unsigned char *data, size_t size, size_t kernel,
                               char *message, size_t message_size) {
    SlideMessage why = {"out of memory"};
    SlidePayload payload;
    const SlideKernel *kernels[SLIDE_KERNELS];
    SlideNative *native = calloc(1, sizeof *native);
    bool good = native != NULL && slide_payload_read(&payload, data, size, &why);
    if (good && kernel >= slide_kernels(kernels)) {
        good = slide_say(&why, "kernel %u; expected one that this processor supports",
                         (unsigned)kernel);
    }
    if (good) {
        native->kernel = kernels[kernel];
        good = build(native, &payload) || slide_say(&why, "out of memory");
    }
    if (good && !slide_stream_hold(&native->model, &native->state)) {
        good = slide_say(&why, "the outputs of the start inputs are not finite");
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
        free(native->block);
        free(native);
    }
}

size_t slide_native_memory(const SlideNative *native) { return native->memory_size; }

int slide_native_layers(const SlideNative *native, const float *const *rows, size_t count,
                        float *values) {
    return slide_batch_layers(&native->network.layers.stack, native->kernel, rows, count,
                              native->n_values, values)
               ? 0
               : 1;
}

int slide_native_cells(SlideNative *native, const double *const *windows, size_t count,
                       float *values) {
    return slide_batch_cells(&native->network.cells, native->kernel, &native->network_state.cells,
                             windows, count, native->before, values)
               ? 0
               : 1;
}

static void run_network(SlideNative *native, float value) {
    const SlideCells *cells = &native->model.predictor.cells;
    SlideNetworkState *state = &native->state.predictor;
    if (native->network.kind == SLIDE_STATE_SPACE) {
        cells->features[0] = value;
        slide_cells_run(cells, native->model.kernel, &state->cells);
        state->cells.states[0] = cells->next[0];
    } else {
        state->layers.ring[0] = value;
        native->found = *slide_feed_forward_evaluate(&native->network.layers.stack,
                                                     native->kernel, state->layers.ring);
    }
}

static bool see(SlideNative *native, double value, uint64_t sample) {
    native->model.sample[0] = value;
    return slide_network_see(&native->model.predictor, &native->state.predictor, sample,
                             native->model.sample, native->state.samples.ring);
}

static bool step(SlideNative *native, double part, bool reads) {
    const SlideScaling *scaling = native->model.input_scaling;
    native->state.inputs[0] = scaling->offset + part * scaling->scale;
    bool good = slide_stream_step(&native->model, &native->state, native->model.step);
    if (reads && native->model.estimator.positions > 0) {
        slide_stream_estimate(&native->model, &native->state);
    }
    return good;
}

int slide_native_repeat(SlideNative *native, int part, int times) {
    bool good = true;
    for (int k = 0; k < times && good; ++k) {
        const double value = (k % 100) * 0.01;
        switch (part) {
        case SLIDE_NETWORK_ALONE:
            run_network(native, (float)value);
            break;
        case SLIDE_FEATURES_ALONE:
            good = see(native, value, (uint64_t)k);
            break;
        case SLIDE_STEP:
        case SLIDE_STEP_AND_READ:
            good = step(native, value, part == SLIDE_STEP_AND_READ);
            break;
        case SLIDE_READ_MEMORY:
            native->found = native->kernel->read_through(native->memory,
                                                         native->memory_size / sizeof(float));
            break;
        default:
            good = false;
        }
    }
    return good ? 0 : 1;
}
