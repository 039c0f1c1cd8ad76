#include "network.h"

#include <math.h>
#include <string.h>

/* Features by role, as the kernels take them; to plain cells, those that are drive and static part
 * come once. */
static void place_features(SlideCells *cells, const SlideNetworkView *view, SlideArena *arena) {
    const SlideRoles *roles = &view->cell.roles;
    const SlideIndices lists[] = {roles->readout,  roles->turn,  roles->gated,
                                  roles->schedule, roles->drive, roles->statics};
    size_t count = sizeof lists / sizeof lists[0];
    bool joined = !cells->is_gated && slide_statics_are_drive(roles);
    slide_features_place(&cells->seen, &view->features, lists, count - joined, arena);
    cells->features = slide_place(arena, cells->seen.count + 1, sizeof(float));
    if (arena->base != NULL) {
        cells->features[cells->seen.count] = 1;
    }
}

static void read(SlideNetworkView *view, SlideCursor *cursor) {
    slide_cell_read(&view->cell, view->features.chosen.count, cursor);
    view->n_samples = view->cell.n_samples;
    view->n_values = view->cell.n_values;
}

/* A cell gives one sample after the whole window. */
static bool fits(const SlideNetworkView *view, uint32_t n_in, uint32_t n_out, uint32_t n_outputs) {
    return view->n_values == n_outputs && view->n_samples == n_in && view->cell.n_out == n_out;
}

static void place(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                  SlideArena *arena) {
    SlideCells *cells = &network->cells;
    const SlideCellView *cell = &view->cell;
    (void)n_kept; /* a cell gives one sample at a time */
    network->memory_length = cell->n_samples - cell->n_out + 1;
    cells->is_gated = cell->units == SLIDE_GATED;
    cells->n_samples = cell->n_samples;
    cells->n_out = cell->n_out;
    cells->n_values = cell->n_values;
    cells->n_factors = cell->roles.readout.count;
    if (cells->is_gated) {
        slide_gated_cell_place(&cells->gated, cell, arena);
    } else {
        slide_cell_place(&cells->cell, cell, arena);
    }
    cells->state_panels = slide_panels_for(cell->n_states);
    cells->row_panels = slide_panels_for((size_t)cell->n_rows);
    place_features(cells, view, arena);
    cells->next = slide_place_panels(2 * cells->state_panels, 1, arena);
    cells->both = slide_place_panels(2 * cells->row_panels, 1, arena);
    cells->newest = slide_place(arena, cell->n_values, sizeof(float));
    cells->faded = slide_place(arena, cell->n_values, sizeof(float));
    cells->n_recent = slide_power_of_two(cell->n_out);
    cells->block = slide_place(arena, cell->n_out, cell->n_values * sizeof(float));
}

static size_t n_state_values(const SlideCells *cells) {
    return 2 * cells->state_panels * SLIDE_LANES;
}

static void place_state(SlideNetworkState *of_network, const SlideNetwork *network,
                        SlideArena *arena) {
    const SlideCells *cells = &network->cells;
    SlideCellState *state = &of_network->cells;
    state->taken = slide_place(arena, 1, sizeof *state->taken);
    state->states = slide_place(arena, n_state_values(cells), sizeof(float));
    state->errors = slide_place(arena, cells->n_values, sizeof(float));
    state->largest = slide_place(arena, cells->n_values, sizeof(float));
    state->recent =
        slide_place(arena, (size_t)cells->n_recent, cells->n_values * sizeof(float));
}

void slide_cells_before_place(SlideCellsBefore *before, const SlideCells *cells,
                              SlideArena *arena) {
    before->taken = slide_place(arena, 1, sizeof *before->taken);
    before->states = slide_place(arena, n_state_values(cells), sizeof(float));
    before->errors = slide_place(arena, cells->n_values, sizeof(float));
    before->largest = slide_place(arena, cells->n_values, sizeof(float));
}

void slide_cells_keep(const SlideCells *cells, const SlideCellState *state,
                      SlideCellsBefore *before) {
    *before->taken = *state->taken;
    memcpy(before->states, state->states, n_state_values(cells) * sizeof(float));
    memcpy(before->errors, state->errors, cells->n_values * sizeof(float));
    memcpy(before->largest, state->largest, cells->n_values * sizeof(float));
}

/* Both states to zero; the truncation error stays. n_samples inputs later the exact window is
 * evaluated, 2 n_samples inputs later the truncation error is measured. */
