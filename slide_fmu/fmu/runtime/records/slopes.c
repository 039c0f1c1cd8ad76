#include "slopes.h"

#include <stdlib.h>
#include <string.h>

enum { TOGETHER = SLIDE_TOGETHER_EXACT };

struct SlideSlopes {
    unsigned char *block;
    const SlideRecords *records;
    SlideRecordCell cell;
    SlideRecordScratch scratch;
    SlidePoints points; /* those of the records, with gradients */
    SlidePath held;     /* the samples before a record, held */
    SlidePath path;     /* of a block */
    double *weights;    /* of the values of a block */
    double *of_states;
};

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

static size_t state_size(const SlideSlopes *slopes, const SlideGroup *group) {
    return slopes->cell.state_panels * SLIDE_LANES * group->places;
}

/* The features of a path of some samples from one on. */
static bool see(const SlideSlopes *slopes, const SlideGroup *group, size_t first,
                size_t n_samples, const SlidePath *path) {
    const SlideRecords *records = slopes->records;
    const SlidePoints points = slide_records_look(records, group, first, n_samples);
    return records->kernel->see_exact(&records->network->seen, &points, path->features);
}

/* Begin the gradient by the features of so many samples. */
static void clear(const SlideSlopes *slopes, const SlideGroup *group, size_t n_samples,
                  const SlidePath *path) {
    memset(path->of_features, 0,
           n_samples * slopes->cell.n_features * group->places * sizeof(double));
}

static void take_weights(const SlideSlopes *slopes, const SlideGroup *group, size_t first,
                         size_t n_samples, const double *weights) {
    const size_t n = slopes->cell.n_values, places = group->places;
    for (size_t place = 0; place < places; ++place) {
        const size_t record = place < group->list.count ? place : group->list.count - 1;
        const double *from = weights + (record * group->list.length + first) * n;
        for (size_t i = 0; i < n_samples * n; ++i) {
            slopes->weights[i * places + place] =
                slopes->records->outputs[i % n].scale * from[i];
        }
    }
}

/* From the gradient by the features of a path to that by the physical inputs, which is added. Its
 * signals and inputs are those looked at last. */
static void pull_features(const SlideSlopes *slopes, const SlideGroup *group, size_t first,
                          size_t n_samples, const SlidePath *path, double *gradient) {
    const SlideRecords *records = slopes->records;
    const SlideFeatures *seen = &records->network->seen;
    const size_t places = group->places, n = records->n_inputs;
    SlidePoints points = slopes->points;
    points.records = places;
    points.n_points = n_samples * places;
    memset(points.of_inputs, 0, n * SLIDE_ROOM * sizeof(double));
    memset(points.of_signals, 0, seen->n_signals * SLIDE_ROOM * sizeof(double));
    for (size_t sample = 0; sample < n_samples; ++sample) {
        const double *from = path->of_features + sample * seen->count * places;
        double *to = points.of_signals + SLIDE_LEAD + sample * places;
        for (size_t i = 0; i < seen->count; ++i, from += places) {
            for (size_t place = 0; place < places; ++place) {
                to[seen->chosen[i] * SLIDE_ROOM + place] += seen->factor[i] * from[place];
            }
        }
    }
    records->kernel->pull_signals(seen, &points);
    for (size_t i = 0; i < n; ++i) {
        const double *from = points.of_inputs + i * SLIDE_ROOM + SLIDE_LEAD;
        for (size_t at = 0; at < n_samples + SLIDE_BEFORE; ++at) {
            const size_t later = first + at; /* than SLIDE_BEFORE samples before the record */
            const size_t sample = later < SLIDE_BEFORE ? 0 : later - SLIDE_BEFORE;
            for (size_t place = 0; place < group->list.count; ++place) {
                const double slope = *(from + at * places + place - SLIDE_BEFORE * places);
                gradient[(place * group->list.length + sample) * n + i] +=
                    slope / records->inputs[i].scale;
            }
        }
    }
}

