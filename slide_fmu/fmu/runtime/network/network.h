/* A network of either family, as the stream evaluates it. */
#ifndef SLIDE_NETWORK_H
#define SLIDE_NETWORK_H

#include "cells.h"
#include "layers.h"

typedef struct {
    uint32_t kind; /* SlideKind */
    uint32_t n_samples;
    uint32_t n_needed; /* inputs before which the network has forgotten: those it sees, or with
                          cells those of the oldest sample of the output window */
    SlideLayers layers; /* of kind SLIDE_FEED_FORWARD */
    SlideCells cells;   /* of kind SLIDE_STATE_SPACE */
} SlideNetwork;

/* All that changes; part of the flat state block. */
typedef struct {
    SlideLayersState layers; /* of layers */
    SlideCellState cells;    /* of cells */
} SlideNetworkState;

/* Of the values that layers give, only the last n_kept are kept. */
void slide_network_place(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                         SlideArena *arena);
void slide_network_state_place(SlideNetworkState *state, const SlideNetwork *network,
                               SlideArena *arena);

/* Forget all; the present input, scaled [n_inputs], counts for all before the next. What is not
 * finite shows when the next is seen. */
void slide_network_restart(const SlideNetwork *network, SlideNetworkState *state,
                           const double *input, const double *before);

/* Look at the next input, with its number and those before it [SLIDE_BEFORE][n_inputs], newest
 * first. False when a feature is not finite. */
bool slide_network_see(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample,
                       const double *input, const double *before);

/* Undo the last slide_network_see, of the same sample, which was good. */
void slide_network_unsee(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample);

/* The values after the input that was seen; cells stay as they were until slide_network_accept. */
const float *slide_network_evaluate(const SlideNetwork *network, const SlideKernel *kernel,
                                    const SlideNetworkState *state, uint64_t sample);
void slide_network_accept(const SlideNetwork *network, SlideNetworkState *state);

/* Samples of the outputs that the network knows at a time: those that layers give at once, those of
 * the output window of cells. */
uint32_t slide_network_block_size(const SlideNetworkView *view, uint32_t n_outputs);

/* Place what slide_network_block needs, after the network. */
void slide_network_place_block(SlideNetwork *network, const SlideNetworkView *view,
                               uint32_t n_kept, SlideArena *arena);

/* All these values [block size][n_outputs] after a sample that was accepted, oldest first; they
 * stay valid until the next evaluation. */
const float *slide_network_block(const SlideNetwork *network, const SlideKernel *kernel,
                                 const SlideNetworkState *state, uint64_t sample);

#endif
