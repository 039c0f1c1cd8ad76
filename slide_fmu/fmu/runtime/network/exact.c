#include "network.h"

#include <math.h>
#include <string.h>

/* y += weights x, in panels of so many lanes. */
static void add_product(const float *weights, size_t lanes, const double *x, size_t n_in,
                        size_t n_panels, double *y) {
    for (size_t panel = 0; panel < n_panels; ++panel, y += lanes) {
        for (size_t i = 0; i < n_in; ++i, weights += lanes) {
            for (size_t lane = 0; lane < lanes; ++lane) {
                y[lane] += weights[lane] * x[i];
            }
        }
    }
}

static void add_floats(double *y, const float *x, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        y[i] += x[i];
    }
}

static void clear(double *x, size_t count) { memset(x, 0, count * sizeof *x); }

static double activated(uint32_t activation, double x) {
    switch (activation) {
    case 1:
        return x < 0 ? 0 : x;
    case 2:
        return x <= 0 ? expm1(x) : x;
    case 3:
        return tanh(x);
    case 4: /* with sqrt(2 / pi) */
        return 0.5 * x * (1 + tanh(0.79788456080286536 * (x + 0.044715 * x * x * x)));
    case 5:
        return x * x * x;
    default:
        return x;
    }
}

static void activate(uint32_t activation, double *x, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        x[i] = activated(activation, x[i]);
    }
}

void slide_exact_layers_place(SlideExact *scratch, const SlideNetwork *network,
                              SlideArena *arena) {
    const SlideLayers *layers = &network->layers;
    SlideExactLayers *exact = &scratch->layers;
    size_t widest = layers->stack.widest * SLIDE_PANEL;
    exact->window =
        slide_place(arena, (size_t)layers->n_samples * layers->seen.count, sizeof(double));
    exact->back[0] = slide_place(arena, widest, sizeof(double));
    exact->back[1] = slide_place(arena, widest, sizeof(double));
}

static void add_layer(const SlideLayer *layer, const double *x, double *y) {
    add_product(layer->weights, SLIDE_PANEL, x, layer->n_in, layer->n_panels, y);
}

const double *slide_exact_layers_run(const SlideNetwork *network, const SlideExact *scratch,
                                     const SlideExactRun *run) {
    const SlideLayers *layers = &network->layers;
    const SlideExactLayers *exact = &scratch->layers;
    const SlideFeedForward *stack = &layers->stack;
    const size_t n_inputs = layers->seen.n_inputs;
    const size_t n_seen = layers->n_ages > 0 ? layers->n_ages : layers->n_samples;
    for (size_t i = 0; i < n_seen; ++i) {
        size_t age = layers->n_ages > 0 ? layers->ages[i] : n_seen - 1 - i;
        const double *input = run->samples + age * n_inputs;
        slide_features_exact(&layers->seen, input, input + n_inputs,
                             exact->window + i * layers->seen.count);
    }
    const double *x = exact->window;
    double *y = NULL;
    for (uint32_t i = 0; i < stack->n_layers; ++i) {
        const SlideLayer *layer = &stack->layers[i];
        const size_t count = layer->n_panels * SLIDE_PANEL;
        y = exact->back[i % 2];
        clear(y, count);
        add_floats(y, layer->bias, count);
        add_layer(layer, x, y);
        activate(layer->activation, y, count);
        x = y;
    }
    add_layer(&stack->skip, exact->window, y);
    return y;
}

typedef struct {
    size_t units, states, rows, all;
} Sizes;

static Sizes sizes_of(const SlideCells *cells) {
    size_t panels = cells->is_gated ? cells->gated.unit_panels : cells->cell.unit_panels;
    Sizes sizes = {panels * SLIDE_LANES, cells->state_panels * SLIDE_LANES,
                   cells->row_panels * SLIDE_LANES, 0};
    sizes.all = sizes.units + sizes.states + sizes.rows;
    return sizes;
}