/* Run over the held samples and over all blocks but the last, and keep the states before each. */
static bool run_forward(const SlideSlopes *slopes, const SlideGroup *group, const SlidePath *held,
                        const SlidePath *path, double *kept) {
    const SlideRecordKernel *kernel = slopes->records->kernel;
    const size_t size = state_size(slopes, group), substeps = slopes->cell.substeps;
    bool finite = see(slopes, group, 0, 1, held);
    memset(held->states, 0, size * sizeof *kept);
    kernel->path(&slopes->cell, &slopes->scratch, held);
    memcpy(kept, held->states + held->n_samples * substeps * size, size * sizeof *kept);
    for (size_t first = 0; finite && first + path->n_samples < group->list.length; kept += size) {
        finite = see(slopes, group, first, path->n_samples, path);
        memcpy(path->states, kept, size * sizeof *kept);
        kernel->path(&slopes->cell, &slopes->scratch, path);
        memcpy(kept + size, path->states + path->n_samples * substeps * size,
               size * sizeof *kept);
        first += path->n_samples;
    }
    return finite;
}

/* A block forwards and backwards, from the states before it. */
static bool pull_block(const SlideSlopes *slopes, const SlideGroup *group, size_t first,
                       SlidePath path, const double *states, const double *weights,
                       double *gradient) {
    const SlideRecordKernel *kernel = slopes->records->kernel;
    const size_t left = group->list.length - first;
    path.n_samples = left < path.n_samples ? left : path.n_samples;
    memcpy(path.states, states, state_size(slopes, group) * sizeof *states);
    const bool finite = see(slopes, group, first, path.n_samples, &path);
    kernel->path(&slopes->cell, &slopes->scratch, &path);
    take_weights(slopes, group, first, path.n_samples, weights);
    clear(slopes, group, path.n_samples, &path);
    kernel->back(&slopes->cell, &slopes->scratch, &path, slopes->weights, slopes->of_states);
    pull_features(slopes, group, first, path.n_samples, &path, gradient);
    return finite;
}

static bool pull_group(const SlideSlopes *slopes, const SlideGroup *group, const double *weights,
                       double *gradient) {
    const SlideRecords *records = slopes->records;
    const size_t size = state_size(slopes, group), block = SLIDE_POINTS / group->places;
    const size_t n_blocks = (group->list.length + block - 1) / block;
    SlidePath held = slopes->held, path = slopes->path;
    held.records = path.records = group->places;
    held.n_samples = records->network->n_samples - 1;
    path.n_samples = block;
    double *kept = malloc(n_blocks * size * sizeof *kept);
    bool good = kept != NULL && run_forward(slopes, group, &held, &path, kept);
    memset(slopes->of_states, 0, size * sizeof *kept);
    for (size_t i = n_blocks; good && i-- > 0;) {
        good = pull_block(slopes, group, i * block, path, kept + i * size, weights, gradient);
    }
    free(kept);
    if (good) {
        clear(slopes, group, 1, &held);
        records->kernel->back(&slopes->cell, &slopes->scratch, &held, NULL, slopes->of_states);
        slide_records_look(records, group, 0, 1);
        pull_features(slopes, group, 0, 1, &held, gradient);
    }
    return good;
}

bool slide_slopes_run(const SlideSlopes *slopes, const SlideRecordList *list,
                      const double *weights, double *gradient) {
    const SlideRecords *records = slopes->records;
    const size_t of_outputs = list->length * slopes->cell.n_values;
    const size_t of_inputs = list->length * records->n_inputs;
    bool good = true;
    memset(gradient, 0, list->count * of_inputs * sizeof *gradient);
    for (size_t first = 0; good && first < list->count;) {
        const SlideGroup group =
            slide_records_group(records, list, first, SLIDE_TOGETHER_EXACT);
        good = pull_group(slopes, &group, weights + first * of_outputs,
                          gradient + first * of_inputs);
        first += group.list.count;
    }
    return good;
}
