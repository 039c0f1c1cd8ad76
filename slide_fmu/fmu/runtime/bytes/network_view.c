#include "network_view.h"

/* In files of earlier versions: a network of layers with weights of float16. */
enum { FLOAT16 = 3 };

static bool read_feed_forward(SlideNetworkView *network, SlideCursor *section,
                              SlideMessage *message) {
    if (!slide_layers_read(&network->layers, network->features.chosen.count, section, message)) {
        return false;
    }
    network->n_samples = network->layers.n_samples;
    network->n_values = network->layers.n_values;
    return true;
}

static bool read_state_space(SlideNetworkView *network, SlideCursor *section,
                             SlideMessage *message) {
    if (!slide_cell_read(&network->cell, network->features.chosen.count, section, message)) {
        return false;
    }
    network->n_samples = network->cell.n_samples;
    network->n_values = network->cell.n_values;
    return true;
}

bool slide_network_read(SlideNetworkView *network, uint32_t n_inputs, SlideCursor *section,
                        SlideMessage *message) {
    if (!slide_take_u32(section, &network->kind)) {
        return slide_too_short(message, "a network");
    }
    if (network->kind == FLOAT16) {
        return slide_say(message,
                         "surrogate file: network of kind %u, with weights of float16, which are "
                         "no longer read; expected float32: export the surrogate again with "
                         "slide-fmu export from its recipe or its float32 FMU",
                         (unsigned)network->kind);
    }
    if (network->kind != SLIDE_FEED_FORWARD && network->kind != SLIDE_STATE_SPACE) {
        return slide_say(message,
                         "surrogate file: network of kind %u; expected %d (feed-forward) or %d "
                         "(state space)",
                         (unsigned)network->kind, (int)SLIDE_FEED_FORWARD, (int)SLIDE_STATE_SPACE);
    }
    if (!slide_features_read(&network->features, n_inputs, section, message)) {
        return false;
    }
    return network->kind == SLIDE_FEED_FORWARD ? read_feed_forward(network, section, message)
                                               : read_state_space(network, section, message);
}
