#include "exact.h"
#include "network.h"

typedef double Real;
#if defined(SLIDE_SCALAR)
typedef double Lanes;
enum { PARTS = SLIDE_LANES };
#define WEIGHTS(at, i) ((double)(at)[i])
#else
typedef double Lanes __attribute__((vector_size(64), aligned(8), may_alias));
typedef float SingleLanes __attribute__((vector_size(32), aligned(4), may_alias));
enum { PARTS = 1 };
#define WEIGHTS(at, i) __builtin_convertvector(((const SingleLanes *)(at))[i], Lanes)
#endif

static void activate(uint32_t activation, double *x, size_t count) {
    slide_activate_exact(activation, x, count);
}

static void tanh_each(double *x, size_t count) { slide_activate_exact(SLIDE_TANH, x, count); }

#include "cell_equation.h"
typedef SlideExactCells State;
#include "two_states.h"

void slide_cells_exact_place(SlideExact *scratch, const SlideNetwork *network,
                             SlideArena *arena) {
    const SlideCell *cell = &network->of.cells.cell;
    const size_t n = 2 * n_of_state(network), row = SLIDE_LANES * sizeof(double);
    SlideExactCells *exact = &scratch->cells;
    exact->cell = *cell;
    slide_cell_place_scratch(&exact->cell, sizeof(double), arena);
    exact->taken = slide_place(arena, 1, sizeof *exact->taken);
    exact->states = slide_place(arena, n, sizeof(double));
    exact->next = slide_place(arena, n, sizeof(double));
    exact->rows = slide_place(arena, 2 * cell->row_panels, row);
    exact->features = slide_place(arena, network->seen.count, sizeof(double));
    exact->largest = slide_place(arena, network->n_values, sizeof(double));
    exact->faded = slide_place(arena, network->n_values, sizeof(double));
    exact->values = slide_place(arena, 2 * (size_t)network->n_values, sizeof(double));
    exact->errors = arena->base == NULL ? NULL : exact->values + network->n_values;
}

static void widen(const float *x, size_t count, double *y) {
    for (size_t i = 0; i < count; ++i) {
        y[i] = x[i];
    }
}

/* From what was kept before a step, or from zero where before is NULL. */
static void start(const SlideNetwork *network, const State *exact, const SlideCellState *before) {
    start_anew(network, exact);
    memset(exact->errors, 0, network->n_values * sizeof(double));
    if (before != NULL) {
        *exact->taken = *before->taken;
        widen(before->states, 2 * n_of_state(network), exact->states);
        widen(before->errors, network->n_values, exact->errors);
        widen(before->largest, network->n_values, exact->largest);
    }
}

/* Take in an input as cells do; with those before it, newest first. */
static void take(const SlideNetwork *network, const State *exact, const double *sample) {
    const size_t n_factors = network->of.cells.n_factors;
    slide_features_exact(&network->seen, sample, sample + network->seen.n_inputs,
                         exact->features);
    advance(&exact->cell, exact->features + n_factors, exact->states, exact->next, exact->rows);
    mix(network, *exact->taken, exact->features, exact->rows, exact->values, exact->faded);
    move_on(network, exact, exact->next, exact->faded);
}

/* From what was before the step; or from zero, over the same sample until that is forgotten, or
 * over the whole window and what came after it. */
const double *slide_cells_exact_run(const SlideNetwork *network, const SlideExact *scratch,
                                    const SlideExactRun *run) {
    const State *exact = &scratch->cells;
    const size_t n_inputs = network->seen.n_inputs;
    const uint32_t n_taken = run->anew ? network->n_samples + run->n_after : run->n_taken;
    const bool settles = run->settled && !run->anew;
    start(network, exact, run->settled || run->anew ? NULL : &run->before->cells);
    for (uint64_t left = settles ? network->n_settling : 0; left > 0; --left) {
        take(network, exact, run->samples + n_taken * n_inputs);
    }
    for (uint32_t age = n_taken; age-- > 0;) {
        take(network, exact, run->samples + age * n_inputs);
    }
    return exact->values;
}
