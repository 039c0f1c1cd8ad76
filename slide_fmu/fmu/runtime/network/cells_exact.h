/* Cells in double precision, for derivatives: place_exact and run_exact of their family. */
#ifndef SLIDE_CELLS_EXACT_H
#define SLIDE_CELLS_EXACT_H

#include "network.h"

void slide_cells_exact_place(SlideExact *exact, const SlideNetwork *network, SlideArena *arena);
const double *slide_cells_exact_run(const SlideNetwork *network, const SlideExact *exact,
                                    const SlideExactRun *run);

#endif
