#include "exact.h"
#include "first_state.h"
#include "network.h"

#include <math.h>

typedef double Real;
#if defined(SLIDE_SCALAR)
typedef double Lanes;
enum { PARTS = SLIDE_LANES };
#define WEIGHTS(at, i) ((double)(at)[i])
#else
typedef double Lanes __attribute__((vector_size(16), aligned(8), may_alias));
typedef float SingleLanes __attribute__((vector_size(8), aligned(4), may_alias));
enum { PARTS = SLIDE_LANES / 2 };
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

/* From two states to the next, by the features of a sample; in one place, since it is large. */
SLIDE_CALLED void go_on(const SlideNetwork *network, const State *exact, const double *states) {
    advance(&exact->cell, exact->features + network->of.cells.n_factors, states, exact->next,
            exact->rows);
}

/* Take in an input as cells do; with those before it, newest first. */
static void take(const SlideNetwork *network, const State *exact, const double *sample) {
    slide_features_exact(&network->seen, sample, sample + network->seen.n_inputs,
                         exact->features);
    go_on(network, exact, exact->states);
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

/* Of the search for a first state, as in initial_state.py: steps to both sides for slopes, in units of
 * the states; errors that count as if the network diverged; the error as which a state of size 1
 * counts. */
static const double CHANGE = 1e-3, LARGEST_ERROR = 1e6, UNSEEN = 1e-3;

/* Of the search here: it ends where states change by less than this, or after so many runs. */
static const double CHANGES_LITTLE = 1e-12;
enum { MOST_RUNS = 50 };

static void place_point(SlideStatePoint *point, size_t n, SlideArena *arena) {
    point->state = slide_place(arena, n, sizeof(double));
    point->matrix = slide_place(arena, n * n, sizeof(double));
    point->gradient = slide_place(arena, n, sizeof(double));
}

void slide_first_state_place(SlideFirstState *first, const SlideNetwork *network,
                             SlideArena *arena) {
    const size_t n = network->of.cells.cell.n_states;
    SlideExact exact;
    slide_cells_exact_place(&exact, network, arena);
    first->exact = exact.cells;
    place_point(&first->now, n, arena);
    place_point(&first->next, n, arena);
    first->sides = slide_place(arena, n + 1, 2 * n_of_state(network) * sizeof(double));
    first->slopes = slide_place(arena, n + 1, network->n_values * sizeof(double));
    first->factors = slide_place(arena, n * n, sizeof(double));
    first->step = slide_place(arena, n, sizeof(double));
}

static double clipped(double error) {
    return isnan(error) ? LARGEST_ERROR : fmin(fmax(error, -LARGEST_ERROR), LARGEST_ERROR);
}

/* States at both sides of one; the last is itself. */
SLIDE_CALLED void put_sides(const SlideFirstState *first, const double *state, size_t n, size_t size) {
    for (size_t i = 0; i <= n; ++i) {
        double *side = first->sides + 2 * i * size;
        memset(side, 0, 2 * size * sizeof *side);
        memcpy(side, state, n * sizeof *side);
        memcpy(side + size, state, n * sizeof *side);
        if (i < n) {
            side[i] += CHANGE;
            side[size + i] -= CHANGE;
        }
    }
}

/* All sides go on by a sample; known: the outputs after it, [n_values]. Slopes of the errors, and the
 * errors, NaN where they are not known. */
SLIDE_CALLED void take_sides(const SlideNetwork *network, const SlideFirstState *first,
                       const double *sample, const double *known) {
    const SlideCells *cells = &network->of.cells;
    const SlideExactCells *exact = &first->exact;
    const size_t n = cells->cell.n_states, n_values = network->n_values;
    slide_features_exact(&network->seen, sample, sample + network->seen.n_inputs,
                         exact->features);
    for (size_t i = 0; i <= n; ++i) {
        double *side = first->sides + 2 * i * n_of_state(network);
        go_on(network, exact, side);
        memcpy(side, exact->next, 2 * n_of_state(network) * sizeof *side);
        for (size_t k = 0; k < n_values; ++k) {
            const double *rows = exact->rows + k * (1 + cells->n_factors);
            const double *others = rows + cells->cell.row_panels * SLIDE_LANES;
            const double there = value_of(cells, exact->features, rows) - known[k];
            const double back = value_of(cells, exact->features, others) - known[k];
            first->slopes[i * n_values + k] =
                isnan(known[k]) ? NAN
                : i == n        ? clipped(there)
                                : (clipped(there) - clipped(back)) / (2 * CHANGE);
        }
    }
}

/* What the errors after a sample give to the problem. */
static void add_errors(const SlideFirstState *first, SlideStatePoint *point, size_t n,
                       size_t n_values) {
    const double *errors = first->slopes + n * n_values;
    for (size_t k = 0; k < n_values; ++k) {
        for (size_t i = 0; !isnan(errors[k]) && i < n; ++i) {
            const double slope = first->slopes[i * n_values + k];
            for (size_t j = 0; j <= i; ++j) {
                point->matrix[i * n + j] += slope * first->slopes[j * n_values + k];
            }
            point->gradient[i] += slope * errors[k];
        }
        point->cost += isnan(errors[k]) ? 0 : errors[k] * errors[k];
    }
}

/* The problem around the state of a point. */
SLIDE_CALLED void look_around(const SlideNetwork *network, const SlideFirstState *first,
                        const SlideKnownOutputs *known, SlideStatePoint *point) {
    const size_t n = network->of.cells.cell.n_states, n_inputs = network->seen.n_inputs;
    memset(point->matrix, 0, n * n * sizeof *point->matrix);
    point->cost = 0;
    for (size_t i = 0; i < n; ++i) {
        point->matrix[i * n + i] = UNSEEN * UNSEEN;
        point->gradient[i] = UNSEEN * UNSEEN * point->state[i];
        point->cost += UNSEEN * UNSEEN * point->state[i] * point->state[i];
    }
    put_sides(first, point->state, n, n_of_state(network));
    for (uint64_t age = known->count, row = 0; age-- > 0; ++row) {
        take_sides(network, first, known->samples + (size_t)age * n_inputs,
                   known->values + (size_t)row * network->n_values);
        add_errors(first, point, n, network->n_values);
    }
}

/* The step from a point to the least cost of its linear problem, by Cholesky's factors; shorter by
 * damping. The largest of its numbers; NaN where there is none. */
static double step_from(const SlideFirstState *first, const SlideStatePoint *point, size_t n,
                        double damping) {
    double *factors = first->factors, *step = first->step, largest = 0;
    for (size_t i = 0; i < n; ++i) {
        step[i] = -point->gradient[i];
        for (size_t j = 0; j <= i; ++j) {
            double sum = point->matrix[i * n + j] + (i == j ? damping : 0);
            for (size_t k = 0; k < j; ++k) {
                sum -= factors[i * n + k] * factors[j * n + k];
            }
            factors[i * n + j] = i == j ? sqrt(sum) : sum / factors[j * n + j];
        }
        for (size_t k = 0; k < i; ++k) {
            step[i] -= factors[i * n + k] * step[k];
        }
        step[i] /= factors[i * n + i];
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t k = i + 1; k < n; ++k) {
            step[i] -= factors[k * n + i] * step[k];
        }
        step[i] /= factors[i * n + i];
        largest = isnan(step[i]) ? NAN : fmax(largest, fabs(step[i]));
    }
    return largest;
}

