/* A network of either family, as the stream evaluates it. */
#ifndef SLIDE_NETWORK_H
#define SLIDE_NETWORK_H

#include "cells.h"
#include "feed_forward.h"

typedef struct {
    uint32_t kind; /* SlideKind */
    uint32_t n_samples;
    uint32_t n_needed; /* inputs before which the network has forgotten: those it sees, or with
                          cells those of the oldest sample of the output window */
    SlideFeedForward layers; /* of kind SLIDE_FEED_FORWARD */
    SlideCells cells;        /* of kind SLIDE_STATE_SPACE */
} SlideNetwork;

#endif
