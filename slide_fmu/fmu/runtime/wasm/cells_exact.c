/* In place of cells_exact.c in a page, which has no call for derivatives, nor for known outputs: nothing
 * is placed, and nothing runs in double precision. */
#include "exact.h"
#include "first_state.h"
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

void slide_first_state_place(SlideFirstState *first, const SlideNetwork *network,
                             SlideArena *arena) {
    (void)first;
    (void)network;
    (void)arena;
}

bool slide_first_state_find(const SlideNetwork *network, const SlideFirstState *first,
                            const SlideKnownOutputs *known, uint64_t n_before,
                            SlideNetworkState *state) {
    (void)network;
    (void)first;
    (void)known;
    (void)n_before;
    (void)state;
    __builtin_trap();
}