/* Levenberg and Marquardt's search from zero; the problem is nearly linear, so a few steps are enough. */
static const double *search(const SlideNetwork *network, const SlideFirstState *first,
                            const SlideKnownOutputs *known) {
    const size_t n = network->of.cells.cell.n_states;
    SlideStatePoint now = first->now, next = first->next;
    double damping = 1e-4, largest = INFINITY;
    memset(now.state, 0, n * sizeof *now.state);
    look_around(network, first, known, &now);
    for (int run = 1; run < MOST_RUNS && !(largest <= CHANGES_LITTLE); ++run) {
        largest = step_from(first, &now, n, damping);
        for (size_t i = 0; i < n; ++i) {
            next.state[i] = now.state[i] + first->step[i];
        }
        look_around(network, first, known, &next);
        if (next.cost <= now.cost * (1 + CHANGES_LITTLE)) {
            const SlideStatePoint former = now;
            now = next, next = former;
            damping *= 1e-3;
        } else {
            damping = 10 * fmax(damping, 1e-9);
            largest = largest <= CHANGES_LITTLE ? largest : INFINITY;
        }
    }
    return now.state;
}

/* Older samples have the values after the first one. */
static void show_first(const SlideNetwork *network, const SlideFirstState *first,
                       const SlideKnownOutputs *known, const SlideCellState *state) {
    const SlideCells *cells = &network->of.cells;
    const size_t n_values = network->n_values;
    const double *oldest = known->samples + (size_t)(known->count - 1) * network->seen.n_inputs;
    take_sides(network, first, oldest, known->values);
    for (size_t k = 0; k < n_values; ++k) {
        const double *rows = first->exact.rows + k * (1 + cells->n_factors);
        const float value = (float)value_of(cells, first->exact.features, rows);
        for (uint64_t place = 0; place < cells->n_recent; ++place) {
            state->recent[place * n_values + k] = value;
        }
    }
}

bool slide_first_state_find(const SlideNetwork *network, const SlideFirstState *first,
                            const SlideKnownOutputs *known, uint64_t n_before,
                            SlideNetworkState *of_network) {
    const size_t n = network->of.cells.cell.n_states, size = n_of_state(network);
    const SlideCellState *state = &of_network->cells;
    const double *found = search(network, first, known);
    bool finite = true;
    for (size_t i = 0; i < n; ++i) { /* both are the same until the younger one starts from zero */
        state->states[i] = state->states[size + i] = (float)found[i];
        finite = finite && isfinite(state->states[i]);
    }
    *state->taken = network->n_samples - n_before;
    put_sides(first, found, n, size);
    show_first(network, first, known, state);
    return finite;
}
