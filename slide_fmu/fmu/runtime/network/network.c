#include "network.h"

static const SlideFamily *const FAMILIES[] = {
    &slide_feed_forward_family,
    &slide_state_space_family,
};
enum { N_FAMILIES = sizeof FAMILIES / sizeof FAMILIES[0] };

/* In files of earlier versions: a network of layers with weights of float16. */
enum { FLOAT16 = 3 };

static const SlideFamily *take_family(SlideCursor *cursor) {
    const uint32_t number = slide_take_u32(cursor, "a network");
    for (size_t i = 0; i < N_FAMILIES; ++i) {
        if (FAMILIES[i]->number == number) {
            return FAMILIES[i];
        }
    }
    slide_check(cursor, number != FLOAT16,
                "surrogate file: network of kind %u, with weights of float16, which are no longer "
                "read; expected float32: export the surrogate again with slide-fmu export from "
                "its recipe or its float32 FMU",
                (unsigned)number);
    slide_check(cursor, false,
                "surrogate file: network of kind %u; expected 1 (feed-forward) or 2 (state space)",
                (unsigned)number);
    return NULL;
}

void slide_network_read(SlideNetworkView *view, uint32_t n_inputs, SlideCursor *cursor) {
    view->family = take_family(cursor);
    slide_features_read(&view->features, n_inputs, cursor);
    if (view->family != NULL) {
        view->family->read(view, cursor);
    }
}

void slide_network_place(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                         SlideArena *arena) {
    network->family = view->family;
    network->n_samples = view->n_samples;
    network->memory_length = view->n_samples;
    network->family->place(network, view, n_kept, arena);
}

void slide_network_state_place(SlideNetworkState *state, const SlideNetwork *network,
                               SlideArena *arena) {
    network->family->place_state(state, network, arena);
}

void slide_network_restart(const SlideNetwork *network, SlideNetworkState *state,
                           const double *input, const double *before) {
    network->family->restart(network, state, input, before);
}

bool slide_network_see(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample,
                       const double *input, const double *before) {
    return network->family->see(network, state, sample, input, before);
}

void slide_network_unsee(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample) {
    if (network->family->unsee != NULL) {
        network->family->unsee(network, state, sample);
    }
}

const float *slide_network_evaluate(const SlideNetwork *network, const SlideKernel *kernel,
                                    const SlideNetworkState *state, uint64_t sample) {
    return network->family->evaluate(network, kernel, state, sample);
}

void slide_network_accept(const SlideNetwork *network, SlideNetworkState *state) {
    if (network->family->accept != NULL) {
        network->family->accept(network, state);
    }
}

uint32_t slide_network_block_size(const SlideNetworkView *view, uint32_t n_outputs) {
    return view->family->block_size(view, n_outputs);
}

void slide_network_place_block(SlideNetwork *network, const SlideNetworkView *view,
                               uint32_t n_kept, SlideArena *arena) {
    if (view->family->place_block != NULL) {
        view->family->place_block(network, view, n_kept, arena);
    }
}

const float *slide_network_block(const SlideNetwork *network, const SlideKernel *kernel,
                                 const SlideNetworkState *state, uint64_t sample) {
    return network->family->block(network, kernel, state, sample);
}
