#include "network.h"

void slide_network_place(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                         SlideArena *arena) {
    network->kind = view->kind;
    network->n_samples = view->n_samples;
    network->n_needed = view->n_samples;
    if (view->kind == SLIDE_STATE_SPACE) {
        network->n_needed = view->n_samples - view->cell.n_out + 1;
        slide_cells_place(&network->cells, view, arena);
    } else {
        slide_layers_place(&network->layers, view, n_kept, arena);
    }
}

void slide_network_state_place(SlideNetworkState *state, const SlideNetwork *network,
                               SlideArena *arena) {
    if (network->kind == SLIDE_STATE_SPACE) {
        slide_cell_state_place(&state->cells, &network->cells, arena);
    } else {
        slide_layers_state_place(&state->layers, &network->layers, arena);
    }
}

void slide_network_restart(const SlideNetwork *network, SlideNetworkState *state,
                           const double *input, const double *before) {
    if (network->kind == SLIDE_STATE_SPACE) {
        slide_cells_restart(&network->cells, &state->cells);
    } else {
        slide_layers_fill(&network->layers, &state->layers, input, before);
    }
}

bool slide_network_see(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample,
                       const double *input, const double *before) {
    if (network->kind == SLIDE_STATE_SPACE) {
        return slide_cells_see(&network->cells, input, before);
    }
    return slide_layers_see(&network->layers, &state->layers, sample, input, before);
}

void slide_network_unsee(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample) {
    if (network->kind != SLIDE_STATE_SPACE) { /* cells have changed nothing */
        slide_layers_unsee(&network->layers, &state->layers, sample);
    }
}

const float *slide_network_evaluate(const SlideNetwork *network, const SlideKernel *kernel,
                                    const SlideNetworkState *state, uint64_t sample) {
    if (network->kind == SLIDE_STATE_SPACE) {
        return slide_cells_advance(&network->cells, kernel, &state->cells);
    }
    return slide_layers_evaluate(&network->layers, kernel, &state->layers, sample);
}

void slide_network_accept(const SlideNetwork *network, SlideNetworkState *state) {
    if (network->kind == SLIDE_STATE_SPACE) {
        slide_cells_accept(&network->cells, &state->cells);
    }
}

uint32_t slide_network_block_size(const SlideNetworkView *view, uint32_t n_outputs) {
    return view->kind == SLIDE_STATE_SPACE ? view->cell.n_out : view->n_values / n_outputs;
}

void slide_network_place_block(SlideNetwork *network, const SlideNetworkView *view,
                               uint32_t n_kept, SlideArena *arena) {
    if (view->kind != SLIDE_STATE_SPACE) {
        slide_feed_forward_place_block(&network->layers.stack, &view->layers, n_kept, arena);
    }
}

const float *slide_network_block(const SlideNetwork *network, const SlideKernel *kernel,
                                 const SlideNetworkState *state, uint64_t sample) {
    if (network->kind == SLIDE_STATE_SPACE) {
        return slide_cells_block(&network->cells, &state->cells);
    }
    return slide_layers_block(&network->layers, kernel, &state->layers, sample);
}
