/* The families of networks, and what each of them holds: the only C file to change for a further
 * one, which is a pair of files that defines a SlideFamily (network.h). */
#ifndef SLIDE_FAMILIES_H
#define SLIDE_FAMILIES_H

#include "cells.h"
#include "layers.h"

#define SLIDE_FAMILIES {&slide_feed_forward_family, &slide_state_space_family}

/* In a file. */
typedef union {
    SlideLayersView layers;
    SlideCellView cell;
} SlideFamilyView;

/* Placed. */
typedef union {
    SlideLayers layers;
    SlideCells cells;
} SlideFamilyNetwork;

/* All that changes: places in the flat state block. */
typedef union {
    SlideLayersState layers;
    SlideCellState cells;
} SlideNetworkState;

/* Scratch in double precision. */
typedef union SlideExact {
    SlideExactLayers layers;
    SlideExactCells cells;
} SlideExact;

#endif
