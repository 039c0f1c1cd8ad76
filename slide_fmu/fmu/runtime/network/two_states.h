/* How the two states of a cell (cells.h) give values and follow each other: in single precision a
 * part of cells.c, in double precision one of cells_exact.c. Who includes this says before what
 * numbers are, Real, and what State is, SlideCellState or SlideExactCells. */
#ifndef SLIDE_TWO_STATES_H
#define SLIDE_TWO_STATES_H

#include "network.h"

#include <string.h>

static size_t n_of_state(const SlideNetwork *network) {
    return network->of.cells.cell.state_panels * SLIDE_LANES;
}

/* The age of the younger state after the next input, when so many were taken in. */
static uint32_t age_after(const SlideNetwork *network, uint64_t taken) {
    return (uint32_t)(taken % network->n_samples) + 1;
}

/* The weight of the younger state in the values: it grows while the output window is passed. */
static Real weight_at(const SlideNetwork *network, uint32_t age) {
    const uint32_t n_truncated = network->n_samples - network->n_block;
    return age <= n_truncated ? 0 : (Real)(age - n_truncated) / (Real)network->n_block;
}

/* A value from its rows: the first counts once, the others times their factors. */
static Real value_of(const SlideCells *cells, const Real *factors, const Real *rows) {
    Real value = rows[0];
    for (size_t i = 0; i < cells->n_factors; ++i) {
        value += factors[i] * rows[1 + i];
    }
    return value;
}

/* The values after the next input, when so many were taken in, and what the younger state changes
 * in them. Each value has a term of every state, so states that are not finite show there. */
static void mix(const SlideNetwork *network, uint64_t taken, const Real *factors, const Real *rows,
                Real *values, Real *faded) {
    const SlideCells *cells = &network->of.cells;
    const Real *younger = rows + cells->cell.row_panels * SLIDE_LANES;
    const Real weight = weight_at(network, age_after(network, taken));
    for (size_t i = 0; i < network->n_values; ++i) {
        size_t row = i * (1 + cells->n_factors);
        Real value = value_of(cells, factors, rows + row);
        faded[i] = weight * (value_of(cells, factors, younger + row) - value);
        values[i] = value + faded[i];
    }
}

/* Accept the states after the next input. The first time that the younger one becomes the older,
 * both are the same: nothing is measured. */
static void move_on(const SlideNetwork *network, const State *state, const Real *next,
                    const Real *faded) {
    const size_t n = n_of_state(network), n_values = network->n_values;
    const bool last = age_after(network, *state->taken) == network->n_samples;
    for (size_t i = 0; i < n_values; ++i) {
        const Real change = faded[i] < 0 ? -faded[i] : faded[i];
        state->largest[i] = change > state->largest[i] ? change : state->largest[i];
    }
    memcpy(state->states, next + (last ? n : 0), n * sizeof(Real));
    memcpy(state->states + n, next + n, n * sizeof(Real));
    if (last) {
        memset(state->states + n, 0, n * sizeof(Real));
        if (*state->taken >= network->n_samples) {
            memcpy(state->errors, state->largest, n_values * sizeof(Real));
        }
        memset(state->largest, 0, n_values * sizeof(Real));
    }
    *state->taken += 1;
}

/* Both states to zero; the truncation error stays. n_samples inputs later the exact window is
 * evaluated, 2 n_samples inputs later the truncation error is measured. */
static void start_anew(const SlideNetwork *network, const State *state) {
    *state->taken = 0;
    memset(state->states, 0, 2 * n_of_state(network) * sizeof(Real));
    memset(state->largest, 0, network->n_values * sizeof(Real));
}

#endif
