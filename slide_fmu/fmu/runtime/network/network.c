#include "network.h"

#include <math.h>

static const SlideFamily *const FAMILIES[] = SLIDE_FAMILIES;
enum { N_FAMILIES = sizeof FAMILIES / sizeof FAMILIES[0] };

static const SlideFamily *take_family(SlideCursor *cursor) {
    const uint32_t number = slide_take_u32(cursor, "a network");
    for (size_t i = 0; i < N_FAMILIES; ++i) {
        if (FAMILIES[i]->number == number) {
            return FAMILIES[i];
        }
    }
    slide_check(cursor, false,
                "surrogate file: network of kind %u; expected one that this version of slide-fmu "
                "writes: export the surrogate again",
                (unsigned)number);
    return NULL;
}

bool slide_is_recurrent(const SlideFamily *family) { return family->keep != NULL; }

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
    network->n_values = view->n_values;
    network->memory_length = view->n_samples;
    network->family->place(network, view, n_kept, arena);
}

void slide_network_restart(const SlideNetwork *network, SlideNetworkState *state,
                           const double *input, const double *before) {
    slide_features_write(&network->seen, input, before, network->features);
    network->family->restart(network, state);
}

bool slide_network_see(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample,
                       const double *input, const double *before) {
    const bool finite = slide_features_write(&network->seen, input, before, network->features);
    if (finite) {
        network->family->see(network, state, sample);
    }
    return finite;
}

void slide_network_see_anyhow(const SlideNetwork *network, SlideNetworkState *state,
                              uint64_t sample, const double *input, const double *before) {
    if (!slide_network_see(network, state, sample, input, before)) {
        for (size_t i = 0; i < network->seen.count; ++i) {
            network->features[i] = NAN;
        }
        network->family->see(network, state, sample);
    }
}
