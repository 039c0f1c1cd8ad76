#include "network.h"

typedef float Real;
typedef SlideCellState State;
#include "two_states.h"

/* Features by role, as the kernels take them. */
static void place_features(SlideNetwork *network, const SlideNetworkView *view,
                           SlideArena *arena) {
    const SlideRoles *roles = &view->of.cell.roles;
    const SlideIndices lists[] = {roles->readout,  roles->turn,  roles->gated,
                                  roles->schedule, roles->drive, roles->statics};
    size_t count = sizeof lists / sizeof lists[0];
    count -= slide_statics_are_drive(roles);
    slide_features_place(&network->seen, &view->features, lists, count, arena);
    network->features = slide_place(arena, network->seen.count, sizeof(float));
}

static void read(SlideNetworkView *view, SlideCursor *cursor) {
    slide_cell_read(&view->of.cell, view->features.chosen.count, cursor);
    view->n_samples = view->of.cell.n_samples;
    view->n_values = view->of.cell.n_values;
}

/* A cell gives one sample after the whole window. */
static bool fits(const SlideNetworkView *view, uint32_t n_in, uint32_t n_out, uint32_t n_outputs) {
    return view->n_values == n_outputs && view->n_samples == n_in && view->of.cell.n_out == n_out;
}

static void place(SlideNetwork *network, const SlideNetworkView *view, uint32_t n_kept,
                  SlideArena *arena) {
    SlideCells *cells = &network->of.cells;
    const SlideCellView *cell = &view->of.cell;
    (void)n_kept; /* a cell gives one sample at a time */
    network->memory_length = cell->n_samples - cell->n_out + 1;
    network->n_block = cell->n_out;
    network->n_settling = 2 * (uint64_t)cell->n_samples;
    cells->n_factors = cell->roles.readout.count;
    slide_cell_place(&cells->cell, &cells->terms, cell, arena);
    place_features(network, view, arena);
    cells->next = slide_place_panels(2 * cells->cell.state_panels, 1, arena);
    cells->both = slide_place_panels(2 * cells->cell.row_panels, 1, arena);
    cells->newest = slide_place(arena, cell->n_values, sizeof(float));
    cells->faded = slide_place(arena, cell->n_values, sizeof(float));
    /* open samples are taken back: those before them are still there */
    cells->n_recent = slide_power_of_two((uint64_t)cell->n_out + cell->n_samples);
    cells->block = slide_place(arena, cell->n_out, cell->n_values * sizeof(float));
}

static void place_before(SlideNetworkState *of_network, const SlideNetwork *network,
                         SlideArena *arena) {
    State *state = &of_network->cells;
    state->taken = slide_place(arena, 1, sizeof *state->taken);
    state->states = slide_place(arena, 2 * n_of_state(network), sizeof(float));
    state->errors = slide_place(arena, network->n_values, sizeof(float));
    state->largest = slide_place(arena, network->n_values, sizeof(float));
}

static void place_state(SlideNetworkState *state, const SlideNetwork *network,
                        SlideArena *arena) {
    place_before(state, network, arena);
    state->cells.recent = slide_place(arena, (size_t)network->of.cells.n_recent,
                                      network->n_values * sizeof(float));
}

static void keep(const SlideNetwork *network, const SlideNetworkState *of_network,
                 SlideNetworkState *of_before) {
    const State *state = &of_network->cells, *before = &of_before->cells;
    *before->taken = *state->taken;
    memcpy(before->states, state->states, 2 * n_of_state(network) * sizeof(float));
    memcpy(before->errors, state->errors, network->n_values * sizeof(float));
    memcpy(before->largest, state->largest, network->n_values * sizeof(float));
}

/* Each of them counts by its two states as they give its next values, which both of this one are. */
static void blend(const SlideNetwork *network, const SlideNetworkState *const *states,
                  const double *weights, size_t count, SlideNetworkState *between) {
    const State *blended = &between->cells;
    const size_t n = n_of_state(network);
    *blended->taken = 0;
    memset(blended->states, 0, n * sizeof(float));
    for (size_t i = 0; i < count; ++i) {
        const State *state = &states[i]->cells;
        const float weight = (float)weights[i];
        const float younger = weight * weight_at(network, age_after(network, *state->taken));
        for (size_t j = 0; j < n; ++j) {
            blended->states[j] += (weight - younger) * state->states[j] + younger * state->states[n + j];
        }
    }
    memcpy(blended->states + n, blended->states, n * sizeof(float));
}

static void restart(const SlideNetwork *network, SlideNetworkState *state) {
    start_anew(network, &state->cells);
}

/* All is in the scratch until the input is accepted. */
static void see(const SlideNetwork *network, SlideNetworkState *state, uint64_t sample) {
    (void)network, (void)state, (void)sample;
}

static const float *evaluate(const SlideNetwork *network, const SlideKernel *kernel,
                             const SlideNetworkState *of_network, uint64_t sample) {
    const SlideCells *cells = &network->of.cells;
    const State *state = &of_network->cells;
    (void)sample;
    kernel->advance(&cells->cell, network->features + cells->n_factors, state->states,
                    cells->next, cells->both);
    mix(network, *state->taken, network->features, cells->both, cells->newest, cells->faded);
    return cells->newest;
}

/* The place of the values after an input. */
static float *recent_values(const SlideNetwork *network, const State *state, uint64_t input) {
    const size_t place = (size_t)(input & (network->of.cells.n_recent - 1));
    return state->recent + place * network->n_values;
}

static void accept(const SlideNetwork *network, SlideNetworkState *of_network) {
    const SlideCells *cells = &network->of.cells;
    const State *state = &of_network->cells;
    memcpy(recent_values(network, state, *state->taken), cells->newest,
           network->n_values * sizeof(float));
    move_on(network, state, cells->next, cells->faded);
}

/* The values after the last n_block inputs. */
static const float *block(const SlideNetwork *network, const SlideKernel *kernel,
                          const SlideNetworkState *of_network, uint64_t sample) {
    const State *state = &of_network->cells;
    float *values = network->of.cells.block;
    (void)kernel, (void)sample;
    for (uint32_t age = network->n_block; age > 0; --age) {
        memcpy(values, recent_values(network, state, *state->taken - age),
               network->n_values * sizeof(float));
        values += network->n_values;
    }
    return network->of.cells.block;
}

static const float *truncation_errors(const SlideNetworkState *state) {
    return state->cells.errors;
}

const SlideFamily slide_state_space_family = {
    .number = 2,
    .read = read,
    .fits = fits,
    .place = place,
    .place_state = place_state,
    .restart = restart,
    .see = see,
    .evaluate = evaluate,
    .accept = accept,
    .block = block,
    .place_exact = slide_cells_exact_place,
    .run_exact = slide_cells_exact_run,
    .truncation_errors = truncation_errors,
    .place_before = place_before,
    .keep = keep,
    .blend = blend,
};
