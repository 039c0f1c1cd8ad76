/* A network of some family: described in a surrogate file (byte contract:
 * slide_fmu/network/bytes.py), placed, and evaluated by the stream. */
#ifndef SLIDE_NETWORK_H
#define SLIDE_NETWORK_H

#include "cells.h"
#include "exact.h"
#include "layers.h"

typedef struct SlideFamily SlideFamily;

typedef struct SlideNetworkView {
    const SlideFamily *family;
    uint32_t n_samples, n_values;
    SlideFeaturesView features;
    SlideLayersView layers; /* of slide_feed_forward_family */
    SlideCellView cell;     /* of slide_state_space_family */
} SlideNetworkView;

typedef struct SlideNetwork {
    const SlideFamily *family;
    uint32_t n_samples;
    uint32_t memory_length; /* inputs before which the network has forgotten: those it sees, or
                               with cells those of the oldest sample of the output window */
    SlideLayers layers;
    SlideCells cells;
} SlideNetwork;

/* All that changes; part of the flat state block. */
typedef struct SlideNetworkState {
    SlideLayersState layers;
    SlideCellState cells;
} SlideNetworkState;

/* A family of networks; those that there are stand in a table in network.c. Its functions are those
 * of the same names below, where what they do is said; NULL: there is nothing to do. */
struct SlideFamily {
    uint32_t number; /* in files */
    bool recurrent;  /* every sample must be evaluated, and the influence of those that were
                        forgotten is measured: the truncation error */
    void (*read)(SlideNetworkView *view, SlideCursor *cursor);
    bool (*fits)(const SlideNetworkView *view, uint32_t n_in, uint32_t n_out, uint32_t n_outputs);
    void (*place)(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                  SlideArena *arena);
    void (*place_state)(SlideNetworkState *state, const SlideNetwork *network, SlideArena *arena);
    void (*restart)(const SlideNetwork *network, SlideNetworkState *state, const double *input,
                    const double *before);
    bool (*see)(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample,
                const double *input, const double *before);
    void (*unsee)(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample);
    const float *(*evaluate)(const SlideNetwork *network, const SlideKernel *kernel,
                             const SlideNetworkState *state, uint64_t sample);
    void (*accept)(const SlideNetwork *network, SlideNetworkState *state);
    uint32_t (*block_size)(const SlideNetworkView *view, uint32_t n_outputs);
    void (*place_block)(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                        SlideArena *arena);
    const float *(*block)(const SlideNetwork *network, const SlideKernel *kernel,
                          const SlideNetworkState *state, uint64_t sample);
    /* Scratch in double precision, and a step in it: the values, scaled; of a recurrent network
     * exact->cells.errors too. */
    void (*place_exact)(SlideExact *exact, const SlideNetwork *network, SlideArena *arena);
    const double *(*run_exact)(const SlideNetwork *network, const SlideExact *exact,
                               const SlideExactRun *run);
};

/* Check a network and describe it. */
void slide_network_read(SlideNetworkView *view, uint32_t n_inputs, SlideCursor *cursor);

/* Of the values that layers give, only the last n_kept are kept. */
void slide_network_place(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                         SlideArena *arena);
void slide_network_state_place(SlideNetworkState *state, const SlideNetwork *network,
                               SlideArena *arena);

/* Forget all; the present input, scaled [n_inputs], counts for all before the next, as do those
 * before it [SLIDE_BEFORE][n_inputs], newest first. What is not finite shows when the next is
 * seen. */
void slide_network_restart(const SlideNetwork *network, SlideNetworkState *state,
                           const double *input, const double *before);

/* Look at a sample by its number. False when a feature is not finite; then nothing has changed. */
bool slide_network_see(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample,
                       const double *input, const double *before);

/* Undo the last slide_network_see, of the same sample, which was good. */
void slide_network_unsee(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample);

/* The values after the input that was seen; they stay valid until the next evaluation. Cells stay
 * as they were until slide_network_accept. */
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
