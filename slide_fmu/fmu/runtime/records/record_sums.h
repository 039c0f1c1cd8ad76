/* Matrices times vectors of many records, or of one. Who includes this says before what numbers
 * are, Real, and how many records go together, TOGETHER. Each result adds its terms in the same
 * order whether there are many records or one: its bits are the same. */
#ifndef SLIDE_RECORD_SUMS_H
#define SLIDE_RECORD_SUMS_H

#include "record_kernel.h"

#include <string.h>

#if defined(__AVX512F__)
enum { REGISTER = 64, TILE = 8 }; /* bytes; rows of a panel that are summed up together */
#elif defined(__AVX2__)
enum { REGISTER = 32, TILE = 4 };
#else
enum { REGISTER = 16, TILE = 4 };
#endif
enum {
    WIDTH = REGISTER / sizeof(Real),
    STRIP = 2 * WIDTH <= TOGETHER ? 2 : 1, /* registers of records that go together */
    AT_ONCE = 4                            /* panels of one record */
};

/* Vector extension of GCC and Clang, at any alignment. */
typedef Real Wide __attribute__((vector_size(REGISTER), aligned(sizeof(Real)), may_alias));
typedef Real Panel
    __attribute__((vector_size(SLIDE_LANES * sizeof(Real)), aligned(sizeof(Real)), may_alias));

/* A matrix in panels times a vector of each record. */
typedef struct {
    const Real *weights;
    size_t n_in;
    const Real *x;
} Product;

/* Start, or else constants that are the same for all records, plus some products. */
typedef struct {
    const Real *start, *constants;
    size_t n_products;
    Product products[2];
    size_t n_rows;
} Sum;

/* Some rows of a panel, for a strip of records from a place on. */
SLIDE_INLINE void sum_tile(const Sum *sum, size_t first, size_t n_rows, size_t at, Real *y) {
    const size_t panel = first / SLIDE_LANES, row = first % SLIDE_LANES;
    Wide sums[TILE][STRIP];
    for (size_t i = 0; i < n_rows; ++i) {
        for (size_t k = 0; k < STRIP; ++k) {
            if (sum->start == NULL) {
                sums[i][k] = sum->constants[first + i] - (Wide){0};
            } else {
                sums[i][k] = ((const Wide *)(sum->start + (first + i) * TOGETHER + at))[k];
            }
        }
    }
    for (size_t part = 0; part < sum->n_products; ++part) {
        const Product *product = &sum->products[part];
        const Real *w = product->weights + panel * product->n_in * SLIDE_LANES + row;
        const Real *x = product->x + at;
        for (size_t j = 0; j < product->n_in; ++j, w += SLIDE_LANES, x += TOGETHER) {
            for (size_t k = 0; k < STRIP; ++k) {
                const Wide of_records = ((const Wide *)x)[k];
                for (size_t i = 0; i < n_rows; ++i) {
                    sums[i][k] += w[i] * of_records;
                }
            }
        }
    }
    for (size_t i = 0; i < n_rows; ++i) {
        for (size_t k = 0; k < STRIP; ++k) {
            ((Wide *)(y + (first + i) * TOGETHER + at))[k] = sums[i][k];
        }
    }
}

/* Some panels of one record. */
SLIDE_INLINE void sum_panels(const Sum *sum, size_t panel, size_t n_panels, Real *y) {
    const Panel *start = (const Panel *)(sum->start == NULL ? sum->constants : sum->start);
    Panel sums[AT_ONCE];
    for (size_t i = 0; i < n_panels; ++i) {
        sums[i] = start[panel + i];
    }
    for (size_t part = 0; part < sum->n_products; ++part) {
        const Product *product = &sum->products[part];
        const Panel *w = (const Panel *)product->weights + panel * product->n_in;
        for (size_t j = 0; j < product->n_in; ++j) {
            for (size_t i = 0; i < n_panels; ++i) {
                sums[i] += product->x[j] * w[i * product->n_in + j];
            }
        }
    }
    for (size_t i = 0; i < n_panels; ++i) {
        ((Panel *)y)[panel + i] = sums[i];
    }
}

static void sum_of_one(const Sum *sum, Real *y) {
    const size_t n_panels = (sum->n_rows + SLIDE_LANES - 1) / SLIDE_LANES;
    size_t panel = 0;
    for (; panel + AT_ONCE <= n_panels; panel += AT_ONCE) {
        sum_panels(sum, panel, AT_ONCE, y);
    }
    for (; panel < n_panels; ++panel) {
        sum_panels(sum, panel, 1, y);
    }
}

/* y [panels of n_rows][SLIDE_LANES][records], of the rows behind n_rows not all; y may be start. */
SLIDE_CALLED void sum_up(const Sum *sum, size_t records, Real *y) {
    if (records == 1) {
        sum_of_one(sum, y);
        return;
    }
    for (size_t row = 0; row < sum->n_rows; row += SLIDE_LANES) {
        const bool half = sum->n_rows - row <= SLIDE_LANES / 2;
        for (size_t at = 0; at < TOGETHER; at += STRIP * WIDTH) {
            if (half) {
                sum_tile(sum, row, SLIDE_LANES / 2, at, y);
            } else {
                for (size_t i = 0; i < SLIDE_LANES; i += TILE) {
                    sum_tile(sum, row + i, TILE, at, y);
                }
            }
        }
    }
}

#endif
