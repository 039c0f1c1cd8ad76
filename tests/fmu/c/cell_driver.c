#include "cell_driver.h"

#include "resource.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ROWS = 64, MOST_COLUMNS = 64 };

/* A matrix by rows, and the same in panels; both are zero where nothing is. */
typedef struct {
    float rows[MOST_ROWS][MOST_COLUMNS];
    float panels[MOST_ROWS * MOST_COLUMNS];
} Matrix;

/* Features come in the order [turn, gated, schedule, drive, statics]. */
typedef struct {
    SlideUnits activation;
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

static Matrix w, w0, vx, vg, v0, a, b, b0, e, c, d, d0;

/* Feature parts: where the units look. Plain ones look at the drive. */
static size_t first_of_units(const Sizes *z) {
    return 2 * (z->turned > 0) + (z->activation == SLIDE_GATED ? 0 : z->gated + z->schedule);
}

static size_t count_of_units(const Sizes *z) {
    return z->activation == SLIDE_GATED ? z->gated : z->drive;
}

static double unit_of(const Sizes *z, size_t i, double offered, const double *schedule) {
    switch (z->activation) {
    case SLIDE_GATED:
        return tanh(product(&w, i, schedule, z->schedule) + (double)w0.rows[i][0]) * offered;
    case SLIDE_TANH:
        return tanh(offered);
    case SLIDE_MIXED:
        if (i % 2 == 1) {
            return tanh(offered);
        }
        offered = fmax(-8, fmin(8, offered));
        return offered * offered * offered;
    default:
        return offered * offered * offered;
    }
}

/* One state by the formulas: the next one and the rows of its values. */
static void exact(const Sizes *z, const double *features, const double *x, double *next,
                  double *rows) {
    double seen[MOST_ROWS], inner[MOST_ROWS], pushed[MOST_ROWS];
    const double *s = features + 2 * (z->turned > 0) + z->gated;
    const double *f = s + z->schedule, *statics = f + z->drive;
    const double *of_units = features + first_of_units(z);
    memcpy(seen, x, sizeof seen);
    turn(seen, z->turned, features[0], -features[1]);
    for (size_t i = 0; i < z->units; ++i) {
        double offered = product(&vx, i, seen, z->states) +
                         product(&vg, i, of_units, count_of_units(z)) + (double)v0.rows[i][0];
        inner[i] = unit_of(z, i, offered, s);
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

static SlideCell made_up(const Sizes *z) {
    static float scratch[9][4 * MOST_ROWS];
    const size_t padded = panels_for(z->units) * SLIDE_LANES;
    const size_t schedule_at = 2 * (z->turned > 0) + z->gated, drive_at = schedule_at + z->schedule;
    memset(scratch, 0, sizeof scratch);
    return (SlideCell){
        .n_states = z->states,
        .turned = z->turned,
        .unit_panels = panels_for(z->units),
        .state_panels = panels_for(z->states),
        .row_panels = panels_for(z->rows),
        .activation = z->activation,
        .to_gates = {schedule_at, z->schedule, fill(&w, z->units, z->schedule, z->schedule, 1),
                     fill(&w0, z->units, 1, 1, 2)},
        .to_units = {first_of_units(z), count_of_units(z),
                     fill(&vg, z->units, count_of_units(z), count_of_units(z), 4),
                     fill(&v0, z->units, 1, 1, 11)},
        .to_states = {drive_at, z->drive, fill(&b, z->states, z->drive, z->drive, 6),
                      fill(&b0, z->states, 0, 1, 12)},
        .to_rows = {drive_at + z->drive, z->statics,
                    fill(&d, z->rows, z->statics, z->statics, 9), fill(&d0, z->rows, 1, 1, 10)},
        .units_of_states = fill(&vx, z->units, z->states, z->states, 3),
        .states_of_states = fill(&a, z->states, z->states, z->states, 5),
        .states_of_units = fill(&e, z->states, z->units, padded, 7),
        .rows_of_states = fill(&c, z->rows, z->states, z->states, 8),
        .open = scratch[0],
        .offered = scratch[1],
        .driven = scratch[2],
        .rows = scratch[3],
        .seen = scratch[4],
        .pushed = scratch[5],
        .units = scratch[6],
        .zeros = scratch[7],
        .cubes = scratch[8],
    };
}

static double error_of(const SlideKernel *kernel, const Sizes *z) {
    SlideCell cell = made_up(z);
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
    kernel->advance(&cell, features, states, next, rows);
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

void report_cells(const SlideKernel *kernel) {
    static const Sizes sizes[] = {
        {SLIDE_TANH, 1, 0, 0, 0, 0, 1, 1, 1},    {SLIDE_TANH, 4, 0, 32, 0, 0, 1, 1, 1},
        {SLIDE_CUBIC, 14, 0, 40, 0, 0, 2, 2, 3}, {SLIDE_TANH, 8, 0, 7, 0, 0, 6, 3, 8},
        {SLIDE_CUBIC, 17, 0, 1, 0, 0, 3, 3, 9},  {SLIDE_GATED, 1, 0, 1, 1, 1, 1, 1, 1},
        {SLIDE_GATED, 2, 1, 0, 0, 0, 0, 0, 1},   {SLIDE_GATED, 16, 7, 48, 6, 15, 6, 6, 15},
        {SLIDE_GATED, 14, 7, 40, 2, 3, 1, 2, 3}, {SLIDE_GATED, 9, 4, 17, 3, 0, 2, 0, 9},
        {SLIDE_MIXED, 4, 0, 9, 0, 0, 1, 1, 1},   {SLIDE_MIXED, 7, 0, 40, 0, 0, 3, 2, 2},
    };
    double worst = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; ++i) {
        worst = fmax(worst, error_of(kernel, &sizes[i]));
    }
    printf("%s cell %.3g %.3g 1\n", kernel->name, worst, worst);
}

/* Input 0 of the made-up record, physical; the same at every sample before the first. */
static double input_at(int k) { return k <= 0 ? 0.5 : sin(0.7 * k) + 0.5; }

/* A cell on its own, in an arena of its own. */
typedef struct {
    unsigned char *block;
    SlideNetwork network;
    SlideNetworkState state;
} Alone;

static void place(Alone *alone, const SlidePayload *payload, SlideArena *arena) {
    slide_network_place(&alone->network, &payload->predictor, 1, arena);
    alone->network.family->place_state(&alone->state, &alone->network, arena);
}

static Alone make(const SlidePayload *payload, uint32_t n_samples, uint32_t n_out) {
    Alone alone = {0};
    SlideArena arena = {NULL, 0};
    place(&alone, payload, &arena);
    alone.block = calloc(arena.used, 1);
    arena = (SlideArena){alone.block, 0};
    place(&alone, payload, &arena);
    alone.network.n_samples = n_samples;
    alone.network.n_block = n_out;
    alone.network.family->restart(&alone.network, &alone.state);
    return alone;
}

/* The value after taking in samples first to last of the record. */
static double take(Alone *alone, const SlidePayload *payload, int first, int last) {
    const double offset = slide_f64(payload->input_scaling);
    const double scale = slide_f64(payload->input_scaling + 8);
    const SlideFamily *family = alone->network.family;
    double value = NAN;
    for (int k = first; k <= last; ++k) {
        double input[1 + SLIDE_BEFORE];
        for (int age = 0; age <= SLIDE_BEFORE; ++age) {
            input[age] = (input_at(k - age) - offset) / scale;
        }
        slide_network_see(&alone->network, &alone->state, 0, input, input + 1);
        value = family->evaluate(&alone->network, slide_kernel(0), &alone->state, 0)[0];
        family->accept(&alone->network, &alone->state);
    }
    return value;
}

static void report_three(const SlidePayload *payload, int steps) {
    int n = (int)payload->n_in;
    Alone ping_pong = make(payload, payload->n_in, payload->n_out);
    Alone recursive = make(payload, UINT32_MAX, 1); /* never restarted */
    Alone window = make(payload, payload->n_in, 1);
    take(&ping_pong, payload, 1 - 2 * n, -1);
    take(&recursive, payload, 1 - n, -1);
    for (int k = 0; k < steps; ++k) {
        window.network.family->restart(&window.network, &window.state);
        double exact = take(&window, payload, k - n + 1, k);
        double forgetting = take(&recursive, payload, k, k);
        double fading = take(&ping_pong, payload, k, k);
        printf("%.9g %.9g %.9g\n", exact, forgetting, fading);
    }
    free(ping_pong.block);
    free(recursive.block);
    free(window.block);
}

int evaluate_three_ways(const char *path, int steps) {
    SlideMessage message;
    SlidePayload payload;
    size_t size;
    unsigned char *data = slide_read_file(path, &size, &message);
    bool good = data != NULL && slide_payload_read(&payload, data, size, &message) &&
                payload.n_inputs == 1 && slide_is_recurrent(payload.predictor.family);
    if (good) {
        report_three(&payload, steps);
    }
    free(data);
    return good ? 0 : 1;
}

/* A model and its state in a block of their own. */
static unsigned char *place_all(const SlidePayload *payload, SlideModel *model, SlideState *state) {
    SlideArena arena = {NULL, 0};
    slide_model_place(model, payload, SLIDE_STEPS_PER_SAMPLE, &arena);
    slide_state_place(state, model, &arena);
    unsigned char *block = calloc(arena.used, 1);
    arena = (SlideArena){block, 0};
    slide_model_place(model, payload, SLIDE_STEPS_PER_SAMPLE, &arena);
    slide_state_place(state, model, &arena);
    slide_state_reset(model, state);
    return block;
}

static void report_first(const SlidePayload *payload, const double *numbers, size_t count) {
    SlideModel model;
    SlideState state;
    unsigned char *block = place_all(payload, &model, &state);
    const size_t n = model.predictor.of.cells.cell.n_states;
    const size_t size = model.predictor.of.cells.cell.state_panels * SLIDE_LANES;
    const SlideKnownOutputs known = {numbers, numbers + (count + SLIDE_BEFORE) * payload->n_inputs,
                                     count};
    slide_first_state_find(&model.predictor, &model.first, &known, 1,
                           &slide_start(&model, &state)->predictor);
    for (size_t i = 0; i < n; ++i) { /* the last of the sides is the state itself, after a sample */
        printf("%.17g\n", model.first.sides[2 * n * size + i]);
    }
    free(block);
}

int find_first_state(const char *path, const char *numbers, int count) {
    SlideMessage message;
    SlidePayload payload;
    size_t size;
    unsigned char *data = slide_read_file(path, &size, &message);
    bool good = data != NULL && slide_payload_read(&payload, data, size, &message) &&
                slide_is_recurrent(payload.predictor.family);
    unsigned char *known = slide_read_file(numbers, &size, &message);
    if (good && known != NULL) {
        double *aligned = malloc(size);
        memcpy(aligned, known, size);
        report_first(&payload, aligned, (size_t)count);
        free(aligned);
    }
    good = good && known != NULL;
    free(known);
    free(data);
    return good ? 0 : 1;
}
