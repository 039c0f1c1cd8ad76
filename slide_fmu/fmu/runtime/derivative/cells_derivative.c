#include "cells_derivative.h"

#include "activation_slope.h"

#include <string.h>

static size_t n_units(const SlideCells *cells) {
    return SLIDE_LANES * (cells->is_gated ? cells->gated.unit_panels : cells->cell.unit_panels);
}

static size_t n_states(const SlideCells *cells) { return SLIDE_LANES * cells->state_panels; }

static size_t n_rows(const SlideCells *cells) { return SLIDE_LANES * cells->row_panels; }

void slide_cells_derivative_place(SlideCellsDerivative *derivative, const SlideCells *cells,
                                  SlideArena *arena) {
    const size_t dual = sizeof(SlideDual), units = n_units(cells), states = n_states(cells);
    derivative->taken = slide_place(arena, 1, sizeof *derivative->taken);
    derivative->states = slide_place(arena, 2 * states, dual);
    derivative->next = slide_place(arena, 2 * states, dual);
    derivative->seen = slide_place(arena, states, dual);
    derivative->pushed = slide_place(arena, states, dual);
    derivative->units = slide_place(arena, units, dual);
    derivative->shared = slide_place(arena, units + states + n_rows(cells), dual);
    derivative->gates = slide_place(arena, units, dual);
    derivative->rows = slide_place(arena, 2 * n_rows(cells), dual);
    derivative->features = slide_place(arena, cells->seen.count + 1, dual);
    derivative->slopes = slide_place(arena, cells->seen.count, sizeof(double));
    derivative->values = slide_place(arena, cells->n_values, sizeof(double));
}

void slide_cells_derivative_start(const SlideCells *cells, const SlideCellsDerivative *derivative,
                                  const float *states, uint64_t taken) {
    *derivative->taken = taken;
    for (size_t i = 0; i < 2 * n_states(cells); ++i) {
        derivative->states[i] = (SlideDual){states == NULL ? 0 : states[i], 0};
    }
}

/* y += weights x, in panels of SLIDE_LANES. */
static void add_product(const float *weights, const SlideDual *x, size_t n_in, size_t n_panels,
                        SlideDual *y) {
    for (size_t panel = 0; panel < n_panels; ++panel, y += SLIDE_LANES) {
        for (size_t i = 0; i < n_in; ++i, weights += SLIDE_LANES) {
            for (size_t lane = 0; lane < SLIDE_LANES; ++lane) {
                y[lane].value += weights[lane] * x[i].value;
                y[lane].slope += weights[lane] * x[i].slope;
            }
        }
    }
}

static void clear(SlideDual *x, size_t count) { memset(x, 0, count * sizeof *x); }

static void add(SlideDual *y, const SlideDual *x, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        y[i] = slide_plus(y[i], x[i]);
    }
}

static void add_floats(SlideDual *y, const float *x, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        y[i].value += x[i];
    }
}

/* Each slope becomes that of the activation, and then each value. */
static void activate(uint32_t activation, SlideDual *x, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        double z = x[i].value;
        x[i].slope *= slide_activation_slope(activation, z);
        x[i].value = activation == SLIDE_TANH ? tanh(z) : z * z * z;
    }
}

/* Turn the first pairs of a state by an angle with cosine c and sine s. */
static void turn_pairs(SlideDual *state, size_t pairs, SlideDual c, SlideDual s) {
    for (size_t i = 0; i < pairs; ++i) {
        SlideDual x = state[2 * i], y = state[2 * i + 1];
        state[2 * i] = slide_minus(slide_times(c, x), slide_times(s, y));
        state[2 * i + 1] = slide_plus(slide_times(s, x), slide_times(c, y));
    }
}

/* A plain cell: what both states share, then each state by itself. */
static void share(const SlideCell *cell, const SlideCellsDerivative *derivative,
                  const SlideDual *features) {
    size_t panels = cell->unit_panels + cell->state_panels + cell->row_panels;
    clear(derivative->shared, panels * SLIDE_LANES);
    add_product(cell->from_features, features, cell->n_features + 1, panels, derivative->shared);
}

static void advance(const SlideCell *cell, const SlideCellsDerivative *derivative,
                    const SlideDual *x, SlideDual *next, SlideDual *rows) {
    const size_t units = cell->unit_panels * SLIDE_LANES, n = cell->state_panels * SLIDE_LANES;
    const SlideDual *shared = derivative->shared;
    memcpy(derivative->units, shared, units * sizeof *shared);
    add_product(cell->from_states, x, cell->n_states, cell->unit_panels, derivative->units);
    activate(cell->activation, derivative->units, units);
    memcpy(next, shared + units, n * sizeof *shared);
    add_product(cell->from_states + units * cell->n_states, x, cell->n_states, cell->state_panels,
                next);
    add_product(cell->from_units, derivative->units, units, cell->state_panels, next);
    memcpy(rows, shared + units + n, cell->row_panels * SLIDE_LANES * sizeof *shared);
    add_product(cell->to_rows, next, cell->n_states, cell->row_panels, rows);
}

