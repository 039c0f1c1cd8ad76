/* Time per step inside C, without FMI and without Python; built by kernel_time.py. */
#define _POSIX_C_SOURCE 199309L
#include "resource.h"
#include "stream.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

double kernel_seconds(const char *path, int steps);
double features_seconds(const char *path, int steps);
double step_seconds(const char *path, int steps);
double read_seconds(const char *path, int steps);

/* A surrogate ready to step, in one block. */
typedef struct {
    unsigned char *block;
    SlideModel model;
    SlideState state;
} Loaded;

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void place(Loaded *loaded, const SlidePayload *payload, SlideArena *arena) {
    slide_model_place(&loaded->model, payload, arena);
    slide_state_place(&loaded->state, &loaded->model, arena);
}

static bool load(Loaded *loaded, const char *path) {
    SlideMessage message;
    SlidePayload payload;
    SlideArena arena = {NULL, 0};
    size_t size;
    unsigned char *data = slide_read_file(path, &size, &message);
    bool good = data != NULL && slide_payload_read(&payload, data, size, &message);
    if (good) {
        place(loaded, &payload, &arena);
        loaded->block = calloc(arena.used + SLIDE_ALIGNMENT, 1);
        size_t misaligned = (size_t)((uintptr_t)loaded->block % SLIDE_ALIGNMENT);
        arena = (SlideArena){loaded->block + (SLIDE_ALIGNMENT - misaligned), 0};
        place(loaded, &payload, &arena);
        slide_state_reset(&loaded->model, &loaded->state);
    }
    free(data);
    return good && loaded->block != NULL && slide_stream_hold(&loaded->model, &loaded->state);
}

/* The surrogate's network alone: one evaluation of layers, or both cells of a ping-pong step. */
double kernel_seconds(const char *path, int steps) {
    Loaded loaded;
    if (!load(&loaded, path)) {
        return NAN;
    }
    const SlideModel *model = &loaded.model;
    const SlideCells *cells = &model->predictor.cells;
    SlideNetworkState *state = &loaded.state.predictor;
    double begin = now();
    for (int k = 0; k < steps; ++k) {
        if (model->predictor.kind == SLIDE_STATE_SPACE) {
            cells->features[0] = (float)(k % 100) * 0.01f;
            slide_cells_run(cells, model->kernel, &state->cells);
            state->cells.states[0] = cells->next[0];
        } else {
            state->layers.ring[0] = (float)(k % 100) * 0.01f;
            slide_feed_forward_evaluate(&model->predictor.layers.stack, model->kernel,
                                        state->layers.ring);
        }
    }
    double seconds = (now() - begin) / steps;
    free(loaded.block);
    return seconds;
}

/* What the surrogate's network sees of an input. */
double features_seconds(const char *path, int steps) {
    Loaded loaded;
    if (!load(&loaded, path)) {
        return NAN;
    }
    const SlideModel *model = &loaded.model;
    const double *before = loaded.state.samples.ring;
    bool good = true;
    double begin = now();
    for (int k = 0; k < steps; ++k) {
        model->sample[0] = (k % 100) * 0.01;
        good = slide_network_see(&model->predictor, &loaded.state.predictor, (uint64_t)k,
                                 model->sample, before) &&
               good;
    }
    double seconds = (now() - begin) / steps;
    free(loaded.block);
    return good ? seconds : NAN;
}

static double time_steps(const char *path, int steps, bool reads) {
    Loaded loaded;
    if (!load(&loaded, path)) {
        return NAN;
    }
    const SlideModel *model = &loaded.model;
    bool good = slide_stream_step(model, &loaded.state, model->step);
    reads = reads && model->estimator.positions > 0;
    if (reads) {
        slide_stream_estimate(model, &loaded.state);
    }
    double begin = now();
    for (int k = 0; k < steps; ++k) {
        double part = (k % 100) * 0.01;
        loaded.state.inputs[0] = model->input_scaling[0].offset + part * model->input_scaling[0].scale;
        good = slide_stream_step(model, &loaded.state, model->step) && good;
        if (reads) {
            slide_stream_estimate(model, &loaded.state);
        }
    }
    double seconds = (now() - begin) / steps;
    free(loaded.block);
    return good ? seconds : NAN;
}

/* A whole communication step: inputs scaled, network, outputs, window or states, history. */
double step_seconds(const char *path, int steps) { return time_steps(path, steps, false); }

/* The same, with its error estimates read. */
double read_seconds(const char *path, int steps) { return time_steps(path, steps, true); }
