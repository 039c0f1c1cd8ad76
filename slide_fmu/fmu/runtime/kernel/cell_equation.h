/* The equations of the cells of state-space networks (slide_fmu/network/state_space/equations.py)
 * for two states at once: in single precision a part of the kernels, in double precision one of
 * exact.c. Who includes this says before what numbers are, Real, and gives with them
 * Lanes: what is computed at once, a vector of SLIDE_LANES of them, at any alignment, or one;
 * PARTS: so many Lanes make a panel;
 * WEIGHTS(at, i): the i-th Lanes of weights, which are float, as Lanes;
 * activate, tanh_each: activations in place. */
#ifndef SLIDE_CELL_EQUATION_H
#define SLIDE_CELL_EQUATION_H

#include "clipped_cube.h"

#include <stdbool.h>
#include <string.h>

/* Two vectors, one of each state of a cell; they may be the same. */
typedef struct {
    const Real *a, *b;
} Pair;

/* Place of the k-th Lanes of a block in column i of its panels' weights. */
#define PLACE(k, i, n_in) (((k) / PARTS * (n_in) + (i)) * PARTS + (k) % PARTS)

/* A block of count Lanes of rows, of panels from first on, for both states: y = start + weights x;
 * the two y one after the other, n_panels each. Two sums each, of even and odd columns: less
 * waiting for the last term. */
SLIDE_INLINE void affine_block(const float *w, Pair start, Pair x, size_t n_in, size_t first,
                                size_t n_panels, size_t count, Lanes *y) {
    const Lanes *start_a = (const Lanes *)start.a + first * PARTS;
    const Lanes *start_b = (const Lanes *)start.b + first * PARTS;
    Lanes *y_a = y + first * PARTS, *y_b = y_a + n_panels * PARTS;
    Lanes a[2 * PARTS], b[2 * PARTS], c[2 * PARTS], d[2 * PARTS];
    for (size_t k = 0; k < count; ++k) {
        a[k] = start_a[k], b[k] = start_b[k];
        c[k] = (Lanes){0}, d[k] = (Lanes){0};
    }
    size_t i = 0;
    for (; i + 2 <= n_in; i += 2) {
        for (size_t k = 0; k < count; ++k) {
            const Lanes even = WEIGHTS(w, PLACE(k, i, n_in)), odd = WEIGHTS(w, PLACE(k, i + 1, n_in));
            a[k] += x.a[i] * even;
            b[k] += x.b[i] * even;
            c[k] += x.a[i + 1] * odd;
            d[k] += x.b[i + 1] * odd;
        }
    }
    for (size_t k = 0; k < count; ++k) {
        if (i < n_in) {
            a[k] += x.a[i] * WEIGHTS(w, PLACE(k, i, n_in));
            b[k] += x.b[i] * WEIGHTS(w, PLACE(k, i, n_in));
        }
        y_a[k] = a[k] + c[k], y_b[k] = b[k] + d[k];
    }
}

/* The same for all panels, two at a time: each x is read once for both; start may be y. */
SLIDE_CALLED void affine_pair(const float *weights, Pair start, Pair x, size_t n_in,
                              size_t n_panels, Real *y) {
    const size_t size = n_in * SLIDE_LANES; /* of a panel of weights */
    size_t panel = 0;
    for (; panel + 2 <= n_panels; panel += 2) {
        affine_block(weights + panel * size, start, x, n_in, panel, n_panels, 2 * PARTS,
                     (Lanes *)y);
    }
    if (panel < n_panels) {
        affine_block(weights + panel * size, start, x, n_in, panel, n_panels, PARTS, (Lanes *)y);
    }
}

/* What a part of the features gives, to a block as above. */
SLIDE_INLINE void multiply_block(const SlideFeaturePart *part, const Real *x, size_t first,
                                  size_t count, Lanes *y) {
    const size_t n_in = part->count;
    const float *w = part->weights + first * n_in * SLIDE_LANES;
    Lanes sums[2 * PARTS];
    for (size_t k = 0; k < count; ++k) {
        sums[k] = (Lanes){0};
    }
    for (size_t i = 0; i < n_in; ++i) {
        for (size_t k = 0; k < count; ++k) {
            sums[k] += x[i] * WEIGHTS(w, PLACE(k, i, n_in));
        }
    }
    for (size_t k = 0; k < count; ++k) {
        y[k] = sums[k] + WEIGHTS(part->constants, first * PARTS + k);
    }
}

