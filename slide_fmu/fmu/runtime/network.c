#include "network.h"

#include <string.h>

void slide_network_place(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                         SlideArena *arena) {
    network->kind = view->kind;
    network->n_samples = view->n_samples;
    network->n_needed = view->n_samples;
    if (view->kind == SLIDE_STATE_SPACE) {
        network->n_needed = view->n_samples - view->cell.n_out + 1;
        slide_cells_place(&network->cells, view, arena);
        return;
    }
    SlideLayers *layers = &network->layers;
    slide_features_place(&layers->seen, &view->features, NULL, 0, arena);
    layers->features = slide_place(arena, layers->seen.count, sizeof(float));
    slide_feed_forward_place(&layers->stack, &view->layers, n_kept, arena);
}

void slide_network_state_place(SlideNetworkState *state, const SlideNetwork *network,
                               SlideArena *arena) {
    if (network->kind == SLIDE_STATE_SPACE) {
        slide_cell_state_place(&state->cells, &network->cells, arena);
        return;
    }
    size_t slots = 2 * (size_t)network->n_samples;
    state->ring = slide_place(arena, slots * network->layers.seen.count, sizeof(float));
}

static void write_slot(const SlideNetwork *network, SlideNetworkState *state, size_t slot) {
    size_t count = network->layers.seen.count;
    float *first = state->ring + slot * count;
    memcpy(first, network->layers.features, count * sizeof(float));
    memcpy(first + network->n_samples * count, first, count * sizeof(float));
}

void slide_network_restart(const SlideNetwork *network, SlideNetworkState *state,
                           const double *input, const double *before) {
    if (network->kind == SLIDE_STATE_SPACE) {
        slide_cells_restart(&network->cells, &state->cells);
        return;
    }
    slide_features_write(&network->layers.seen, input, before, network->layers.features);
    for (size_t slot = 0; slot < network->n_samples; ++slot) {
        write_slot(network, state, slot);
    }
}

bool slide_network_see(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample,
                       const double *input, const double *before) {
    if (network->kind == SLIDE_STATE_SPACE) {
        return slide_cells_see(&network->cells, input, before);
    }
    const SlideLayers *layers = &network->layers;
    bool finite = slide_features_write(&layers->seen, input, before, layers->features);
    if (finite) {
        write_slot(network, state, (size_t)(sample % network->n_samples));
    }
    return finite;
}

const float *slide_network_evaluate(const SlideNetwork *network, const SlideKernel *kernel,
                                    const SlideNetworkState *state, uint64_t sample) {
    if (network->kind == SLIDE_STATE_SPACE) {
        return slide_cells_advance(&network->cells, kernel, &state->cells);
    }
    size_t first = (size_t)(sample % network->n_samples) + 1;
    const SlideLayers *layers = &network->layers;
    return slide_feed_forward_evaluate(&layers->stack, kernel,
                                       state->ring + first * layers->seen.count);
}

void slide_network_accept(const SlideNetwork *network, SlideNetworkState *state) {
    if (network->kind == SLIDE_STATE_SPACE) {
        slide_cells_accept(&network->cells, &state->cells);
    }
}
