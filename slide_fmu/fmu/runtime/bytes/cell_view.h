/* Reader of a state-space network in a surrogate file; byte contract:
 * slide_fmu/network/bytes.py. */
#ifndef SLIDE_CELL_VIEW_H
#define SLIDE_CELL_VIEW_H

#include "reading.h"

/* Units of a cell. */
typedef enum { SLIDE_TANH = 3, SLIDE_CUBIC = 5, SLIDE_GATED = 6 } SlideUnits;

/* What features are for (features.Roles): indices of those chosen. */
typedef struct {
    SlideIndices drive, statics, gated, schedule, readout, turn;
} SlideRoles;

/* All pointers point into the bytes that were read; their extent has been checked. */
typedef struct {
    uint32_t n_samples, n_out, n_states, n_units, n_values;
    uint32_t units;  /* SlideUnits */
    uint32_t turned; /* pairs of states */
    SlideRoles roles;
    uint64_t n_rows;                  /* n_values * (1 + factors) */
    const unsigned char *a, *b, *e;   /* f32 [n_states][n_states], [drive], [n_units] */
    const unsigned char *w;           /* f32 [n_units][n_states + drive + 1]; of gated units
                                         [n_units][schedule + 1] */
    const unsigned char *v;           /* f32 [n_units][n_states + gated] of gated units */
    const unsigned char *c, *d, *d0;  /* f32 [n_rows][n_states], [static], [] */
} SlideCellView;

void slide_cell_read(SlideCellView *cell, uint32_t n_features, SlideCursor *cursor);

#endif
