/* A cell in a surrogate file (byte contract: slide_fmu/network/state_space/bytes.py), and its
 * weights in the layout of the kernels: panels of SLIDE_LANES rows. */
#ifndef SLIDE_CELL_LAYOUT_H
#define SLIDE_CELL_LAYOUT_H

#include "kernel.h"
#include "parameters.h"

/* What features are for (features.Roles): indices of those chosen. */
typedef struct {
    SlideIndices drive, statics, gated, schedule, readout, turn;
} SlideRoles;

/* All pointers point into the bytes that were read; their extent has been checked. */
typedef struct {
    uint32_t n_samples, n_out, n_states, n_units, n_values;
    uint32_t units;  /* SlideUnits */
    uint32_t substeps;
    uint32_t turned; /* pairs of states */
    SlideRoles roles;
    uint64_t n_rows;                  /* n_values * (1 + factors) */
    uint64_t n_weights;               /* of all matrices */
    const unsigned char *a, *b, *e;   /* f32 [n_states][n_states], [drive], [n_units] */
    const unsigned char *w;           /* f32 [n_units][n_states + drive + 1]; of gated units
                                         [n_units][schedule + 1] */
    const unsigned char *v;           /* f32 [n_units][n_states + gated] of gated units */
    const unsigned char *c, *d, *d0;  /* f32 [n_rows][n_states], [static], [] */
    SlideParametersView parameters;   /* that the weights follow; the matrices are then those of
                                         the constant term */
} SlideCellView;

/* Check a cell on so many features of a sample, and describe it. */
void slide_cell_read(SlideCellView *cell, uint32_t n_features, SlideCursor *cursor);

size_t slide_panels_for(size_t rows);
float *slide_place_panels(size_t n_panels, size_t n_columns, SlideArena *arena);

/* Is the static part that of the drive? */
bool slide_statics_are_drive(const SlideRoles *roles);

/* Place the weights of a cell, and of the terms of its parameters. Its features come in the order
 * [turn, gated, schedule, drive, statics], the last ones only where they are not those of the
 * drive. And room for its scratch. */
void slide_cell_place(SlideCell *cell, SlideTerms *terms, const SlideCellView *view,
                      SlideArena *arena);

/* Room for the scratch of a cell whose numbers have so many bytes. */
void slide_cell_place_scratch(SlideCell *cell, size_t number, SlideArena *arena);

#endif
