#include "cells.h"

#include <math.h>
#include <string.h>

static size_t panels_for(size_t rows) { return (rows + SLIDE_LANES - 1) / SLIDE_LANES; }

/* Where a matrix of a cell goes: panels of n_columns columns, from row and column on. */
typedef struct {
    float *panels;
    size_t n_columns, row, column;
} Target;

/* Copy columns of f32 rows, each n_stride long in the file. */
static void fill(Target target, const unsigned char *rows, size_t n_rows, size_t n_stride,
                 size_t n_columns) {
    for (size_t row = 0; row < n_rows; ++row) {
        size_t panel = (target.row + row) / SLIDE_LANES, lane = (target.row + row) % SLIDE_LANES;
        float *first = target.panels + (panel * target.n_columns + target.column) * SLIDE_LANES;
        for (size_t i = 0; i < n_columns; ++i) {
            first[i * SLIDE_LANES + lane] = slide_f32(rows + 4 * (row * n_stride + i));
        }
    }
}

static float *place_panels(size_t n_panels, size_t n_columns, SlideArena *arena) {
    return slide_place(arena, n_panels * n_columns, SLIDE_LANES * sizeof(float));
}

/* The block comes zeroed, so the padding of panels needs no care. */
static void fill_cell(const SlideCell *cell, float *const matrices[4], const SlideCellView *view,
                      size_t n_values) {
    size_t n = cell->n_states, q = cell->n_features, units = view->n_units, width = n + q + 1;
    size_t states_at = cell->unit_panels * SLIDE_LANES;
    size_t values_at = states_at + cell->state_panels * SLIDE_LANES;
    fill((Target){matrices[0], q + 1, 0, 0}, view->w + 4 * n, units, width, q + 1);
    fill((Target){matrices[0], q + 1, states_at, 0}, view->b, n, q, q);
    fill((Target){matrices[0], q + 1, values_at, 0}, view->d, n_values, q, q);
    fill((Target){matrices[0], q + 1, values_at, q}, view->d0, n_values, 1, 1);
    fill((Target){matrices[1], n, 0, 0}, view->w, units, width, n);
    fill((Target){matrices[1], n, states_at, 0}, view->a, n, n, n);
    fill((Target){matrices[2], states_at, 0, 0}, view->e, n, units, units);
    fill((Target){matrices[3], n, 0, 0}, view->c, n_values, n, n);
}

static void place_cell(SlideCell *cell, const SlideCellView *view, size_t n_values,
                       SlideArena *arena) {
    size_t units = panels_for(view->n_units), states = panels_for(view->n_states);
    size_t values = panels_for(n_values), n = view->n_states, q = view->n_features;
    float *matrices[4];
    matrices[0] = place_panels(units + states + values, q + 1, arena);
    matrices[1] = place_panels(units + states, n, arena);
    matrices[2] = place_panels(states, units * SLIDE_LANES, arena);
    matrices[3] = place_panels(values, n, arena);
    float *driven = place_panels(units + states + values, 1, arena);
    size_t whole = (2 * units * SLIDE_LANES + SLIDE_PANEL - 1) / SLIDE_PANEL;
    float *both = slide_place(arena, whole, SLIDE_PANEL * sizeof(float));
    *cell = (SlideCell){q,           n,           units,       states,      values, view->activation,
                        matrices[0], matrices[1], matrices[2], matrices[3], driven, both};
    if (arena->base != NULL) {
        fill_cell(cell, matrices, view, n_values);
    }
}