static void restart(const SlideNetwork *network, SlideNetworkState *of_network,
                    const double *input, const double *before) {
    const SlideCells *cells = &network->cells;
    SlideCellState *state = &of_network->cells;
    (void)input, (void)before; /* nothing is known of the inputs before */
    *state->taken = 0;
    memset(state->states, 0, n_state_values(cells) * sizeof(float));
    memset(state->largest, 0, cells->n_values * sizeof(float));
}

uint32_t slide_cells_age(const SlideCells *cells, uint64_t taken) {
    return (uint32_t)(taken % cells->n_samples) + 1;
}

static bool see(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample,
                const double *input, const double *before) {
    (void)state, (void)sample; /* all is in the scratch until the input is accepted */
    return slide_features_write(&network->cells.seen, input, before, network->cells.features);
}

/* Both states after what was seen, and the rows of their values. */
static void run(const SlideCells *cells, const SlideKernel *kernel, const SlideCellState *state) {
    const float *features = cells->features + cells->n_factors;
    if (cells->is_gated) {
        kernel->advance_gated(&cells->gated, features, state->states, cells->next, cells->both);
    } else {
        kernel->advance(&cells->cell, features, state->states, cells->next, cells->both);
    }
}

/* A value from its rows: the first counts once, the others times their factors. */
static float value_of(const SlideCells *cells, const float *rows) {
    float value = rows[0];
    for (size_t i = 0; i < cells->n_factors; ++i) {
        value += cells->features[i] * rows[1 + i];
    }
    return value;
}

float slide_cells_weight(const SlideCells *cells, uint32_t age) {
    uint32_t n_truncated = cells->n_samples - cells->n_out;
    return age <= n_truncated ? 0 : (float)(age - n_truncated) / (float)cells->n_out;
}

/* Each value has a term of every state, so states that are not finite show there. */
static const float *evaluate(const SlideNetwork *network, const SlideKernel *kernel,
                             const SlideNetworkState *state, uint64_t sample) {
    const SlideCells *cells = &network->cells;
    const float *older = cells->both, *younger = older + cells->row_panels * SLIDE_LANES;
    float weight = slide_cells_weight(cells, slide_cells_age(cells, *state->cells.taken));
    (void)sample;
    run(cells, kernel, &state->cells);
    for (size_t i = 0; i < cells->n_values; ++i) {
        size_t row = i * (1 + cells->n_factors);
        float value = value_of(cells, older + row);
        cells->faded[i] = weight * (value_of(cells, younger + row) - value);
        cells->newest[i] = value + cells->faded[i];
    }
    return cells->newest;
}

/* The place of the values after an input. */
static float *recent_values(const SlideCells *cells, const SlideCellState *state, uint64_t input) {
    return state->recent + (size_t)(input & (cells->n_recent - 1)) * cells->n_values;
}

static void accept(const SlideNetwork *network, SlideNetworkState *of_network) {
    const SlideCells *cells = &network->cells;
    SlideCellState *state = &of_network->cells;
    const size_t half = n_state_values(cells) / 2;
    memcpy(recent_values(cells, state, *state->taken), cells->newest,
           cells->n_values * sizeof(float));
    for (size_t i = 0; i < cells->n_values; ++i) {
        state->largest[i] = fmaxf(state->largest[i], fabsf(cells->faded[i]));
    }
    if (slide_cells_age(cells, *state->taken) < cells->n_samples) {
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

static uint32_t block_size(const SlideNetworkView *view, uint32_t n_outputs) {
    (void)n_outputs;
    return view->cell.n_out;
}

/* The values after the last n_out inputs. */
static const float *block(const SlideNetwork *network, const SlideKernel *kernel,
                          const SlideNetworkState *state, uint64_t sample) {
    const SlideCells *cells = &network->cells;
    (void)kernel, (void)sample;
    for (uint32_t age = 1; age <= cells->n_out; ++age) {
        memcpy(cells->block + (size_t)(cells->n_out - age) * cells->n_values,
               recent_values(cells, &state->cells, *state->cells.taken - age),
               cells->n_values * sizeof(float));
    }
    return cells->block;
}

const SlideFamily slide_state_space_family = {
    .number = 2,
    .recurrent = true,
    .read = read,
    .fits = fits,
    .place = place,
    .place_state = place_state,
    .restart = restart,
    .see = see,
    .evaluate = evaluate,
    .accept = accept,
    .block_size = block_size,
    .block = block,
    .place_exact = slide_exact_cells_place,
    .run_exact = slide_exact_cells_run,
};