/* The same with gated units. */
static void share_gated(const SlideGatedCell *cell, const SlideCellsDerivative *derivative,
                        const SlideDual *gated) {
    const SlideDual *schedule = gated + cell->n_gated, *drive = schedule + cell->n_schedule;
    const size_t units = cell->unit_panels * SLIDE_LANES, n = cell->state_panels * SLIDE_LANES;
    const size_t rows = cell->row_panels * SLIDE_LANES;
    SlideDual *offered = derivative->shared, *driven = offered + units, *of_rows = driven + n;
    clear(derivative->gates, units);
    add_product(cell->gates, schedule, cell->n_schedule, cell->unit_panels, derivative->gates);
    add_floats(derivative->gates, cell->gates_start, units);
    activate(SLIDE_TANH, derivative->gates, units);
    clear(offered, units + n + rows);
    add_product(cell->from_gated, gated, cell->n_gated, cell->unit_panels, offered);
    add_product(cell->from_drive, drive, cell->n_drive, cell->state_panels, driven);
    add_product(cell->from_static, drive + cell->n_drive, cell->n_static, cell->row_panels,
                of_rows);
    add_floats(of_rows, cell->rows_start, rows);
}

static void advance_gated(const SlideGatedCell *cell, const SlideCellsDerivative *derivative,
                          const SlideDual *turn, const SlideDual *x, SlideDual *next,
                          SlideDual *rows) {
    const size_t units = cell->unit_panels * SLIDE_LANES, n = cell->state_panels * SLIDE_LANES;
    const SlideDual *offered = derivative->shared, *driven = offered + units;
    memcpy(derivative->seen, x, n * sizeof *x);
    memcpy(derivative->units, offered, units * sizeof *x);
    if (cell->turned > 0) {
        SlideDual back = {-turn[1].value, -turn[1].slope};
        turn_pairs(derivative->seen, cell->turned, turn[0], back);
    }
    add_product(cell->products, derivative->seen, cell->n_states, cell->unit_panels,
                derivative->units);
    for (size_t i = 0; i < units; ++i) {
        derivative->units[i] = slide_times(derivative->units[i], derivative->gates[i]);
    }
    clear(derivative->pushed, n);
    add_product(cell->from_units, derivative->units, units, cell->state_panels,
                derivative->pushed);
    if (cell->turned > 0) {
        turn_pairs(derivative->pushed, cell->turned, turn[0], turn[1]);
    }
    memcpy(next, driven, n * sizeof *x);
    add(next, derivative->pushed, n);
    add_product(cell->from_states, x, cell->n_states, cell->state_panels, next);
    memcpy(rows, driven + n, cell->row_panels * SLIDE_LANES * sizeof *x);
    add_product(cell->to_rows, next, cell->n_states, cell->row_panels, rows);
}

static void run(const SlideCells *cells, const SlideCellsDerivative *derivative) {
    const SlideDual *features = derivative->features + cells->n_factors;
    const size_t n = n_states(cells);
    const bool turns = cells->is_gated && cells->gated.turned > 0;
    if (cells->is_gated) {
        share_gated(&cells->gated, derivative, features + (turns ? 2 : 0));
    } else {
        share(&cells->cell, derivative, features);
    }
    for (size_t state = 0; state < 2; ++state) {
        const SlideDual *x = derivative->states + state * n;
        SlideDual *next = derivative->next + state * n;
        SlideDual *rows = derivative->rows + state * n_rows(cells);
        if (cells->is_gated) {
            advance_gated(&cells->gated, derivative, features, x, next, rows);
        } else {
            advance(&cells->cell, derivative, x, next, rows);
        }
    }
}

static double slope_of(const SlideCells *cells, const SlideDual *factors, const SlideDual *rows) {
    SlideDual value = rows[0];
    for (size_t i = 0; i < cells->n_factors; ++i) {
        value = slide_plus(value, slide_times(factors[i], rows[1 + i]));
    }
    return value.slope;
}

static void see(const SlideCells *cells, const SlideCellsDerivative *derivative,
                const double *input, const double *d_input) {
    const size_t n_inputs = cells->seen.n_inputs, count = cells->seen.count;
    slide_cells_see(cells, input, input + n_inputs);
    slide_features_differentiate(&cells->seen, input, d_input, derivative->slopes);
    for (size_t i = 0; i < count; ++i) {
        derivative->features[i] = (SlideDual){cells->features[i], derivative->slopes[i]};
    }
    derivative->features[count] = (SlideDual){1, 0};
}

/* At a hand-over the younger becomes the older, and a new one starts from zero. */
static void accept(const SlideCells *cells, const SlideCellsDerivative *derivative, bool last) {
    const size_t n = n_states(cells), dual = sizeof(SlideDual);
    memcpy(derivative->states, derivative->next + (last ? n : 0), n * dual);
    memcpy(derivative->states + n, derivative->next + n, n * dual);
    if (last) {
        clear(derivative->states + n, n);
    }
    *derivative->taken += 1;
}

const double *slide_cells_derivative_take(const SlideCells *cells,
                                          const SlideCellsDerivative *derivative,
                                          const double *input, const double *d_input) {
    const SlideDual *older = derivative->rows, *younger = older + n_rows(cells);
    uint32_t age = (uint32_t)(*derivative->taken % cells->n_samples) + 1;
    double weight = slide_cells_weight(cells, age);
    see(cells, derivative, input, d_input);
    run(cells, derivative);
    for (size_t i = 0; i < cells->n_values; ++i) {
        size_t row = i * (1 + cells->n_factors);
        double slope = slope_of(cells, derivative->features, older + row);
        double other = slope_of(cells, derivative->features, younger + row);
        derivative->values[i] = slope + weight * (other - slope);
    }
    accept(cells, derivative, age == cells->n_samples);
    return derivative->values;
}