void slide_exact_cells_place(SlideExact *scratch, const SlideNetwork *network,
                             SlideArena *arena) {
    const SlideCells *cells = &network->cells;
    SlideExactCells *exact = &scratch->cells;
    const Sizes sizes = sizes_of(cells);
    exact->taken = slide_place(arena, 1, sizeof *exact->taken);
    exact->states = slide_place(arena, 2 * sizes.states, sizeof(double));
    exact->results = slide_place(arena, 2 * sizes.all, sizeof(double));
    exact->gates = slide_place(arena, sizes.units, sizeof(double));
    exact->seen = slide_place(arena, sizes.states, sizeof(double));
    exact->features = slide_place(arena, cells->seen.count + 1, sizeof(double));
    exact->values = slide_place(arena, cells->n_values, sizeof(double));
    exact->errors = slide_place(arena, cells->n_values, sizeof(double));
    exact->largest = slide_place(arena, cells->n_values, sizeof(double));
}

/* From what was kept before a step, or from zero where before is NULL. */
static void start(const SlideCells *cells, const SlideExactCells *exact,
                  const SlideCellsBefore *before) {
    *exact->taken = before == NULL ? 0 : *before->taken;
    for (size_t i = 0; i < 2 * sizes_of(cells).states; ++i) {
        exact->states[i] = before == NULL ? 0 : before->states[i];
    }
    for (size_t i = 0; i < cells->n_values; ++i) {
        exact->errors[i] = before == NULL ? 0 : before->errors[i];
        exact->largest[i] = before == NULL ? 0 : before->largest[i];
    }
}

static void multiply(const float *weights, const double *x, size_t n_in, size_t count, double *y) {
    add_product(weights, SLIDE_LANES, x, n_in, count / SLIDE_LANES, y);
}

/* Of a state x: units, the next state, and rows, one after the other. */
static void run_plain(const SlideCell *cell, Sizes sizes, const double *features, const double *x,
                      double *units) {
    double *next = units + sizes.units, *rows = next + sizes.states;
    const size_t n = cell->n_states;
    clear(units, sizes.all);
    multiply(cell->from_features, features, cell->n_features + 1, sizes.all, units);
    multiply(cell->from_states, x, n, sizes.units, units);
    activate(cell->activation, units, sizes.units);
    multiply(cell->from_states + sizes.units * n, x, n, sizes.states, next);
    multiply(cell->from_units, units, sizes.units, sizes.states, next);
    multiply(cell->to_rows, next, n, sizes.rows, rows);
}

/* Turn the first pairs of a state by an angle with cosine c and sine s. */
static void turn_pairs(double *state, size_t pairs, double c, double s) {
    for (size_t i = 0; i < pairs; ++i) {
        double x = state[2 * i], y = state[2 * i + 1];
        state[2 * i] = c * x - s * y;
        state[2 * i + 1] = s * x + c * y;
    }
}

static void run_gated(const SlideGatedCell *cell, Sizes sizes, const SlideExactCells *exact,
                      const double *features, const double *x, double *units) {
    double *next = units + sizes.units, *rows = next + sizes.states, *gates = exact->gates;
    const bool turns = cell->turned > 0;
    const double c = turns ? features[0] : 1, s = turns ? features[1] : 0;
    const double *gated = features + (turns ? 2 : 0);
    const double *schedule = gated + cell->n_gated, *drive = schedule + cell->n_schedule;
    const size_t n = cell->n_states;
    clear(gates, sizes.units);
    clear(units, sizes.all);
    add_floats(gates, cell->gates_start, sizes.units);
    multiply(cell->gates, schedule, cell->n_schedule, sizes.units, gates);
    memcpy(exact->seen, x, sizes.states * sizeof *x);
    turn_pairs(exact->seen, cell->turned, c, -s);
    multiply(cell->from_gated, gated, cell->n_gated, sizes.units, units);
    multiply(cell->products, exact->seen, n, sizes.units, units);
    for (size_t i = 0; i < sizes.units; ++i) {
        units[i] *= tanh(gates[i]);
    }
    multiply(cell->from_units, units, sizes.units, sizes.states, next);
    turn_pairs(next, cell->turned, c, s);
    multiply(cell->from_drive, drive, cell->n_drive, sizes.states, next);
    multiply(cell->from_states, x, n, sizes.states, next);
    add_floats(rows, cell->rows_start, sizes.rows);
    multiply(cell->from_static, drive + cell->n_drive, cell->n_static, sizes.rows, rows);
    multiply(cell->to_rows, next, n, sizes.rows, rows);
}

