#include "cell_driver.h"

#include "resource.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 48, WIDTH = 3 * MOST }; /* rows, and columns [x, f, 1] or units */

/* The matrices of a cell by rows, and the same in panels; both are zero where nothing is. */
typedef struct {
    float rows[WIDTH][WIDTH];
    float panels[WIDTH * WIDTH];
} Matrix;

static void fill(Matrix *matrix, size_t first, size_t n_rows, size_t n_columns, size_t all_columns,
                 int seed) {
    for (size_t row = first; row < first + n_rows; ++row) {
        for (size_t i = 0; i < n_columns; ++i) {
            float value = (float)(0.3 * cos(seed + 13.0 * (double)row + 7.0 * (double)i));
            matrix->rows[row][i] = value;
            matrix->panels[(row / SLIDE_LANES * all_columns + i) * SLIDE_LANES +
                           row % SLIDE_LANES] = value;
        }
    }
}

static double product(const Matrix *matrix, size_t row, const double *x, size_t count) {
    double sum = 0;
    for (size_t i = 0; i < count; ++i) {
        sum += (double)matrix->rows[row][i] * x[i];
    }
    return sum;
}

static double cell_error(const SlideKernel *kernel, size_t n, size_t q, size_t units, size_t p) {
    static Matrix f, x, e, c;
    static float driven[WIDTH], both[WIDTH];
    float features[8] = {0.3f, -0.7f, 0.2f}, states[2 * MOST] = {0}, next[2 * MOST];
    float values[2 * MOST];
    size_t up = (units + 7) / 8, sp = (n + 7) / 8, vp = (p + 7) / 8;
    double worst = 0;
    memset(&f, 0, sizeof f), memset(&x, 0, sizeof x);
    memset(&e, 0, sizeof e), memset(&c, 0, sizeof c);
    fill(&f, 0, units, q + 1, q + 1, 1), fill(&f, 8 * up, n, q, q + 1, 2);
    fill(&f, 8 * (up + sp), p, q + 1, q + 1, 3), fill(&x, 0, units, n, n, 4);
    fill(&x, 8 * up, n, n, n, 5), fill(&e, 0, n, units, 8 * up, 6), fill(&c, 0, p, n, n, 7);
    SlideCell cell = {q, n, up, sp, vp, 3, f.panels, x.panels, e.panels, c.panels, driven, both};
    features[q] = 1;
    for (size_t i = 0; i < n; ++i) {
        states[i] = (float)sin((double)i), states[8 * sp + i] = (float)cos((double)i);
    }
    kernel->advance(&cell, features, states, next, values);
    for (size_t s = 0; s < 2; ++s) {
        double old[WIDTH], drive[WIDTH], inner[WIDTH], moved[WIDTH];
        for (size_t i = 0; i < n; ++i) {
            old[i] = states[s * 8 * sp + i];
        }
        for (size_t i = 0; i <= q; ++i) {
            drive[i] = features[i];
        }
        for (size_t i = 0; i < units; ++i) {
            inner[i] = tanh(product(&f, i, drive, q + 1) + product(&x, i, old, n));
        }
        for (size_t i = 0; i < n; ++i) {
            moved[i] = product(&f, 8 * up + i, drive, q + 1) +
                       product(&x, 8 * up + i, old, n) + product(&e, i, inner, units);
            worst = fmax(worst, fabs(moved[i] - (double)next[s * 8 * sp + i]));
        }
        for (size_t i = 0; i < p; ++i) {
            double y = product(&f, 8 * (up + sp) + i, drive, q + 1) + product(&c, i, moved, n);
            worst = fmax(worst, fabs(y - (double)values[s * 8 * vp + i]));
        }
    }
    return worst;
}

void report_cell(const SlideKernel *kernel) {
    static const size_t sizes[][4] = {
        {1, 1, 0, 1}, {4, 1, 32, 1}, {14, 2, 40, 3}, {8, 6, 7, 8}, {17, 3, 1, 9}};
    double worst = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; ++i) {
        const size_t *size = sizes[i];
        worst = fmax(worst, cell_error(kernel, size[0], size[1], size[2], size[3]));
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
    slide_network_state_place(&alone->state, &alone->network, arena);
}

static Alone make(const SlidePayload *payload, uint32_t n_samples, uint32_t n_out) {
    Alone alone = {0};
    SlideArena arena = {NULL, 0};
    place(&alone, payload, &arena);
    alone.block = calloc(arena.used, 1);
    arena = (SlideArena){alone.block, 0};
    place(&alone, payload, &arena);
    alone.network.cells.n_samples = n_samples;
    alone.network.cells.n_out = n_out;
    slide_network_restart(&alone.network, &alone.state, NULL, NULL);
    return alone;
}

/* The value after taking in samples first to last of the record. */
static double take(Alone *alone, const SlidePayload *payload, int first, int last) {
    const double offset = slide_f64(payload->input_scaling);
    const double scale = slide_f64(payload->input_scaling + 8);
    double value = NAN;
    for (int k = first; k <= last; ++k) {
        double input[1 + SLIDE_BEFORE];
        for (int age = 0; age <= SLIDE_BEFORE; ++age) {
            input[age] = (input_at(k - age) - offset) / scale;
        }
        slide_network_see(&alone->network, &alone->state, 0, input, input + 1);
        value = slide_network_evaluate(&alone->network, slide_kernel_choose(), &alone->state, 0)[0];
        slide_network_accept(&alone->network, &alone->state);
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
        slide_network_restart(&window.network, &window.state, NULL, NULL);
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
                payload.n_inputs == 1 && payload.predictor.family->recurrent;
    if (good) {
        report_three(&payload, steps);
    }
    free(data);
    return good ? 0 : 1;
}
