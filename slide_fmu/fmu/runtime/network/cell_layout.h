/* The weights of a cell in the layout of the kernels: panels of SLIDE_LANES rows. */
#ifndef SLIDE_CELL_LAYOUT_H
#define SLIDE_CELL_LAYOUT_H

#include "arena.h"
#include "cell_view.h"
#include "kernel.h"

size_t slide_panels_for(size_t rows);
float *slide_place_panels(size_t n_panels, size_t n_columns, SlideArena *arena);

/* Is the static part that of the drive? */
bool slide_statics_are_drive(const SlideRoles *roles);

/* Place the weights of a cell whose units are not gated, or are; and room for its scratch. */
void slide_cell_place(SlideCell *cell, const SlideCellView *view, SlideArena *arena);
void slide_gated_cell_place(SlideGatedCell *cell, const SlideCellView *view, SlideArena *arena);

#endif