static double value_of(const SlideCells *cells, const double *factors, const double *rows) {
    double value = rows[0];
    for (size_t i = 0; i < cells->n_factors; ++i) {
        value += factors[i] * rows[1 + i];
    }
    return value;
}

/* As slide_cells_accept. */
static void accept(const SlideCells *cells, const SlideExactCells *exact, Sizes sizes, bool last) {
    const size_t row = sizes.states * sizeof(double), values = cells->n_values * sizeof(double);
    const double *older = exact->results + sizes.units, *younger = older + sizes.all;
    memcpy(exact->states, last ? younger : older, row);
    memcpy(exact->states + sizes.states, younger, row);
    if (last) {
        clear(exact->states + sizes.states, sizes.states);
        if (*exact->taken >= cells->n_samples) {
            memcpy(exact->errors, exact->largest, values);
        }
        memset(exact->largest, 0, values);
    }
    *exact->taken += 1;
}

/* Take in an input as networks of the family do; with those before it, newest first. */
static void take(const SlideCells *cells, const SlideExactCells *exact, const double *sample) {
    const Sizes sizes = sizes_of(cells);
    const double *features = exact->features + cells->n_factors;
    const uint32_t age = slide_cells_age(cells, *exact->taken);
    const double weight = slide_cells_weight(cells, age);
    slide_features_exact(&cells->seen, sample, sample + cells->seen.n_inputs, exact->features);
    exact->features[cells->seen.count] = 1;
    for (size_t state = 0; state < 2; ++state) {
        const double *x = exact->states + state * sizes.states;
        double *results = exact->results + state * sizes.all;
        if (cells->is_gated) {
            run_gated(&cells->gated, sizes, exact, features, x, results);
        } else {
            run_plain(&cells->cell, sizes, features, x, results);
        }
    }
    const double *older = exact->results + sizes.units + sizes.states;
    for (size_t i = 0; i < cells->n_values; ++i) {
        const double *rows = older + i * (1 + cells->n_factors);
        double value = value_of(cells, exact->features, rows);
        double faded = weight * (value_of(cells, exact->features, rows + sizes.all) - value);
        exact->values[i] = value + faded;
        exact->largest[i] = fmax(exact->largest[i], fabs(faded));
    }
    accept(cells, exact, sizes, age == cells->n_samples);
}

/* From what was before the step; or from zero, over the same sample until that is forgotten, or
 * over the whole window. */
const double *slide_exact_cells_run(const SlideNetwork *network, const SlideExact *scratch,
                                    const SlideExactRun *run) {
    const SlideCells *cells = &network->cells;
    const SlideExactCells *exact = &scratch->cells;
    const size_t n_inputs = cells->seen.n_inputs;
    const uint32_t n_taken = run->anew ? cells->n_samples : run->n_taken;
    start(cells, exact, run->settled || run->anew ? NULL : run->before);
    for (uint64_t left = run->settled && !run->anew ? 2 * (uint64_t)cells->n_samples : 0; left > 0;
         --left) {
        take(cells, exact, run->samples + n_taken * n_inputs);
    }
    for (uint32_t age = n_taken; age-- > 0;) {
        take(cells, exact, run->samples + age * n_inputs);
    }
    return exact->values;
}
