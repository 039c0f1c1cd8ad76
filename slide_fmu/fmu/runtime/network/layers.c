#include "exact.h"
#include "network.h"

#include <string.h>

static void place_ages(SlideLayers *layers, const SlideIndices *ages, size_t n_features,
                       SlideArena *arena) {
    layers->n_ages = ages->count;
    layers->ages = slide_place(arena, ages->count, sizeof *layers->ages);
    layers->picked = slide_place(arena, 2 * ages->count * n_features, sizeof(float));
    for (size_t i = 0; arena->base != NULL && i < ages->count; ++i) {
        layers->ages[i] = slide_u32(ages->at + 4 * i);
    }
}

static void read(SlideNetworkView *view, SlideCursor *cursor) {
    slide_layers_read(&view->of.layers, view->features.chosen.count, cursor);
    view->n_samples = view->of.layers.n_samples;
    view->n_values = view->of.layers.n_values;
}

/* Layers give one sample after the part of the window that one output may use, or a block of
 * samples after the whole window. */
static bool fits(const SlideNetworkView *view, uint32_t n_in, uint32_t n_out, uint32_t n_outputs) {
    return (view->n_values == n_outputs && view->n_samples == n_in - n_out + 1) ||
           (view->n_values == (uint64_t)n_out * n_outputs && view->n_samples == n_in);
}

static void place(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                  SlideArena *arena) {
    SlideLayers *layers = &network->of.layers;
    layers->n_slots = (size_t)view->n_samples + 1;
    network->n_block = view->n_values / n_kept;
    network->n_settling = 1;
    slide_features_place(&network->seen, &view->features, NULL, 0, arena);
    network->features = slide_place(arena, network->seen.count, sizeof(float));
    place_ages(layers, &view->of.layers.ages, network->seen.count, arena);
    slide_feed_forward_place(&layers->stack, &view->of.layers, n_kept, arena);
}

static void place_state(SlideNetworkState *state, const SlideNetwork *network,
                        SlideArena *arena) {
    const size_t slots = 2 * network->of.layers.n_slots;
    state->layers.ring = slide_place(arena, slots * network->seen.count, sizeof(float));
}

static void see(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample) {
    const size_t n_slots = network->of.layers.n_slots, count = network->seen.count;
    float *slot = state->layers.ring + (size_t)(sample % n_slots) * count;
    memcpy(slot, network->features, count * sizeof(float));
    memcpy(slot + n_slots * count, network->features, count * sizeof(float));
}

static void restart(const SlideNetwork *network, SlideNetworkState *state) {
    for (uint64_t sample = 0; sample < network->of.layers.n_slots; ++sample) {
        see(network, state, sample);
    }
}

/* What the network looks at after a sample: its window itself, or copies of some ages. The window
 * begins with the slot that comes two after the sample's, around the ring. */
static const float *window_of(const SlideNetwork *network, const SlideLayersState *state,
                              uint64_t sample, float *picked) {
    const SlideLayers *layers = &network->of.layers;
    const size_t count = network->seen.count, n_samples = network->n_samples;
    const size_t first = (size_t)((sample + 2) % layers->n_slots);
    const float *window = state->ring + first * count;
    for (size_t i = 0; i < layers->n_ages; ++i) {
        size_t place = n_samples - 1 - layers->ages[i];
        memcpy(picked + i * count, window + place * count, count * sizeof(float));
    }
    return layers->n_ages > 0 ? picked : window;
}

void slide_layers_evaluate_two(const SlideNetwork *network, const SlideKernel *kernel,
                               const SlideLayersState *state, uint64_t first, uint64_t second,
                               const float *values[2]) {
    const SlideLayers *layers = &network->of.layers;
    float *other = layers->picked + layers->n_ages * network->seen.count;
    const float *const windows[2] = {window_of(network, state, first, layers->picked),
                                     window_of(network, state, second, other)};
    slide_feed_forward_evaluate_two(&layers->stack, kernel, windows, values);
}

static const float *evaluate(const SlideNetwork *network, const SlideKernel *kernel,
                             const SlideNetworkState *state, uint64_t sample) {
    return slide_feed_forward_evaluate(&network->of.layers.stack, kernel,
                                       window_of(network, &state->layers, sample, network->of.layers.picked));
}

/* What has been seen is all that the next evaluation needs. */
static void accept(const SlideNetwork *network, SlideNetworkState *state) {
    (void)network, (void)state;
}

static const float *block(const SlideNetwork *network, const SlideKernel *kernel,
                          const SlideNetworkState *state, uint64_t sample) {
    return slide_feed_forward_block(&network->of.layers.stack, kernel,
                                    window_of(network, &state->layers, sample, network->of.layers.picked));
}

static void place_exact(SlideExact *scratch, const SlideNetwork *network, SlideArena *arena) {
    SlideExactLayers *exact = &scratch->layers;
    const size_t widest = network->of.layers.stack.widest * SLIDE_PANEL;
    exact->window =
        slide_place(arena, (size_t)network->n_samples * network->seen.count, sizeof(double));
    exact->back[0] = slide_place(arena, widest, sizeof(double));
    exact->back[1] = slide_place(arena, widest, sizeof(double));
    exact->values = slide_place(arena, 2 * (size_t)network->n_values, sizeof(double));
}

static void add_layer(const SlideLayer *layer, const double *x, double *y) {
    const float *weights = layer->weights;
    for (size_t panel = 0; panel < layer->n_panels; ++panel, y += SLIDE_PANEL) {
        for (size_t i = 0; i < layer->n_in; ++i, weights += SLIDE_PANEL) {
            for (size_t lane = 0; lane < SLIDE_PANEL; ++lane) {
                y[lane] += weights[lane] * x[i];
            }
        }
    }
}

static void look(const SlideNetwork *network, const SlideExactLayers *exact,
                 const SlideExactRun *run) {
    const SlideLayers *layers = &network->of.layers;
    const size_t n_inputs = network->seen.n_inputs;
    const size_t n_seen = layers->n_ages > 0 ? layers->n_ages : network->n_samples;
    for (size_t i = 0; i < n_seen; ++i) {
        size_t age = layers->n_ages > 0 ? layers->ages[i] : n_seen - 1 - i;
        const double *input = run->samples + age * n_inputs;
        slide_features_exact(&network->seen, input, input + n_inputs,
                             exact->window + i * network->seen.count);
    }
}

static const double *run_exact(const SlideNetwork *network, const SlideExact *scratch,
                               const SlideExactRun *run) {
    const SlideExactLayers *exact = &scratch->layers;
    const SlideFeedForward *stack = &network->of.layers.stack;
    const double *x = exact->window;
    double *y = NULL;
    look(network, exact, run);
    for (uint32_t i = 0; i < stack->n_layers; ++i) {
        const SlideLayer *layer = &stack->layers[i];
        const size_t count = layer->n_panels * SLIDE_PANEL;
        y = exact->back[i % 2];
        for (size_t row = 0; row < count; ++row) {
            y[row] = layer->bias[row];
        }
        add_layer(layer, x, y);
        slide_activate_exact(layer->activation, y, count);
        x = y;
    }
    add_layer(&stack->skip, exact->window, y);
    memcpy(exact->values, y, network->n_values * sizeof *y);
    return exact->values;
}

const SlideFamily slide_feed_forward_family = {
    .number = 1,
    .read = read,
    .fits = fits,
    .place = place,
    .place_state = place_state,
    .restart = restart,
    .see = see,
    .evaluate = evaluate,
    .accept = accept,
    .block = block,
    .place_exact = place_exact,
    .run_exact = run_exact,
};
