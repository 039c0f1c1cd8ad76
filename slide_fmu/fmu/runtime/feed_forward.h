/* A feed-forward network in the layout of the kernels. */
#ifndef SLIDE_NETWORK_H
#define SLIDE_NETWORK_H

#include "arena.h"
#include "kernel.h"
#include "payload.h"

typedef struct {
    size_t n_in, n_panels;
    uint32_t activation;
    float *weights; /* [panel][n_in][SLIDE_PANEL], zeros where no output is */
    float *bias;    /* [panel][SLIDE_PANEL] */
} SlideLayer;

typedef struct {
    uint32_t n_samples, n_layers;
    SlideLayer *layers;
    SlideLayer skip; /* no panels when there is no linear path */
    float *scratch[2];
} SlideNetwork;

/* Place a network in the arena; of the values it gives, only the last n_kept are kept (the newest
 * sample of a block). While the arena measures, the network is not usable. */
void slide_network_place(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                         SlideArena *arena);

/* Evaluate on a window of n_samples samples, oldest first; the n_kept values stay valid until the
 * next evaluation. */
const float *slide_network_evaluate(const SlideNetwork *network, const SlideKernel *kernel,
                                    const float *window);

#endif
