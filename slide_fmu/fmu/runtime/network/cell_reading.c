#include "cell_layout.h"

/* Every sub-step beyond the first adds SUBSTEP to the number of the units. */
enum { SUBSTEP = 256, MOST_SUBSTEPS = 16 };

static void read_sizes(SlideCellView *cell, SlideCursor *cursor) {
    uint32_t *const sizes[] = {&cell->n_samples, &cell->n_out, &cell->n_states, &cell->n_units,
                               &cell->n_values,  &cell->units, &cell->turned};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; ++i) {
        *sizes[i] = slide_take_u32(cursor, "a cell");
    }
    cell->substeps = cell->units / SUBSTEP + 1;
    cell->units %= SUBSTEP;
    slide_check(cursor, cell->n_out >= 1 && cell->n_out <= cell->n_samples,
                "surrogate file: n_samples %u, n_out %u of a cell; expected 1 <= n_out "
                "<= n_samples",
                (unsigned)cell->n_samples, (unsigned)cell->n_out);
    slide_check(cursor, cell->n_states >= 1 && cell->n_values >= 1,
                "surrogate file: a cell has no states or no values");
    slide_check(cursor,
                cell->units == SLIDE_TANH || cell->units == SLIDE_CUBIC ||
                    cell->units == SLIDE_GATED || cell->units == SLIDE_MIXED,
                "surrogate file: units %u of a cell; expected %d, %d, %d or %d",
                (unsigned)cell->units, (int)SLIDE_TANH, (int)SLIDE_CUBIC, (int)SLIDE_GATED,
                (int)SLIDE_MIXED);
    slide_check(cursor, cell->substeps <= MOST_SUBSTEPS,
                "surrogate file: %u sub-steps of a cell; expected 1 to %d",
                (unsigned)cell->substeps, (int)MOST_SUBSTEPS);
    slide_check(cursor,
                (uint64_t)cell->turned * 2 <= cell->n_states &&
                    (cell->turned == 0 || cell->units == SLIDE_GATED),
                "surrogate file: %u turned pairs of %u states; expected gated units and at most "
                "half the states",
                (unsigned)cell->turned, (unsigned)cell->n_states);
}

static void read_roles(SlideCellView *cell, uint32_t n_features, SlideCursor *cursor) {
    SlideRoles *roles = &cell->roles;
    SlideIndices *const lists[] = {&roles->drive,    &roles->statics, &roles->gated,
                                   &roles->schedule, &roles->readout, &roles->turn};
    for (size_t i = 0; i < sizeof lists / sizeof lists[0]; ++i) {
        *lists[i] = slide_take_indices(cursor, n_features, "a role of features");
    }
    slide_check(cursor, roles->turn.count == (cell->turned > 0 ? 2 : 0),
                "surrogate file: %u features of the turn; expected cosine and sine where states "
                "are turned, else none",
                (unsigned)roles->turn.count);
    slide_check(cursor,
                cell->units == SLIDE_GATED || roles->gated.count + roles->schedule.count == 0,
                "surrogate file: features of gated units, which the cell has not");
}

/* Every product of two sizes stays below 2^64: where a matrix was taken before, its sizes are
 * bounded by the file's. */
static void read_weights(SlideCellView *cell, SlideCursor *cursor) {
    const SlideRoles *roles = &cell->roles;
    bool gated = cell->units == SLIDE_GATED;
    uint64_t n = cell->n_states, units = cell->n_units, drive = roles->drive.count;
    uint64_t arguments = gated ? (uint64_t)roles->schedule.count + 1 : n + drive + 1;
    cell->n_rows = (uint64_t)cell->n_values * (1 + (uint64_t)roles->readout.count);
    cell->a = slide_take_f32s(cursor, n, n, "weight");
    cell->b = slide_take_f32s(cursor, n, drive, "weight");
    cell->e = slide_take_f32s(cursor, n, units, "weight");
    cell->w = slide_take_f32s(cursor, units, arguments, "weight");
    cell->v = slide_take_f32s(cursor, units, gated ? n + roles->gated.count : 0, "weight");
    cell->c = slide_take_f32s(cursor, cell->n_rows, n, "weight");
    cell->d = slide_take_f32s(cursor, cell->n_rows, roles->statics.count, "weight");
    cell->d0 = slide_take_f32s(cursor, cell->n_rows, 1, "weight");
    cell->n_weights = cursor->good ? (uint64_t)(cell->d0 - cell->a) / 4 + cell->n_rows : 0;
}

void slide_cell_read(SlideCellView *cell, uint32_t n_features, SlideCursor *cursor) {
    read_sizes(cell, cursor);
    read_roles(cell, n_features, cursor);
    read_weights(cell, cursor);
}
