/* Motion of a serial chain and its loads on the base (slide_fmu/serial_chain.py). */
#ifndef SLIDE_CHAIN_H
#define SLIDE_CHAIN_H

#include "arena.h"
#include "features_view.h"

/* Signals of a chain: their places, those of joint rates after the tool's position. */
enum {
    SLIDE_WRENCH = 0,
    SLIDE_WRENCH_CHANGE = 6,
    SLIDE_POSITION = 12,
    SLIDE_RATES = 15 /* n_joints; then as below, with n_joints added */
};
enum {
    SLIDE_FRAME = 15,
    SLIDE_TURNED_WRENCH_CHANGE = 17,
    SLIDE_TURNED_INERTIA = 23,
    SLIDE_TURNED_MOMENTUM = 32,
    SLIDE_CHAIN_SIGNALS = 38
};

/* One joint and the link that it moves: standard Denavit-Hartenberg. */
typedef struct {
    double middle, half_range; /* rad; of the scaled input */
    double a, d;               /* m */
    double cos_alpha, sin_alpha;
    double mass;               /* kg */
    double centre[3];          /* m, in link axes */
    double inertia[9];         /* kg m^2 about the centre, by rows, in link axes */
} SlideLink;

typedef struct {
    size_t n_joints;
    double step; /* s */
    double gravity[3], tool[3];
    SlideLink *links;
    bool wrench, inertia, momentum; /* parts that are needed */
} SlideChain;

void slide_chain_place(SlideChain *chain, const SlideFeaturesView *view, SlideArena *arena);

/* Note that a signal is needed. */
void slide_chain_need(SlideChain *chain, size_t signal);

/* Write the signals that are needed. Inputs: scaled, the newest and the three before it, each
 * [n_joints]. */
void slide_chain_write(const SlideChain *chain, const double *const inputs[4], double *signals);

#endif
