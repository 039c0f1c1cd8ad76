#include "network_view.h"

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
    network->layers.half = network->kind == SLIDE_FEED_FORWARD_HALF;
    if (network->layers.half) {
        network->kind = SLIDE_FEED_FORWARD;
    }
    if (network->kind != SLIDE_FEED_FORWARD && network->kind != SLIDE_STATE_SPACE) {
        return slide_say(message,
                         "surrogate file: network of kind %u; expected %d (feed-forward), %d "
                         "(state space) or %d (feed-forward, float16)",
                         (unsigned)network->kind, (int)SLIDE_FEED_FORWARD, (int)SLIDE_STATE_SPACE,
                         (int)SLIDE_FEED_FORWARD_HALF);
    }
    if (!slide_features_read(&network->features, n_inputs, section, message)) {
        return false;
    }
    return network->kind == SLIDE_FEED_FORWARD ? read_feed_forward(network, section, message)
                                               : read_state_space(network, section, message);
}
