/* A state-space network in the layout of the kernels, and its two states (ping-pong): the older
 * has seen n_samples to 2 n_samples inputs; when the younger has seen n_samples, it becomes the
 * older and a new one starts from zero. See slide_fmu/network/state_space/. */
#ifndef SLIDE_CELLS_H
#define SLIDE_CELLS_H

#include "cell_layout.h"

/* The features of its network come in the order [readout, turn, gated, schedule, drive, statics],
 * the last ones only where they are not those of the drive. */
typedef struct {
    SlideCell cell;
    SlideTerms terms; /* of its weights, where they follow parameters */
    size_t n_factors;  /* of the values, beside the constant one */
    float *next;       /* scratch: the states after an input, before they are accepted */
    float *both;       /* scratch: rows of both states, those of a value together */
    float *newest;     /* scratch [n_values]: the values of the network */
    float *faded;      /* scratch [n_values]: what the younger state changes in them */
    uint64_t n_recent; /* places for n_block samples, and for those that may be taken back; a power of
                          two */
    float *block;      /* scratch [n_block][n_values] */
} SlideCells;

/* All that changes; part of the flat state block. */
typedef struct {
    uint64_t *taken; /* inputs since both states were zero; the younger's age is its rest by
                        n_samples */
    float *states;   /* [2][state panels][SLIDE_LANES], older first */
    float *errors;   /* [n_values], scaled: the truncation error, up to the last hand-over */
    float *largest;  /* [n_values], scaled: the same since then, not known before the next */
    float *recent;   /* [n_recent][n_values], the values after the inputs taken in last; those after
                        input k in place k % n_recent; not kept before a step */
} SlideCellState;

/* The same in double precision, and what is needed to take in an input; all scratch. */
typedef struct {
    uint64_t *taken;
    double *states, *errors, *largest;
    SlideCell cell;   /* with scratch of its own */
    double *next;     /* as states */
    double *rows;     /* [2][row panels][SLIDE_LANES] */
    double *features; /* [seen.count] */
    double *faded;    /* [n_values] */
    double *values;   /* [2][n_values]: values, and truncation errors */
} SlideExactCells;

/* The family; see network.h. */
extern const struct SlideFamily slide_state_space_family;
struct SlideNetwork;

/* The family's place_exact and run_exact (cells_exact.c). */
union SlideExact;
struct SlideExactRun;
void slide_cells_exact_place(union SlideExact *exact, const struct SlideNetwork *network,
                             SlideArena *arena);
const double *slide_cells_exact_run(const struct SlideNetwork *network,
                                    const union SlideExact *exact,
                                    const struct SlideExactRun *run);

#endif
