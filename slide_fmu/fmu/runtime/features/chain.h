/* Motion of a serial chain and its loads on the base (slide_fmu/features/serial_chain.py). */
#ifndef SLIDE_CHAIN_H
#define SLIDE_CHAIN_H

#include "angle.h"
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
    double middle, half_range;  /* rad; of the scaled input, and of the sum of two of them */
    double rate, acceleration;  /* rad/s, rad/s^2; of changes of the scaled input */
    double a, d;                /* m */
    double cos_alpha, sin_alpha;
    /* Of the link, and of the masses further out as if they were in the origin of its frame; seen
     * from the frame before it, turned with the joint. */
    double first[3];            /* kg m; moment of mass */
    double square[3], mixed[3]; /* kg m^2; integrals of xx, yy, zz and of yz, xz, xy */
    double skew[3];             /* kg m^2; axis of the part of the inertia that is skew, if any */
} SlideLink;

/* A joint at the end and at the begin of the step. */
typedef struct {
    SlideCosineSine turned;
    SlideTwo rate, acceleration;
} SlideJoint;

typedef struct SlideChain {
    void (*write)(const struct SlideChain *chain, const double *const inputs[4], double *signals);
    size_t n_joints;
    double mass, gravity[3];
    double tool[3]; /* in the last link's frame */
    SlideLink *links;
    SlideTwo *sectors;  /* of angle.h */
    SlideJoint *joints; /* scratch */
    bool skew;          /* some inertia is not symmetric */
} SlideChain;

void slide_chain_place(SlideChain *chain, const SlideFeaturesView *view, SlideArena *arena);

/* Write all signals. Inputs: scaled, the newest and the three before it, each [n_joints]. */
void slide_chain_write(const SlideChain *chain, const double *const inputs[4], double *signals);

#endif
