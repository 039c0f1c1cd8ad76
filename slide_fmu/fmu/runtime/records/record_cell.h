/* The equations of cells (slide_fmu/network/state_space/equations.py) for many records, each of
 * them with one state. Who includes this says before what record_sums.h asks for, and after it
 * activate(activation, values, count): SLIDE_TANH or SLIDE_CUBIC in place, of whole panels of
 * units. */
#ifndef SLIDE_RECORD_CELL_H
#define SLIDE_RECORD_CELL_H

#include "clipped_cube.h"

/* Numbers of all units, or states, of the records that go together. */
static size_t count_units(const SlideRecordCell *cell, size_t records) {
    return cell->unit_panels * SLIDE_LANES * records;
}

static size_t count_states(const SlideRecordCell *cell, size_t records) {
    return cell->state_panels * SLIDE_LANES * records;
}

/* Features of a part. */
static const Real *part_of(const SlideRecordCell *cell, const SlideRecordPart *part,
                           const Real *features, size_t records) {
    return features + (cell->n_factors + part->first) * records;
}

static void multiply_part(const SlideRecordCell *cell, const SlideRecordPart *part,
                          const Real *features, size_t n_rows, size_t records, Real *y) {
    const Product product = {part->weights, part->count,
                             part_of(cell, part, features, records)};
    sum_up(&(Sum){NULL, part->constants, 1, {product}, n_rows}, records, y);
}

/* Turn the first pairs of states; sign -1 turns back. y may be x. */
SLIDE_CALLED void turn_states(const SlideRecordCell *cell, const Real *features, Real sign,
                        size_t records, const Real *x, Real *y) {
    const Real *c = features + cell->n_factors * records, *s = c + records;
    for (size_t pair = 0; pair < cell->turned; ++pair) {
        const Real *first = x + 2 * pair * records, *second = first + records;
        Real *to_first = y + 2 * pair * records, *to_second = to_first + records;
        SLIDE_EACH
        for (size_t k = 0; k < records; ++k) {
            const Real u = first[k], v = second[k], sine = sign * s[k];
            to_first[k] = c[k] * u - sine * v;
            to_second[k] = sine * u + c[k] * v;
        }
    }
    const size_t done = 2 * cell->turned * records;
    if (x != y) {
        memcpy(y + done, x + done, (count_states(cell, records) - done) * sizeof(Real));
    }
}

/* What does not depend on the states. */
SLIDE_CALLED void prepare(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                    const Real *features, size_t records) {
    const size_t n_units = cell->unit_panels * SLIDE_LANES;
    if (cell->activation == SLIDE_GATED) {
        multiply_part(cell, &cell->to_gates, features, n_units, records, scratch->open);
        activate(SLIDE_TANH, scratch->open, count_units(cell, records));
    }
    multiply_part(cell, &cell->to_units, features, n_units, records, scratch->offered);
    multiply_part(cell, &cell->to_states, features, cell->n_states, records, scratch->driven);
}

/* Units from what is offered to them. */
SLIDE_CALLED void open_units(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                       size_t records) {
    const size_t n_units = cell->unit_panels * SLIDE_LANES, count = count_units(cell, records);
    Real *h = scratch->units, *cubes = scratch->cubes;
    const Real *open = scratch->open;
    if (cell->activation == SLIDE_GATED) {
        SLIDE_EACH
        for (size_t i = 0; i < count; ++i) {
            h[i] *= open[i];
        }
        return;
    }
    const bool mixed = cell->activation == SLIDE_MIXED;
    for (size_t unit = 0; mixed && unit < n_units; unit += 2) {
        SLIDE_EACH
        for (size_t k = 0; k < records; ++k) {
            cubes[unit * records + k] = clipped_cube(h[unit * records + k]);
        }
    }
    activate(mixed ? SLIDE_TANH : cell->activation, h, count);
    for (size_t unit = 0; mixed && unit < n_units; unit += 2) {
        memcpy(h + unit * records, cubes + unit * records, records * sizeof(Real));
    }
}

/* What is offered to the units by states, in the frame that they see. */
SLIDE_CALLED void offer(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                  const Real *features, size_t records, const Real *states) {
    const Real *seen = states;
    if (cell->turned > 0) {
        turn_states(cell, features, -1, records, states, scratch->seen);
        seen = scratch->seen;
    }
    const Product product = {cell->units_of_states.plain, cell->n_states, seen};
    const size_t n_units = cell->unit_panels * SLIDE_LANES;
    sum_up(&(Sum){scratch->offered, NULL, 1, {product}, n_units}, records, scratch->units);
}

/* One step of the states by what was prepared; next is not states. */
SLIDE_CALLED void move(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                 const Real *features, size_t records, const Real *states, Real *next) {
    const size_t n = cell->n_states, n_units = cell->unit_panels * SLIDE_LANES;
    const Product by_units = {cell->states_of_units.plain, n_units, scratch->units};
    const Product by_states = {cell->states_of_states.plain, n, states};
    Real *pushed = scratch->pushed;
    const Real *driven = scratch->driven;
    offer(cell, scratch, features, records, states);
    open_units(cell, scratch, records);
    if (cell->turned == 0) {
        sum_up(&(Sum){driven, NULL, 2, {by_units, by_states}, n}, records, next);
        return;
    }
    memset(pushed, 0, count_states(cell, records) * sizeof(Real));
    sum_up(&(Sum){pushed, NULL, 1, {by_units}, n}, records, pushed);
    turn_states(cell, features, 1, records, pushed, pushed);
    SLIDE_EACH
    for (size_t i = 0; i < n * records; ++i) {
        pushed[i] += driven[i];
    }
    sum_up(&(Sum){pushed, NULL, 1, {by_states}, n}, records, next);
}

/* Rows of the values, and the values [n_values][records] from them. */
SLIDE_CALLED void form_rows(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                      const Real *features, size_t records, const Real *states) {
    const SlideRecordPart *part = &cell->to_rows;
    const Product by_features = {part->weights, part->count,
                                 part_of(cell, part, features, records)};
    const Product by_states = {cell->rows_of_states.plain, cell->n_states, states};
    sum_up(&(Sum){NULL, part->constants, 2, {by_features, by_states}, cell->n_rows}, records,
           scratch->rows);
}

#endif