void slide_cells_place(SlideCells *cells, const SlideNetworkView *view, uint32_t n_inputs,
                       SlideArena *arena) {
    const SlideCellView *cell = &view->cell;
    cells->n_samples = view->n_samples;
    cells->n_out = cell->n_out;
    cells->n_values = view->n_values;
    cells->n_inputs = n_inputs;
    cells->n_blocks = cell->differences + 1;
    place_cell(&cells->cell, cell, view->n_values, arena);
    cells->feature_scale = slide_place(arena, cell->n_features, sizeof(double));
    cells->features = slide_place(arena, (size_t)cell->n_features + 1, sizeof(float));
    cells->next = place_panels(2 * cells->cell.state_panels, 1, arena);
    cells->both = place_panels(2 * cells->cell.value_panels, 1, arena);
    cells->newest = slide_place(arena, view->n_values, sizeof(float));
    cells->faded = slide_place(arena, view->n_values, sizeof(float));
    if (arena->base != NULL) {
        for (size_t i = 0; i < cell->n_features; ++i) {
            cells->feature_scale[i] = slide_f32(cell->feature_scale + 4 * i);
        }
        cells->features[cell->n_features] = 1;
    }
}

static size_t n_state_values(const SlideCells *cells) {
    return 2 * cells->cell.state_panels * SLIDE_LANES;
}

void slide_cell_state_place(SlideCellState *state, const SlideCells *cells, SlideArena *arena) {
    state->taken = slide_place(arena, 1, sizeof *state->taken);
    state->states = slide_place(arena, n_state_values(cells), sizeof(float));
    state->errors = slide_place(arena, cells->n_values, sizeof(float));
    state->largest = slide_place(arena, cells->n_values, sizeof(float));
}

void slide_cells_restart(const SlideCells *cells, SlideCellState *state) {
    *state->taken = 0;
    memset(state->states, 0, n_state_values(cells) * sizeof(float));
    memset(state->largest, 0, cells->n_values * sizeof(float));
}

/* Differences are formed in double precision: they cancel. */
static void write_features(const SlideCells *cells, const double *input, const double *before) {
    size_t n = cells->n_inputs;
    const double *scale = cells->feature_scale;
    float *features = cells->features;
    for (size_t i = 0; i < n; ++i) {
        double change = input[i] - before[i], change_before = before[i] - before[n + i];
        features[i] = (float)(input[i] / scale[i]);
        if (cells->n_blocks > 1) {
            features[n + i] = (float)(change / scale[n + i]);
        }
        if (cells->n_blocks > 2) {
            features[2 * n + i] = (float)((change - change_before) / scale[2 * n + i]);
        }
    }
}

static uint32_t age_after_input(const SlideCells *cells, const SlideCellState *state) {
    return (uint32_t)(*state->taken % cells->n_samples) + 1;
}

const float *slide_cells_advance(const SlideCells *cells, const SlideKernel *kernel,
                                 const SlideCellState *state, const double *input,
                                 const double *before) {
    const float *older = cells->both;
    const float *younger = older + cells->cell.value_panels * SLIDE_LANES;
    uint32_t age = age_after_input(cells, state), n_truncated = cells->n_samples - cells->n_out;
    float weight = age <= n_truncated ? 0 : (float)(age - n_truncated) / (float)cells->n_out;
    write_features(cells, input, before);
    kernel->advance(&cells->cell, cells->features, state->states, cells->next, cells->both);
    for (size_t i = 0; i < cells->n_values; ++i) {
        cells->faded[i] = weight * (younger[i] - older[i]);
        cells->newest[i] = older[i] + cells->faded[i];
    }
    return cells->newest;
}

void slide_cells_accept(const SlideCells *cells, SlideCellState *state) {
    size_t half = n_state_values(cells) / 2;
    for (size_t i = 0; i < cells->n_values; ++i) {
        state->largest[i] = fmaxf(state->largest[i], fabsf(cells->faded[i]));
    }
    if (age_after_input(cells, state) < cells->n_samples) {
        memcpy(state->states, cells->next, 2 * half * sizeof(float));
    } else {
        /* The first time both are the same: nothing is measured. */
        if (*state->taken >= cells->n_samples) {
            memcpy(state->errors, state->largest, cells->n_values * sizeof(float));
        }
        memset(state->largest, 0, cells->n_values * sizeof(float));
        memcpy(state->states, cells->next + half, half * sizeof(float));
        memset(state->states + half, 0, half * sizeof(float));
    }
    *state->taken += 1;
}
