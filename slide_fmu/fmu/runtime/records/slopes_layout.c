#include "slopes_layout.h"

#include <stdlib.h>

enum { TOGETHER = SLIDE_TOGETHER_EXACT };

/* A matrix of the network, in panels of rows: in double precision, and transposed. The block comes
 * zeroed, so the padding of panels needs no care. */
static SlideRecordMatrix place_matrix(const void *panels, size_t n_rows, size_t n_columns,
                                      SlideArena *arena) {
    const float *weights = panels;
    const size_t row_panels = (n_rows + SLIDE_LANES - 1) / SLIDE_LANES;
    const size_t column_panels = (n_columns + SLIDE_LANES - 1) / SLIDE_LANES;
    double *plain = slide_place(arena, row_panels * n_columns, SLIDE_LANES * sizeof *plain);
    double *transposed = slide_place(arena, column_panels * n_rows, SLIDE_LANES * sizeof *plain);
    for (size_t i = 0; arena->base != NULL && i < n_rows; ++i) {
        for (size_t j = 0; j < n_columns; ++j) {
            const size_t at = (i / SLIDE_LANES * n_columns + j) * SLIDE_LANES + i % SLIDE_LANES;
            plain[at] = weights[at];
            transposed[(j / SLIDE_LANES * n_rows + i) * SLIDE_LANES + j % SLIDE_LANES] =
                weights[at];
        }
    }
    return (SlideRecordMatrix){plain, transposed};
}

static void place_part(SlideRecordPart *part, size_t n_rows, SlideArena *arena) {
    const SlideRecordMatrix weights = place_matrix(part->weights, n_rows, part->count, arena);
    if (part->constants != NULL) { /* gated units alone have all parts */
        part->constants = place_matrix(part->constants, n_rows, 1, arena).plain;
    }
    part->weights = weights.plain;
    part->transposed = weights.transposed;
}

static void place_cell(SlideRecordCell *cell, const SlideRecords *records, SlideArena *arena) {
    *cell = records->cell;
    const size_t n = cell->n_states, rows = cell->n_rows;
    const size_t units = cell->unit_panels * SLIDE_LANES;
    place_part(&cell->to_gates, units, arena);
    place_part(&cell->to_units, units, arena);
    place_part(&cell->to_states, n, arena);
    place_part(&cell->to_rows, rows, arena);
    cell->units_of_states = place_matrix(cell->units_of_states.plain, units, n, arena);
    cell->states_of_states = place_matrix(cell->states_of_states.plain, n, n, arena);
    cell->states_of_units = place_matrix(cell->states_of_units.plain, n, units, arena);
    cell->rows_of_states = place_matrix(cell->rows_of_states.plain, rows, n, arena);
}

static void place_scratch(SlideRecordScratch *scratch, const SlideRecordCell *cell,
                          SlideArena *arena) {
    const size_t panel = SLIDE_LANES * TOGETHER * sizeof(double);
    slide_records_place_scratch(scratch, cell, TOGETHER, sizeof(double), arena);
    scratch->of_units = slide_place(arena, cell->unit_panels, panel);
    scratch->of_arguments = slide_place(arena, cell->unit_panels, panel);
    scratch->of_seen = slide_place(arena, cell->state_panels, panel);
    scratch->of_rows = slide_place(arena, cell->row_panels, panel);
}

/* Features of n_samples samples, or of one that is held, and the states along them. */
static void place_path(SlidePath *path, const SlideRecordCell *cell, bool held, size_t n_features,
                       size_t n_states, SlideArena *arena) {
    const size_t panel = SLIDE_LANES * sizeof(double), count = n_features * cell->n_features;
    path->held = held;
    path->features = slide_place(arena, count, sizeof(double));
    path->of_features = slide_place(arena, count + SLIDE_LANES * TOGETHER, sizeof(double));
    path->states = slide_place(arena, n_states * cell->state_panels, panel);
}

static void place(SlideSlopes *slopes, const SlideRecords *records, SlideArena *arena) {
    const SlideFeatures *seen = &records->network->seen;
    const SlideRecordCell *cell = &slopes->cell;
    const size_t row = SLIDE_ROOM * sizeof(double);
    const size_t held = TOGETHER * ((records->network->n_samples - 1) * cell->substeps + 1);
    slopes->records = records;
    place_cell(&slopes->cell, records, arena);
    place_scratch(&slopes->scratch, cell, arena);
    slopes->points = records->points;
    slopes->points.of_inputs = slide_place(arena, seen->n_inputs, row);
    slopes->points.of_signals = slide_place(arena, seen->n_signals, row);
    slopes->points.scratch = slide_place(arena, 1 + seen->n_signals / 8, row);
    place_path(&slopes->held, cell, true, TOGETHER, held, arena);
    place_path(&slopes->path, cell, false, SLIDE_POINTS,
               SLIDE_POINTS * cell->substeps + TOGETHER, arena);
    slopes->weights = slide_place(arena, cell->n_values, SLIDE_POINTS * sizeof(double));
    slopes->of_states =
        slide_place(arena, cell->state_panels, SLIDE_LANES * TOGETHER * sizeof(double));
}

SlideSlopes *slide_slopes_open(const SlideRecords *records) {
    SlideSlopes *slopes = calloc(1, sizeof *slopes);
    SlideArena arena = {NULL, 0};
    if (slopes == NULL) {
        return NULL;
    }
    slopes->cell = records->cell; /* whose sizes count already while the arena measures */
    place(slopes, records, &arena);
    slopes->block = calloc(arena.used + SLIDE_ALIGNMENT, 1);
    if (slopes->block == NULL) {
        free(slopes);
        return NULL;
    }
    const size_t misaligned = (size_t)((uintptr_t)slopes->block % SLIDE_ALIGNMENT);
    arena = (SlideArena){slopes->block + (SLIDE_ALIGNMENT - misaligned), 0};
    place(slopes, records, &arena);
    return slopes;
}

void slide_slopes_close(SlideSlopes *slopes) {
    if (slopes != NULL) {
        free(slopes->block);
        free(slopes);
    }
}
