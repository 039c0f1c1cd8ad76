#include "network.h"

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

static void read(SlideNetworkView *view, SlideCursor *cursor) {
    slide_layers_read(&view->layers, view->features.chosen.count, cursor);
    view->n_samples = view->layers.n_samples;
    view->n_values = view->layers.n_values;
}

/* Layers give one sample after the part of the window that one output may use, or a block of
 * samples after the whole window. */
static bool fits(const SlideNetworkView *view, uint32_t n_in, uint32_t n_out, uint32_t n_outputs) {
    return (view->n_values == n_outputs && view->n_samples == n_in - n_out + 1) ||
           (view->n_values == (uint64_t)n_out * n_outputs && view->n_samples == n_in);
}

static void place(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                  SlideArena *arena) {
    SlideLayers *layers = &network->layers;
    layers->n_samples = view->n_samples;
    slide_features_place(&layers->seen, &view->features, NULL, 0, arena);
    layers->features = slide_place(arena, layers->seen.count, sizeof(float));
    layers->replaced = slide_place(arena, layers->seen.count, sizeof(float));
    place_ages(layers, &view->layers.ages, arena);
    slide_feed_forward_place(&layers->stack, &view->layers, n_kept, arena);
}

static void place_state(SlideNetworkState *state, const SlideNetwork *network,
                        SlideArena *arena) {
    const SlideLayers *layers = &network->layers;
    size_t slots = 2 * (size_t)layers->n_samples;
    state->layers.ring = slide_place(arena, slots * layers->seen.count, sizeof(float));
}

static float *slot_at(const SlideLayers *layers, const SlideLayersState *state, uint64_t sample) {
    return state->ring + (size_t)(sample % layers->n_samples) * layers->seen.count;
}

static void write_slot(const SlideLayers *layers, float *first, const float *features) {
    const size_t size = layers->seen.count * sizeof(float);
    memcpy(first, features, size);
    memcpy(first + layers->n_samples * layers->seen.count, features, size);
}

/* The place written to holds the oldest sample, which no later window needs. */
static bool see(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample,
                const double *input, const double *before) {
    const SlideLayers *layers = &network->layers;
    bool finite = slide_features_write(&layers->seen, input, before, layers->features);
    if (finite) {
        float *slot = slot_at(layers, &state->layers, sample);
        memcpy(layers->replaced, slot, layers->seen.count * sizeof(float));
        write_slot(layers, slot, layers->features);
    }
    return finite;
}

static void unsee(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample) {
    const SlideLayers *layers = &network->layers;
    write_slot(layers, slot_at(layers, &state->layers, sample), layers->replaced);
}

void slide_layers_see_anyhow(const SlideLayers *layers, SlideLayersState *state, uint64_t sample,
                             const double *input, const double *before) {
    bool finite = slide_features_write(&layers->seen, input, before, layers->features);
    for (size_t i = 0; !finite && i < layers->seen.count; ++i) {
        layers->features[i] = NAN;
    }
    write_slot(layers, slot_at(layers, state, sample), layers->features);
}

static void restart(const SlideNetwork *network, SlideNetworkState *state, const double *input,
                    const double *before) {
    const SlideLayers *layers = &network->layers;
    slide_features_write(&layers->seen, input, before, layers->features);
    for (uint64_t sample = 0; sample < layers->n_samples; ++sample) {
        write_slot(layers, slot_at(layers, &state->layers, sample), layers->features);
    }
}

/* What the network looks at after a sample: its window itself, or copies of some ages. */
static const float *window_of(const SlideLayers *layers, const SlideLayersState *state,
                              uint64_t sample) {
    const size_t count = layers->seen.count;
    const float *window = state->ring + ((size_t)(sample % layers->n_samples) + 1) * count;
    for (size_t i = 0; i < layers->n_ages; ++i) {
        size_t place = layers->n_samples - 1 - layers->ages[i];
        memcpy(layers->picked + i * count, window + place * count, count * sizeof(float));
    }
    return layers->n_ages > 0 ? layers->picked : window;
}

static const float *evaluate(const SlideNetwork *network, const SlideKernel *kernel,
                             const SlideNetworkState *state, uint64_t sample) {
    const SlideLayers *layers = &network->layers;
    return slide_feed_forward_evaluate(&layers->stack, kernel,
                                       window_of(layers, &state->layers, sample));
}

static uint32_t block_size(const SlideNetworkView *view, uint32_t n_outputs) {
    return view->n_values / n_outputs;
}

static void place_block(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                        SlideArena *arena) {
    slide_feed_forward_place_block(&network->layers.stack, &view->layers, n_kept, arena);
}

static const float *block(const SlideNetwork *network, const SlideKernel *kernel,
                          const SlideNetworkState *state, uint64_t sample) {
    const SlideLayers *layers = &network->layers;
    return slide_feed_forward_block(&layers->stack, kernel,
                                    window_of(layers, &state->layers, sample));
}

const SlideFamily slide_feed_forward_family = {
    .number = 1,
    .read = read,
    .fits = fits,
    .place = place,
    .place_state = place_state,
    .restart = restart,
    .see = see,
    .unsee = unsee,
    .evaluate = evaluate,
    .block_size = block_size,
    .place_block = place_block,
    .block = block,
    .place_exact = slide_exact_layers_place,
    .run_exact = slide_exact_layers_run,
};
