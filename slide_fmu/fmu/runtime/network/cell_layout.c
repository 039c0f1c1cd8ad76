#include "cell_layout.h"

#include <string.h>

size_t slide_panels_for(size_t rows) { return (rows + SLIDE_LANES - 1) / SLIDE_LANES; }

float *slide_place_panels(size_t n_panels, size_t n_columns, SlideArena *arena) {
    return slide_place(arena, n_panels * n_columns, SLIDE_LANES * sizeof(float));
}

bool slide_statics_are_drive(const SlideRoles *roles) {
    const SlideIndices *drive = &roles->drive, *statics = &roles->statics;
    return drive->count == statics->count &&
           memcmp(drive->at, statics->at, 4 * (size_t)drive->count) == 0;
}

/* Where a matrix of a cell goes: panels of n_columns columns, from row and column on. */
typedef struct {
    float *panels;
    size_t n_columns, row, column;
} Target;

/* Some columns of f32 rows, each n_stride long in the file. */
typedef struct {
    const unsigned char *rows;
    size_t n_rows, n_stride, column, n_columns;
} Source;

static void fill(Target target, Source source) {
    for (size_t row = 0; row < source.n_rows; ++row) {
        size_t panel = (target.row + row) / SLIDE_LANES, lane = (target.row + row) % SLIDE_LANES;
        float *first = target.panels + (panel * target.n_columns + target.column) * SLIDE_LANES;
        const unsigned char *values = source.rows + 4 * (row * source.n_stride + source.column);
        for (size_t i = 0; i < source.n_columns; ++i) {
            first[i * SLIDE_LANES + lane] = slide_f32(values + 4 * i);
        }
    }
}

static Source whole(const unsigned char *rows, size_t n_rows, size_t n_columns) {
    return (Source){rows, n_rows, n_columns, 0, n_columns};
}

/* The block comes zeroed, so the padding of panels needs no care. */
static void fill_cell(const SlideCell *cell, float *const matrices[4], const SlideCellView *view) {
    size_t n = cell->n_states, drive = view->roles.drive.count, units = view->n_units;
    size_t columns = cell->n_features + 1, rows = (size_t)view->n_rows, width = n + drive + 1;
    size_t statics = view->roles.statics.count, static_at = cell->n_features - statics;
    size_t states_at = cell->unit_panels * SLIDE_LANES;
    size_t rows_at = states_at + cell->state_panels * SLIDE_LANES;
    float *from_features = matrices[0], *from_states = matrices[1];
    fill((Target){from_features, columns, 0, 0}, (Source){view->w, units, width, n, drive});
    fill((Target){from_features, columns, 0, cell->n_features},
         (Source){view->w, units, width, n + drive, 1});
    fill((Target){from_features, columns, states_at, 0}, whole(view->b, n, drive));
    fill((Target){from_features, columns, rows_at, static_at}, whole(view->d, rows, statics));
    fill((Target){from_features, columns, rows_at, cell->n_features}, whole(view->d0, rows, 1));
    fill((Target){from_states, n, 0, 0}, (Source){view->w, units, width, 0, n});
    fill((Target){from_states, n, states_at, 0}, whole(view->a, n, n));
    fill((Target){matrices[2], states_at, 0, 0}, whole(view->e, n, units));
    fill((Target){matrices[3], n, 0, 0}, whole(view->c, rows, n));
}

void slide_cell_place(SlideCell *cell, const SlideCellView *view, SlideArena *arena) {
    const SlideRoles *roles = &view->roles;
    size_t units = slide_panels_for(view->n_units), states = slide_panels_for(view->n_states);
    size_t rows = slide_panels_for((size_t)view->n_rows), n = view->n_states;
    size_t q = roles->drive.count;
    q += slide_statics_are_drive(roles) ? 0 : roles->statics.count;
    float *matrices[4];
    matrices[0] = slide_place_panels(units + states + rows, q + 1, arena);
    matrices[1] = slide_place_panels(units + states, n, arena);
    matrices[2] = slide_place_panels(states, units * SLIDE_LANES, arena);
    matrices[3] = slide_place_panels(rows, n, arena);
    *cell = (SlideCell){.n_features = q,
                        .n_states = n,
                        .unit_panels = units,
                        .state_panels = states,
                        .row_panels = rows,
                        .activation = view->units,
                        .from_features = matrices[0],
                        .from_states = matrices[1],
                        .from_units = matrices[2],
                        .to_rows = matrices[3]};
    slide_cell_place_scratch(cell, sizeof(float), arena);
    if (arena->base != NULL) {
        fill_cell(cell, matrices, view);
    }
}

