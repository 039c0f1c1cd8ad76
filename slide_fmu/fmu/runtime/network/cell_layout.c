#include "cell_layout.h"

#include <string.h>

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

size_t slide_panels_for(size_t rows) { return (rows + SLIDE_LANES - 1) / SLIDE_LANES; }

float *slide_place_panels(size_t n_panels, size_t n_columns, SlideArena *arena) {
    return slide_place(arena, n_panels * n_columns, SLIDE_LANES * sizeof(float));
}

bool slide_statics_are_drive(const SlideRoles *roles) {
    const SlideIndices *drive = &roles->drive, *statics = &roles->statics;
    return drive->count == statics->count &&
           memcmp(drive->at, statics->at, 4 * (size_t)drive->count) == 0;
}

/* Some columns of f32 rows, each n_stride long in the file. */
typedef struct {
    const unsigned char *rows;
    size_t n_rows, n_stride, column, n_columns;
} Source;

static Source whole(const unsigned char *rows, size_t n_rows, size_t n_columns) {
    return (Source){rows, n_rows, n_columns, 0, n_columns};
}

/* Panels of n_columns columns, at least the source's. The block comes zeroed, so the padding of
 * panels needs no care. */
static const float *place_matrix(Source source, size_t n_columns, SlideArena *arena) {
    float *panels = slide_place_panels(slide_panels_for(source.n_rows), n_columns, arena);
    for (size_t row = 0; arena->base != NULL && row < source.n_rows; ++row) {
        float *first = panels + row / SLIDE_LANES * n_columns * SLIDE_LANES + row % SLIDE_LANES;
        const unsigned char *values = source.rows + 4 * (row * source.n_stride + source.column);
        for (size_t i = 0; i < source.n_columns; ++i) {
            first[i * SLIDE_LANES] = slide_f32(values + 4 * i);
        }
    }
    return panels;
}

/* A part of the features from the first one on; constants: one column, or none. */
static SlideFeaturePart place_part(size_t first, Source source, Source constants,
                                   SlideArena *arena) {
    const float *weights = place_matrix(source, source.n_columns, arena);
    return (SlideFeaturePart){first, source.n_columns, weights,
                              place_matrix(constants, 1, arena)};
}

static void place_parts(SlideCell *cell, const SlideCellView *view, SlideArena *arena) {
    const SlideRoles *roles = &view->roles;
    const size_t n = view->n_states, units = view->n_units, rows = (size_t)view->n_rows;
    const size_t gated = roles->gated.count, schedule = roles->schedule.count;
    const size_t drive = roles->drive.count, statics = roles->statics.count;
    const size_t gated_at = roles->turn.count, schedule_at = gated_at + gated;
    const size_t drive_at = schedule_at + schedule;
    const size_t statics_at = drive_at + (slide_statics_are_drive(roles) ? 0 : drive);
    if (view->units == SLIDE_GATED) {
        const size_t width = schedule + 1;
        cell->to_gates = place_part(schedule_at, (Source){view->w, units, width, 0, schedule},
                                    (Source){view->w, units, width, schedule, 1}, arena);
        cell->to_units = place_part(gated_at, (Source){view->v, units, n + gated, n, gated},
                                    (Source){view->v, units, 0, 0, 0}, arena);
        cell->units_of_states = place_matrix((Source){view->v, units, n + gated, 0, n}, n, arena);
    } else {
        const size_t width = n + drive + 1;
        cell->to_units = place_part(drive_at, (Source){view->w, units, width, n, drive},
                                    (Source){view->w, units, width, n + drive, 1}, arena);
        cell->units_of_states = place_matrix((Source){view->w, units, width, 0, n}, n, arena);
    }
    cell->to_states =
        place_part(drive_at, whole(view->b, n, drive), (Source){view->b, n, 0, 0, 0}, arena);
    cell->to_rows =
        place_part(statics_at, whole(view->d, rows, statics), whole(view->d0, rows, 1), arena);
}

/* All matrices, one after the other: the same places for every cell of these sizes. */
static void place_weights(SlideCell *cell, const SlideCellView *view, SlideArena *arena) {
    const size_t n = view->n_states, units = view->n_units, rows = (size_t)view->n_rows;
    *cell = (SlideCell){.n_states = n,
                        .substeps = view->substeps,
                        .turned = view->turned,
                        .unit_panels = slide_panels_for(units),
                        .state_panels = slide_panels_for(n),
                        .row_panels = slide_panels_for(rows),
                        .activation = view->units};
    place_parts(cell, view, arena);
    cell->states_of_states = place_matrix(whole(view->a, n, n), n, arena);
    cell->states_of_units =
        place_matrix(whole(view->e, n, units), cell->unit_panels * SLIDE_LANES, arena);
    cell->rows_of_states = place_matrix(whole(view->c, rows, n), n, arena);
}

