#include "cell_driver.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST_ROWS = 64, MOST_COLUMNS = 64 };

/* A matrix by rows, and the same in panels; both are zero where nothing is. */
typedef struct {
    float rows[MOST_ROWS][MOST_COLUMNS];
    float panels[MOST_ROWS * MOST_COLUMNS];
} Matrix;

typedef struct {
    size_t states, turned, units, gated, schedule, drive, statics, rows;
} Sizes;

static size_t panels_for(size_t rows) { return (rows + SLIDE_LANES - 1) / SLIDE_LANES; }

/* Fill with made-up numbers; in panels of some more columns. */
static const float *fill(Matrix *matrix, size_t rows, size_t columns, size_t all_columns,
                         int seed) {
    memset(matrix, 0, sizeof *matrix);
    for (size_t row = 0; row < rows; ++row) {
        for (size_t i = 0; i < columns; ++i) {
            float value = (float)(0.3 * cos(seed + 13.0 * (double)row + 7.0 * (double)i));
            matrix->rows[row][i] = value;
            matrix->panels[(row / SLIDE_LANES * all_columns + i) * SLIDE_LANES +
                           row % SLIDE_LANES] = value;
        }
    }
    return matrix->panels;
}

static double product(const Matrix *matrix, size_t row, const double *x, size_t count) {
    double sum = 0;
    for (size_t i = 0; i < count; ++i) {
        sum += (double)matrix->rows[row][i] * x[i];
    }
    return sum;
}

static void turn(double *x, size_t pairs, double c, double s) {
    for (size_t i = 0; i < 2 * pairs; i += 2) {
        double first = x[i], second = x[i + 1];
        x[i] = c * first - s * second;
        x[i + 1] = s * first + c * second;
    }
}

static Matrix w, w0, vx, vg, a, b, e, c, d, d0;

/* One state by the formulas: the next one and the rows of its values. */
static void exact(const Sizes *z, const double *features, const double *x, double *next,
                  double *rows) {
    double seen[MOST_ROWS], inner[MOST_ROWS], pushed[MOST_ROWS];
    const double *g = features + (z->turned > 0 ? 2 : 0), *s = g + z->gated;
    const double *f = s + z->schedule, *statics = f + z->drive;
    memcpy(seen, x, sizeof seen);
    turn(seen, z->turned, features[0], -features[1]);
    for (size_t i = 0; i < z->units; ++i) {
        double gate = tanh(product(&w, i, s, z->schedule) + (double)w0.rows[i][0]);
        inner[i] = gate * (product(&vx, i, seen, z->states) + product(&vg, i, g, z->gated));
    }
    for (size_t i = 0; i < z->states; ++i) {
        pushed[i] = product(&e, i, inner, z->units);
    }
    turn(pushed, z->turned, features[0], features[1]);
    for (size_t i = 0; i < z->states; ++i) {
        next[i] = product(&a, i, x, z->states) + product(&b, i, f, z->drive) + pushed[i];
    }
    for (size_t i = 0; i < z->rows; ++i) {
        rows[i] = product(&c, i, next, z->states) + product(&d, i, statics, z->statics) +
                  (double)d0.rows[i][0];
    }
}

static SlideGatedCell made_up(const Sizes *z) {
    static float scratch[10][2 * MOST_ROWS];
    size_t padded = panels_for(z->units) * SLIDE_LANES;
    memset(scratch, 0, sizeof scratch);
    return (SlideGatedCell){
        .n_gated = z->gated,
        .n_schedule = z->schedule,
        .n_drive = z->drive,
        .n_static = z->statics,
        .n_states = z->states,
        .turned = z->turned,
        .unit_panels = panels_for(z->units),
        .state_panels = panels_for(z->states),
        .row_panels = panels_for(z->rows),
        .gates = fill(&w, z->units, z->schedule, z->schedule, 1),
        .gates_start = fill(&w0, z->units, 1, 1, 2),
        .products = fill(&vx, z->units, z->states, z->states, 3),
        .from_gated = fill(&vg, z->units, z->gated, z->gated, 4),
        .from_states = fill(&a, z->states, z->states, z->states, 5),
        .from_drive = fill(&b, z->states, z->drive, z->drive, 6),
        .from_units = fill(&e, z->states, z->units, padded, 7),
        .to_rows = fill(&c, z->rows, z->states, z->states, 8),
        .from_static = fill(&d, z->rows, z->statics, z->statics, 9),
        .rows_start = fill(&d0, z->rows, 1, 1, 10),
        .open = scratch[0],
        .offered = scratch[1],
        .driven = scratch[2],
        .rows = scratch[3],
        .seen = scratch[4],
        .pushed = scratch[5],
        .units = scratch[6],
        .zeros = scratch[7],
    };
}

static double error_of(const SlideKernel *kernel, const Sizes *z) {
    SlideGatedCell cell = made_up(z);
    float features[MOST_ROWS], states[2 * MOST_ROWS] = {0}, next[2 * MOST_ROWS];
    float rows[2 * MOST_ROWS];
    double worst = 0, wide[MOST_ROWS];
    size_t n = cell.state_panels * SLIDE_LANES, p = cell.row_panels * SLIDE_LANES;
    for (size_t i = 0; i < MOST_ROWS; ++i) {
        features[i] = (float)sin(1.0 + (double)i);
        wide[i] = features[i];
    }
    for (size_t i = 0; i < z->states; ++i) {
        states[i] = (float)sin((double)i), states[n + i] = (float)cos((double)i);
    }
    kernel->advance_gated(&cell, features, states, next, rows);
    for (size_t state = 0; state < 2; ++state) {
        double x[MOST_ROWS] = {0}, after[MOST_ROWS], values[MOST_ROWS];
        for (size_t i = 0; i < z->states; ++i) {
            x[i] = states[state * n + i];
        }
        exact(z, wide, x, after, values);
        for (size_t i = 0; i < z->states; ++i) {
            worst = fmax(worst, fabs(after[i] - (double)next[state * n + i]));
        }
        for (size_t i = 0; i < z->rows; ++i) {
            worst = fmax(worst, fabs(values[i] - (double)rows[state * p + i]));
        }
    }
    return worst;
}

void report_gated_cell(const SlideKernel *kernel) {
    static const Sizes sizes[] = {
        {1, 0, 1, 1, 1, 1, 1, 1},   {2, 1, 0, 0, 0, 0, 0, 1},   {16, 7, 48, 6, 15, 6, 6, 15},
        {14, 7, 40, 2, 3, 1, 2, 3}, {9, 4, 17, 3, 0, 2, 0, 9},
    };
    double worst = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; ++i) {
        worst = fmax(worst, error_of(kernel, &sizes[i]));
    }
    printf("%s gated %.3g %.3g 1\n", kernel->name, worst, worst);
}
