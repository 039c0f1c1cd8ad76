#include "layers.h"

#include <math.h>
#include <string.h>

static void place_ages(SlideLayers *layers, const SlideIndices *ages, SlideArena *arena) {
    layers->n_ages = ages->count;
    layers->ages = slide_place(arena, ages->count, sizeof *layers->ages);
    layers->picked = slide_place(arena, ages->count * layers->seen.count, sizeof(float));
    for (size_t i = 0; arena->base != NULL && i < ages->count; ++i) {
        layers->ages[i] = slide_u32(ages->at + 4 * i);
    }
}

void slide_layers_place(SlideLayers *layers, const SlideNetworkView *view, uint32_t n_kept,
                        SlideArena *arena) {
    layers->n_samples = view->n_samples;
    slide_features_place(&layers->seen, &view->features, NULL, 0, arena);
    layers->features = slide_place(arena, layers->seen.count, sizeof(float));
    layers->replaced = slide_place(arena, layers->seen.count, sizeof(float));
    place_ages(layers, &view->layers.ages, arena);
    slide_feed_forward_place(&layers->stack, &view->layers, n_kept, arena);
}

void slide_layers_state_place(SlideLayersState *state, const SlideLayers *layers,
                              SlideArena *arena) {
    size_t slots = 2 * (size_t)layers->n_samples;
    state->ring = slide_place(arena, slots * layers->seen.count, sizeof(float));
}

static float *slot_at(const SlideLayers *layers, const SlideLayersState *state, uint64_t sample) {
    return state->ring + (size_t)(sample % layers->n_samples) * layers->seen.count;
}

static void write_slot(const SlideLayers *layers, float *first, const float *features) {
    const size_t size = layers->seen.count * sizeof(float);
    memcpy(first, features, size);
    memcpy(first + layers->n_samples * layers->seen.count, features, size);
}

bool slide_layers_see(const SlideLayers *layers, SlideLayersState *state, uint64_t sample,
                      const double *input, const double *before) {
    bool finite = slide_features_write(&layers->seen, input, before, layers->features);
    if (finite) {
        float *slot = slot_at(layers, state, sample);
        memcpy(layers->replaced, slot, layers->seen.count * sizeof(float));
        write_slot(layers, slot, layers->features);
    }
    return finite;
}

void slide_layers_unsee(const SlideLayers *layers, SlideLayersState *state, uint64_t sample) {
    write_slot(layers, slot_at(layers, state, sample), layers->replaced);
}

void slide_layers_see_anyhow(const SlideLayers *layers, SlideLayersState *state, uint64_t sample,
                             const double *input, const double *before) {
    bool finite = slide_features_write(&layers->seen, input, before, layers->features);
    for (size_t i = 0; !finite && i < layers->seen.count; ++i) {
        layers->features[i] = NAN;
    }
    write_slot(layers, slot_at(layers, state, sample), layers->features);
}

void slide_layers_fill(const SlideLayers *layers, SlideLayersState *state, const double *input,
                       const double *before) {
    slide_features_write(&layers->seen, input, before, layers->features);
    for (uint64_t sample = 0; sample < layers->n_samples; ++sample) {
        write_slot(layers, slot_at(layers, state, sample), layers->features);
    }
}

const float *slide_layers_pick(const SlideLayers *layers, const float *window, float *picked) {
    size_t count = layers->seen.count;
    for (size_t i = 0; i < layers->n_ages; ++i) {
        size_t place = layers->n_samples - 1 - layers->ages[i];
        memcpy(picked + i * count, window + place * count, count * sizeof(float));
    }
    return layers->n_ages > 0 ? picked : window;
}

const float *slide_layers_window(const SlideLayers *layers, const SlideLayersState *state,
                                 uint64_t sample) {
    size_t first = (size_t)(sample % layers->n_samples) + 1;
    return slide_layers_pick(layers, state->ring + first * layers->seen.count, layers->picked);
}

const float *slide_layers_evaluate(const SlideLayers *layers, const SlideKernel *kernel,
                                   const SlideLayersState *state, uint64_t sample) {
    return slide_feed_forward_evaluate(&layers->stack, kernel,
                                       slide_layers_window(layers, state, sample));
}

const float *slide_layers_block(const SlideLayers *layers, const SlideKernel *kernel,
                                const SlideLayersState *state, uint64_t sample) {
    return slide_feed_forward_block(&layers->stack, kernel,
                                    slide_layers_window(layers, state, sample));
}
