/* A network of some family: described in a surrogate file (byte contract:
 * slide_fmu/network/bytes.py), placed, and evaluated by the stream. */
#ifndef SLIDE_NETWORK_H
#define SLIDE_NETWORK_H

#include "families.h"
#include "feature_set.h"

typedef struct SlideFamily SlideFamily;

/* A network in a file, whose bytes have been checked. */
typedef struct {
    const SlideFamily *family;
    uint32_t n_samples, n_values;
    SlideFeaturesView features;
    SlideFamilyView of;
} SlideNetworkView;

typedef struct SlideNetwork {
    const SlideFamily *family;
    uint32_t n_samples, n_values;
    uint32_t memory_length; /* inputs before which the network has forgotten: those it sees, or
                               with cells those of the oldest sample of the output window */
    uint32_t n_block;       /* samples of the outputs that it knows at a time: those that layers
                               give at once, those of the output window of cells */
    uint64_t n_settling;    /* inputs after a restart until the network has seen all it needs */
    SlideFeatures seen;
    float *features; /* scratch [seen.count]: those of the sample seen last */
    SlideFamilyNetwork of;
} SlideNetwork;

/* A step that is done once more, in double precision. */
typedef struct SlideExactRun {
    const double *samples; /* scaled [][n_inputs], newest first: those of the step, and before */
    uint32_t n_taken;      /* samples that the step took in */
    bool anew;             /* it took in the whole window instead, and then */
    uint32_t n_after;      /* so many more */
    bool settled;          /* the sample before counts as held for ever */
    const SlideNetworkState *before; /* else: what was kept before the step */
} SlideExactRun;

/* A family of networks. */
struct SlideFamily {
    uint32_t number; /* in files */

    /* Check what is the family's own in a file, and say how many samples and values there are. */
    void (*read)(SlideNetworkView *view, SlideCursor *cursor);
    bool (*fits)(const SlideNetworkView *view, uint32_t n_in, uint32_t n_out, uint32_t n_outputs);

    /* Place a network: all that is not there yet, also n_block, n_settling, what it sees and the
     * scratch for it. The last n_kept values are the newest sample's. And room for a state. */
    void (*place)(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                  SlideArena *arena);
    void (*place_state)(SlideNetworkState *state, const SlideNetwork *network, SlideArena *arena);

    /* Forget all; the sample whose features are there counts for all before the next. */
    void (*restart)(const SlideNetwork *network, SlideNetworkState *state);

    /* Take in the features of a sample, by its number. May be repeated for the same number. */
    void (*see)(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample);

    /* The values after the sample that was seen, [n_kept] or all; they stay valid until the next
     * evaluation. The state stays as it was until accept. */
    const float *(*evaluate)(const SlideNetwork *network, const SlideKernel *kernel,
                             const SlideNetworkState *state, uint64_t sample);
    void (*accept)(const SlideNetwork *network, SlideNetworkState *state);

    /* The values of all samples [n_block][n_outputs] that the network knows after a sample that was
     * accepted, oldest first; they stay valid until the next evaluation. */
    const float *(*block)(const SlideNetwork *network, const SlideKernel *kernel,
                          const SlideNetworkState *state, uint64_t sample);

    /* Scratch in double precision, and a step in it: the values and their truncation errors, zero
     * unless the family is recurrent [2][n_values]. */
    void (*place_exact)(SlideExact *exact, const SlideNetwork *network, SlideArena *arena);
    const double *(*run_exact)(const SlideNetwork *network, const SlideExact *exact,
                               const SlideExactRun *run);

    /* Of recurrent families, which must evaluate every sample, and measure the influence of those
     * that were forgotten: these truncation errors [n_values]; room for what derivatives need of the
     * state before a step, and keeping it; and a state that lies between others of the same network,
     * each with its weight [count], as they would count with the next sample. NULL of others. */
    const float *(*truncation_errors)(const SlideNetworkState *state);
    void (*place_before)(SlideNetworkState *before, const SlideNetwork *network,
                         SlideArena *arena);
    void (*keep)(const SlideNetwork *network, const SlideNetworkState *state,
                 SlideNetworkState *before);
    void (*blend)(const SlideNetwork *network, const SlideNetworkState *const *states,
                  const double *weights, size_t count, SlideNetworkState *between);
};

bool slide_is_recurrent(const SlideFamily *family);

/* Check a network and describe it. */
void slide_network_read(SlideNetworkView *view, uint32_t n_inputs, SlideCursor *cursor);

/* While the arena measures, the network is not usable. n_kept: as the family's place. */
void slide_network_place(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                         SlideArena *arena);

/* Forget all; the present input, scaled [n_inputs], counts for all before the next, as do those
 * before it [SLIDE_BEFORE][n_inputs], newest first. What is not finite shows when the next is
 * seen. */
void slide_network_restart(const SlideNetwork *network, SlideNetworkState *state,
                           const double *input, const double *before);

/* Look at a sample by its number. False when a feature is not finite; then nothing has changed. */
bool slide_network_see(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample,
                       const double *input, const double *before);

/* The same when the evaluation goes on in any case: features that are not finite show as values
 * that are not numbers, whatever the network does to them. */
void slide_network_see_anyhow(const SlideNetwork *network, SlideNetworkState *state,
                              uint64_t sample, const double *input, const double *before);

#endif
