/* In place of cells_exact.c in a page, which has no call for derivatives: nothing is placed, and
 * nothing runs in double precision. */
#include "exact.h"
#include "network.h"

void slide_cells_exact_place(SlideExact *scratch, const SlideNetwork *network,
                             SlideArena *arena) {
    (void)scratch;
    (void)network;
    (void)arena;
}

const double *slide_cells_exact_run(const SlideNetwork *network, const SlideExact *scratch,
                                    const SlideExactRun *run) {
    (void)network;
    (void)scratch;
    (void)run;
    __builtin_trap();
}
