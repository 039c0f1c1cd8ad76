/* The state before the first of some samples, of which outputs are known: that which explains them best,
 * by least squares. The same is done in slide_fmu/network/state_space/initial_state.py. */
#ifndef SLIDE_FIRST_STATE_H
#define SLIDE_FIRST_STATE_H

#include "families.h"

struct SlideNetwork;

/* Samples, and what is known of the outputs after them. */
typedef struct {
    const double *samples; /* scaled [count + SLIDE_BEFORE][n_inputs], newest first */
    const double *values;  /* scaled [count][n_values], oldest first; NaN: not known */
    uint64_t count;
} SlideKnownOutputs;

/* A state, and the problem around it. */
typedef struct {
    double *state;    /* [n_states] */
    double *matrix;   /* [n_states][n_states], lower half: slopes of the errors, squared */
    double *gradient; /* [n_states], half of that of the cost */
    double cost;      /* sum of squared errors */
} SlideStatePoint;

/* Room to find a state; scratch. */
typedef struct {
    SlideExactCells exact;
    SlideStatePoint now, next;
    double *sides;  /* [n_states + 1][2][state panels][SLIDE_LANES], states moved to both sides by each of
                       their numbers, and last the state itself */
    double *slopes; /* [n_states + 1][n_values], of the errors after a sample, and last the errors */
    double *factors; /* [n_states][n_states] */
    double *step;    /* [n_states] */
} SlideFirstState;

/* Of state-space networks (cells_exact.c). */
void slide_first_state_place(SlideFirstState *first, const struct SlideNetwork *network,
                             SlideArena *arena);

/* Find the state before the oldest sample: the network has it then, of so many samples that come before
 * its younger state starts from zero. False where it is not finite. */
bool slide_first_state_find(const struct SlideNetwork *network, const SlideFirstState *first,
                            const SlideKnownOutputs *known, uint64_t n_before,
                            SlideNetworkState *state);

#endif
