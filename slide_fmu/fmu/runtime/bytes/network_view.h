/* Reader of one network in a surrogate file; byte contract: slide_fmu/network/bytes.py. */
#ifndef SLIDE_NETWORK_VIEW_H
#define SLIDE_NETWORK_VIEW_H

#include "cell_view.h"
#include "feature_set.h"
#include "layers_view.h"

typedef enum { SLIDE_FEED_FORWARD = 1, SLIDE_STATE_SPACE = 2 } SlideKind;

typedef struct {
    uint32_t kind; /* SlideKind */
    uint32_t n_samples, n_values;
    SlideFeaturesView features;
    SlideLayersView layers; /* of kind SLIDE_FEED_FORWARD */
    SlideCellView cell;     /* of kind SLIDE_STATE_SPACE */
} SlideNetworkView;

/* Check a network and describe it. False, with a message, when it must not be used. */
bool slide_network_read(SlideNetworkView *network, uint32_t n_inputs, SlideCursor *section,
                        SlideMessage *message);

#endif