/* The cell of a term's weights, which follow those of the term before. */
static SlideCellView view_of_term(const SlideCellView *view, size_t term) {
    SlideCellView of_term = *view;
    const unsigned char **const matrices[] = {&of_term.a, &of_term.b, &of_term.e, &of_term.w,
                                              &of_term.v, &of_term.c, &of_term.d, &of_term.d0};
    const unsigned char *first =
        view->parameters.weights + 4 * (size_t)view->n_weights * term;
    for (size_t i = 0; i < sizeof matrices / sizeof matrices[0]; ++i) {
        *matrices[i] = first + (*matrices[i] - view->a);
    }
    return of_term;
}

/* List a matrix of the cell that runs, and of that which holds the constant term. */
static void list_matrix(SlideTerms *terms, const float *now, const float *constant, size_t size) {
    if (size > 0 && now != NULL) { /* gated units alone have some of the matrices */
        terms->matrices[terms->count++] = (SlideTermMatrix){(float *)now, constant, size};
    }
}

static void list_part(SlideTerms *terms, const SlideFeaturePart *now,
                      const SlideFeaturePart *constant, size_t n_panels) {
    const size_t rows = n_panels * SLIDE_LANES;
    list_matrix(terms, now->weights, constant->weights, rows * now->count);
    list_matrix(terms, now->constants, constant->constants, rows);
}

static void list_matrices(SlideTerms *terms, const SlideCell *now, const SlideCell *constant) {
    const size_t n = now->n_states, units = now->unit_panels * SLIDE_LANES;
    const size_t states = now->state_panels * SLIDE_LANES, rows = now->row_panels * SLIDE_LANES;
    list_part(terms, &now->to_gates, &constant->to_gates, now->unit_panels);
    list_part(terms, &now->to_units, &constant->to_units, now->unit_panels);
    list_part(terms, &now->to_states, &constant->to_states, now->state_panels);
    list_part(terms, &now->to_rows, &constant->to_rows, now->row_panels);
    list_matrix(terms, now->units_of_states, constant->units_of_states, units * n);
    list_matrix(terms, now->states_of_states, constant->states_of_states, states * n);
    list_matrix(terms, now->states_of_units, constant->states_of_units, states * units);
    list_matrix(terms, now->rows_of_states, constant->rows_of_states, rows * n);
}

/* One more cell for the constant term, and one for each other: all of them lie alike, so that the
 * same matrix of two terms in succession is always as far apart. */
static void place_terms(SlideTerms *terms, const SlideCell *now, const SlideCellView *view,
                        SlideArena *arena) {
    SlideCell constant, of_term;
    terms->n_terms = view->parameters.n_terms;
    place_weights(&constant, view, arena);
    for (size_t term = 0; term < terms->n_terms; ++term) {
        const SlideCellView next = view_of_term(view, term);
        place_weights(&of_term, &next, arena);
        if (arena->base != NULL && term == 0) {
            terms->stride = (size_t)(of_term.states_of_states - constant.states_of_states);
        }
    }
    if (arena->base != NULL) {
        list_matrices(terms, now, &constant);
    }
}

void slide_cell_place(SlideCell *cell, SlideTerms *terms, const SlideCellView *view,
                      SlideArena *arena) {
    *terms = (SlideTerms){0};
    place_weights(cell, view, arena);
    if (view->parameters.n_terms > 0) {
        place_terms(terms, cell, view, arena);
    }
    slide_cell_place_scratch(cell, sizeof(float), arena);
}

void slide_cell_place_scratch(SlideCell *cell, size_t number, SlideArena *arena) {
    const size_t panel = SLIDE_LANES * number;
    const size_t units = cell->unit_panels, states = cell->state_panels;
    const size_t both_units = (2 * units * SLIDE_LANES + SLIDE_PANEL - 1) / SLIDE_PANEL;
    cell->open = slide_place(arena, units, panel);
    cell->cubes = cell->activation == SLIDE_MIXED ? slide_place(arena, units, panel) : NULL;
    cell->offered = slide_place(arena, units, panel);
    cell->units = slide_place(arena, both_units, SLIDE_PANEL * number);
    cell->driven = slide_place(arena, states, panel);
    cell->seen = slide_place(arena, 2 * states, panel);
    cell->pushed = slide_place(arena, 2 * states, panel);
    cell->between = cell->substeps > 1 ? slide_place(arena, 2 * states, panel) : NULL;
    cell->zeros = slide_place(arena, states, panel);
    cell->rows = slide_place(arena, cell->row_panels, panel);
}
