#include "network.h"

#include <math.h>
#include <string.h>

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

static void tanh_each(double *x, size_t count) { activate(SLIDE_TANH, x, count); }

typedef double Real;
typedef double Lanes __attribute__((vector_size(64), aligned(8), may_alias));

typedef float SingleLanes __attribute__((vector_size(32), aligned(4), may_alias));
#define WEIGHTS(at, i) __builtin_convertvector(((const SingleLanes *)(at))[i], Lanes)
#include "cell_equation.h"

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
    const float *weights = layer->weights;
    for (size_t panel = 0; panel < layer->n_panels; ++panel, y += SLIDE_PANEL) {
        for (size_t i = 0; i < layer->n_in; ++i, weights += SLIDE_PANEL) {
            for (size_t lane = 0; lane < SLIDE_PANEL; ++lane) {
                y[lane] += weights[lane] * x[i];
            }
        }
    }
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

static size_t n_states(const SlideCells *cells) { return cells->state_panels * SLIDE_LANES; }

void slide_exact_cells_place(SlideExact *scratch, const SlideNetwork *network,
                             SlideArena *arena) {
    const SlideCells *cells = &network->cells;
    SlideExactCells *exact = &scratch->cells;
    exact->cell = cells->cell;
    exact->gated = cells->gated;
    if (cells->is_gated) {
        slide_gated_cell_place_scratch(&exact->gated, sizeof(double), arena);
    } else {
        slide_cell_place_scratch(&exact->cell, sizeof(double), arena);
    }
    exact->taken = slide_place(arena, 1, sizeof *exact->taken);
    exact->states = slide_place(arena, 2 * n_states(cells), sizeof(double));
    exact->next = slide_place(arena, 2 * n_states(cells), sizeof(double));
    exact->rows = slide_place(arena, 2 * cells->row_panels, SLIDE_LANES * sizeof(double));
    exact->features = slide_place(arena, cells->seen.count + 1, sizeof(double));
    exact->values = slide_place(arena, cells->n_values, sizeof(double));
    exact->errors = slide_place(arena, cells->n_values, sizeof(double));
    exact->largest = slide_place(arena, cells->n_values, sizeof(double));
}

/* From what was kept before a step, or from zero where before is NULL. */
static void start(const SlideCells *cells, const SlideExactCells *exact,
                  const SlideCellsBefore *before) {
    *exact->taken = before == NULL ? 0 : *before->taken;
    for (size_t i = 0; i < 2 * n_states(cells); ++i) {
        exact->states[i] = before == NULL ? 0 : before->states[i];
    }
    for (size_t i = 0; i < cells->n_values; ++i) {
        exact->errors[i] = before == NULL ? 0 : before->errors[i];
        exact->largest[i] = before == NULL ? 0 : before->largest[i];
    }
}

static double value_of(const SlideCells *cells, const double *factors, const double *rows) {
    double value = rows[0];
    for (size_t i = 0; i < cells->n_factors; ++i) {
        value += factors[i] * rows[1 + i];
    }
    return value;
}

/* As slide_cells_accept. */
static void accept(const SlideCells *cells, const SlideExactCells *exact, bool last) {
    const size_t half = n_states(cells), values = cells->n_values * sizeof(double);
    memcpy(exact->states, exact->next + (last ? half : 0), half * sizeof(double));
    memcpy(exact->states + half, exact->next + half, half * sizeof(double));
    if (last) {
        clear(exact->states + half, half);
        if (*exact->taken >= cells->n_samples) {
            memcpy(exact->errors, exact->largest, values);
        }
        memset(exact->largest, 0, values);
    }
    *exact->taken += 1;
}

/* Take in an input as networks of the family do; with those before it, newest first. */
static void take(const SlideCells *cells, const SlideExactCells *exact, const double *sample) {
    const double *features = exact->features + cells->n_factors, *older = exact->rows;
    const uint32_t age = slide_cells_age(cells, *exact->taken);
    const double weight = slide_cells_weight(cells, age);
    slide_features_exact(&cells->seen, sample, sample + cells->seen.n_inputs, exact->features);
    exact->features[cells->seen.count] = 1;
    if (cells->is_gated) {
        advance_gated(&exact->gated, features, exact->states, exact->next, exact->rows);
    } else {
        advance(&exact->cell, features, exact->states, exact->next, exact->rows);
    }
    for (size_t i = 0; i < cells->n_values; ++i) {
        const double *rows = older + i * (1 + cells->n_factors);
        const double *younger = rows + cells->row_panels * SLIDE_LANES;
        double value = value_of(cells, exact->features, rows);
        double faded = weight * (value_of(cells, exact->features, younger) - value);
        exact->values[i] = value + faded;
        exact->largest[i] = fmax(exact->largest[i], fabs(faded));
    }
    accept(cells, exact, age == cells->n_samples);
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