/* The same for all panels, two at a time. */
SLIDE_CALLED void multiply(const SlideFeaturePart *part, const Real *features, size_t n_panels,
                           Real *y) {
    const Real *x = features + part->first;
    size_t panel = 0;
    for (; panel + 2 <= n_panels; panel += 2) {
        multiply_block(part, x, panel, 2 * PARTS, (Lanes *)y + panel * PARTS);
    }
    if (panel < n_panels) {
        multiply_block(part, x, panel, PARTS, (Lanes *)y + panel * PARTS);
    }
}

static inline void add_to(Real *y, const Real *x, size_t n_panels) {
    for (size_t k = 0; k < n_panels * PARTS; ++k) {
        ((Lanes *)y)[k] += ((const Lanes *)x)[k];
    }
}

static inline void multiply_by(Real *y, const Real *x, size_t n_panels) {
    for (size_t k = 0; k < n_panels * PARTS; ++k) {
        ((Lanes *)y)[k] *= ((const Lanes *)x)[k];
    }
}

/* Turn the first pairs of a state by an angle with cosine c and sine s. */
static inline void turn_pairs(Real *state, size_t pairs, Real c, Real s) {
    for (size_t i = 0; i < pairs; ++i) {
        Real x = state[2 * i], y = state[2 * i + 1];
        state[2 * i] = c * x - s * y;
        state[2 * i + 1] = s * x + c * y;
    }
}

/* Values of the units of both states: those that are offered, times their gates or activated. */
static inline void open_units(const SlideCell *cell, const Real *features, Real *h) {
    const size_t units = cell->unit_panels * SLIDE_LANES;
    if (cell->activation == SLIDE_GATED) {
        multiply(&cell->to_gates, features, cell->unit_panels, cell->open);
        tanh_each(cell->open, units);
        multiply_by(h, cell->open, cell->unit_panels);
        multiply_by(h + units, cell->open, cell->unit_panels);
        return;
    }
    const bool mixed = cell->activation == SLIDE_MIXED;
    Real *cubes = cell->cubes; /* units come in an even number: both states in one go */
    for (size_t i = 0; mixed && i < units; ++i) {
        cubes[i] = clipped_cube(h[2 * i]);
    }
    activate(mixed ? SLIDE_TANH : cell->activation, h,
             (2 * units + SLIDE_PANEL - 1) / SLIDE_PANEL * SLIDE_PANEL);
    for (size_t i = 0; mixed && i < units; ++i) {
        h[2 * i] = cubes[i];
    }
}

/* Move both states by what the features give; next is not states. */
static inline void move(const SlideCell *cell, const Real *features, const Real *states,
                        Real *next) {
    const size_t units = cell->unit_panels * SLIDE_LANES, n = cell->state_panels * SLIDE_LANES;
    const Pair x = {states, states + n};
    const Pair zeros = {cell->zeros, cell->zeros}, offered = {cell->offered, cell->offered};
    const Pair driven = {cell->driven, cell->driven};
    const bool turns = cell->turned > 0;
    Real *h = cell->units, *pushed = cell->pushed, *turned_back = cell->seen;
    Pair seen = x;
    if (turns) {
        memcpy(turned_back, states, 2 * n * sizeof(Real));
        turn_pairs(turned_back, cell->turned, features[0], -features[1]);
        turn_pairs(turned_back + n, cell->turned, features[0], -features[1]);
        seen = (Pair){turned_back, turned_back + n};
    }
    affine_pair(cell->units_of_states, offered, seen, cell->n_states, cell->unit_panels, h);
    open_units(cell, features, h);
    affine_pair(cell->states_of_units, turns ? zeros : driven, (Pair){h, h + units}, units,
                cell->state_panels, pushed);
    for (size_t state = 0; turns && state < 2; ++state) {
        turn_pairs(pushed + state * n, cell->turned, features[0], features[1]);
        add_to(pushed + state * n, cell->driven, cell->state_panels);
    }
    affine_pair(cell->states_of_states, (Pair){pushed, pushed + n}, x, cell->n_states,
                cell->state_panels, next);
}

static void advance(const SlideCell *cell, const Real *features, const Real *states, Real *next,
                    Real *rows) {
    const size_t n = cell->state_panels * SLIDE_LANES;
    const Pair moved = {next, next + n}, shared = {cell->rows, cell->rows};
    multiply(&cell->to_units, features, cell->unit_panels, cell->offered);
    multiply(&cell->to_states, features, cell->state_panels, cell->driven);
    multiply(&cell->to_rows, features, cell->row_panels, cell->rows);
    move(cell, features, states, next);
    for (size_t substep = 1; substep < cell->substeps; ++substep) {
        memcpy(cell->between, next, 2 * n * sizeof(Real));
        move(cell, features, cell->between, next);
    }
    affine_pair(cell->rows_of_states, shared, moved, cell->n_states, cell->row_panels, rows);
}

#endif
