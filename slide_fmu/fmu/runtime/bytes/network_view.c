#include "network_view.h"

/* In files of earlier versions: a network of layers with weights of float16. */
enum { FLOAT16 = 3 };

void slide_network_read(SlideNetworkView *network, uint32_t n_inputs, SlideCursor *cursor) {
    network->kind = slide_take_u32(cursor, "a network");
    const unsigned kind = network->kind;
    slide_check(cursor, kind != FLOAT16,
                "surrogate file: network of kind %u, with weights of float16, which are no longer "
                "read; expected float32: export the surrogate again with slide-fmu export from "
                "its recipe or its float32 FMU",
                kind);
    slide_check(cursor, kind == SLIDE_FEED_FORWARD || kind == SLIDE_STATE_SPACE,
                "surrogate file: network of kind %u; expected %d (feed-forward) or %d (state "
                "space)",
                kind, (int)SLIDE_FEED_FORWARD, (int)SLIDE_STATE_SPACE);
    slide_features_read(&network->features, n_inputs, cursor);
    if (kind == SLIDE_FEED_FORWARD) {
        slide_layers_read(&network->layers, network->features.chosen.count, cursor);
        network->n_samples = network->layers.n_samples;
        network->n_values = network->layers.n_values;
    } else {
        slide_cell_read(&network->cell, network->features.chosen.count, cursor);
        network->n_samples = network->cell.n_samples;
        network->n_values = network->cell.n_values;
    }
}