void slide_cell_place_scratch(SlideCell *cell, size_t number, SlideArena *arena) {
    const size_t panels = cell->unit_panels + cell->state_panels + cell->row_panels;
    const size_t units = 2 * cell->unit_panels * SLIDE_LANES;
    cell->driven = slide_place(arena, panels, SLIDE_LANES * number);
    cell->units =
        slide_place(arena, (units + SLIDE_PANEL - 1) / SLIDE_PANEL, SLIDE_PANEL * number);
}

/* Panels of one matrix, filled unless the arena measures; n_columns: at least the source's. */
static const float *place_matrix(Source source, size_t n_columns, SlideArena *arena) {
    float *panels = slide_place_panels(slide_panels_for(source.n_rows), n_columns, arena);
    if (arena->base != NULL) {
        fill((Target){panels, n_columns, 0, 0}, source);
    }
    return panels;
}

static const float *place_whole(const unsigned char *rows, size_t n_rows, size_t n_columns,
                                SlideArena *arena) {
    return place_matrix(whole(rows, n_rows, n_columns), n_columns, arena);
}

void slide_gated_cell_place_scratch(SlideGatedCell *cell, size_t number, SlideArena *arena) {
    const size_t panel = SLIDE_LANES * number;
    const size_t units = cell->unit_panels, states = cell->state_panels;
    cell->open = slide_place(arena, units, panel);
    cell->offered = slide_place(arena, units, panel);
    cell->units = slide_place(arena, 2 * units, panel);
    cell->driven = slide_place(arena, states, panel);
    cell->seen = slide_place(arena, 2 * states, panel);
    cell->pushed = slide_place(arena, 2 * states, panel);
    cell->zeros = slide_place(arena, states, panel);
    cell->rows = slide_place(arena, cell->row_panels, panel);
}

void slide_gated_cell_place(SlideGatedCell *cell, const SlideCellView *view, SlideArena *arena) {
    const SlideRoles *roles = &view->roles;
    size_t n = view->n_states, units = view->n_units, rows = (size_t)view->n_rows;
    size_t gated = roles->gated.count, schedule = roles->schedule.count;
    cell->n_gated = gated, cell->n_schedule = schedule;
    cell->n_drive = roles->drive.count, cell->n_static = roles->statics.count;
    cell->n_states = n, cell->turned = view->turned;
    cell->unit_panels = slide_panels_for(units);
    cell->state_panels = slide_panels_for(n);
    cell->row_panels = slide_panels_for(rows);
    cell->gates =
        place_matrix((Source){view->w, units, schedule + 1, 0, schedule}, schedule, arena);
    cell->gates_start =
        place_matrix((Source){view->w, units, schedule + 1, schedule, 1}, 1, arena);
    cell->products = place_matrix((Source){view->v, units, n + gated, 0, n}, n, arena);
    cell->from_gated = place_matrix((Source){view->v, units, n + gated, n, gated}, gated, arena);
    cell->from_states = place_whole(view->a, n, n, arena);
    cell->from_drive = place_whole(view->b, n, cell->n_drive, arena);
    cell->from_units =
        place_matrix(whole(view->e, n, units), cell->unit_panels * SLIDE_LANES, arena);
    cell->to_rows = place_whole(view->c, rows, n, arena);
    cell->from_static = place_whole(view->d, rows, cell->n_static, arena);
    cell->rows_start = place_whole(view->d0, rows, 1, arena);
    slide_gated_cell_place_scratch(cell, sizeof(float), arena);
}
