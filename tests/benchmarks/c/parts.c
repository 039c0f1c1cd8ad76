/* Parts of a communication step, repeated to be timed; compiled by tests/benchmarks/timing.py
 * together with the objects of the runtime, which do not hold it. One surrogate at a time. */
#include "stream.h"

#include <stdlib.h>

enum { NETWORK = 0, FEATURES = 1, STEP = 2, STEP_AND_READ = 3, READ_MEMORY = 4 };

typedef struct {
    unsigned char *block;
    SlideModel model;
    SlideState state;
    SlideNetwork network; /* with all the values it gives */
    const float *memory;  /* where it lies */
    size_t memory_size;   /* bytes */
    volatile float found; /* keeps what was computed from being left out */
} Parts;

#define EXPORT __attribute__((visibility("default")))

EXPORT Parts *parts_open(const unsigned char *data, size_t size);
EXPORT void parts_close(Parts *parts);
EXPORT size_t parts_memory(const Parts *parts);
EXPORT int parts_repeat(Parts *parts, int part, int times);

static void place(Parts *parts, const SlidePayload *payload, SlideArena *arena) {
    slide_model_place(&parts->model, payload, SLIDE_STEPS_PER_SAMPLE, arena);
    slide_state_place(&parts->state, &parts->model, arena);
    parts->memory = slide_place(arena, 0, 1);
    const size_t begin = arena->used;
    slide_network_place(&parts->network, &payload->predictor, payload->predictor.n_values, arena);
    parts->memory_size = arena->used - begin;
}

Parts *parts_open(const unsigned char *data, size_t size) {
    SlideMessage message;
    SlidePayload payload;
    SlideArena arena = {NULL, 0};
    Parts *parts = calloc(1, sizeof *parts);
    if (parts == NULL || !slide_payload_read(&payload, data, size, &message)) {
        free(parts);
        return NULL;
    }
    place(parts, &payload, &arena);
    parts->block = calloc(arena.used + SLIDE_ALIGNMENT, 1);
    if (parts->block == NULL) {
        free(parts);
        return NULL;
    }
    const size_t misaligned = (size_t)((uintptr_t)parts->block % SLIDE_ALIGNMENT);
    arena = (SlideArena){parts->block + (SLIDE_ALIGNMENT - misaligned), 0};
    place(parts, &payload, &arena);
    slide_state_reset(&parts->model, &parts->state);
    if (!slide_stream_hold(&parts->model, &parts->state)) {
        parts_close(parts);
        return NULL;
    }
    return parts;
}

void parts_close(Parts *parts) {
    free(parts->block);
    free(parts);
}

size_t parts_memory(const Parts *parts) { return parts->memory_size; }

/* As fast as a processor can read: sums that do not wait for each other. */
static float read_through(const float *values, size_t count) {
    enum { N_SUMS = 128, PREFETCH = 1024 };
    float sums[N_SUMS] = {0}, sum = 0;
    for (size_t i = 0; i + N_SUMS <= count; i += N_SUMS) {
        for (size_t k = 0; k < N_SUMS; k += 16) {
            __builtin_prefetch((const void *)((uintptr_t)(values + i + k + PREFETCH)));
        }
        for (size_t k = 0; k < N_SUMS; ++k) {
            sums[k] += values[i + k];
        }
    }
    for (size_t k = 0; k < N_SUMS; ++k) {
        sum += sums[k];
    }
    return sum;
}

static void run_network(Parts *parts, float value) {
    const SlideKernel *kernel = parts->model.kernel;
    const SlideNetwork *predictor = &parts->model.predictor;
    SlideNetworkState *state = &slide_now(&parts->state)->predictor;
    if (slide_is_recurrent(predictor->family)) {
        predictor->features[0] = value;
        parts->found = *predictor->family->evaluate(predictor, kernel, state, 0);
        state->cells.states[0] = predictor->of.cells.next[0];
    } else {
        state->layers.ring[0] = value;
        parts->found = *slide_feed_forward_evaluate(&parts->network.of.layers.stack, kernel,
                                                    state->layers.ring);
    }
}

static bool see(Parts *parts, double value, uint64_t sample) {
    SlideSeen *seen = slide_now(&parts->state);
    parts->model.taken[0] = value;
    return slide_network_see(&parts->model.predictor, &seen->predictor, sample,
                             parts->model.taken, seen->samples.ring);
}

static bool step(Parts *parts, double part, bool reads) {
    const SlideScaling *scaling = parts->model.input_scaling;
    parts->state.inputs[0] = scaling->offset + part * scaling->scale;
    bool good = slide_stream_step(&parts->model, &parts->state, parts->model.step);
    if (reads && parts->model.estimator.positions > 0) {
        slide_stream_estimate(&parts->model, &parts->state);
    }
    if (reads && parts->model.bound.memory_length > 0) {
        slide_stream_bound(&parts->model, &parts->state);
    }
    return good;
}

int parts_repeat(Parts *parts, int part, int times) {
    bool good = true;
    for (int k = 0; k < times && good; ++k) {
        /* Not zero: a cosine without its sine would have no direction. */
        const double value = (k % 100 + 1) * 0.01;
        switch (part) {
        case NETWORK:
            run_network(parts, (float)value);
            break;
        case FEATURES:
            good = see(parts, value, (uint64_t)k);
            break;
        case STEP:
        case STEP_AND_READ:
            good = step(parts, value, part == STEP_AND_READ);
            break;
        case READ_MEMORY:
            parts->found =
                read_through(parts->memory, parts->memory_size / sizeof(float));
            break;
        default:
            good = false;
        }
    }
    return good ? 0 : 1;
}
