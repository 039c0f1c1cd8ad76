/* Matrices times vectors of some records, or of one. Who includes this says before what numbers
 * are, Real. Each result adds its terms in the same
 * order whether there are many records or one: its bits are the same. */
#ifndef SLIDE_RECORD_SUMS_H
#define SLIDE_RECORD_SUMS_H

#include "record_kernel.h"

#include <string.h>

enum { AT_ONCE = 4 }; /* panels of one record that are summed up together */

/* Vector extension of GCC and Clang, at any alignment. */
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

/* The fewer records go together, the narrower registers are filled with them; as many sums as
 * registers have room for fill each other's waiting times. */
#if defined(__AVX512F__)
#define WIDEST 64 /* bytes of a register */
#define PAIRED 8  /* rows of a panel whose sums, two registers each, there is room for */
#elif defined(__AVX2__)
#define WIDEST 32
#define PAIRED 4
#else
#define WIDEST 16
#define PAIRED 4
#endif

#define TILE_NAME sum_by_pairs
#define TILE_BYTES WIDEST
#define TILE_STRIP 2
#define TILE_ROWS PAIRED
#include "record_tile.h"
#if WIDEST >= 64
#define TILE_NAME sum_by_64
#define TILE_BYTES 64
#define TILE_STRIP 1
#define TILE_ROWS SLIDE_LANES
#include "record_tile.h"
#endif
#if WIDEST >= 32
#define TILE_NAME sum_by_32
#define TILE_BYTES 32
#define TILE_STRIP 1
#define TILE_ROWS SLIDE_LANES
#include "record_tile.h"
#endif
#define TILE_NAME sum_by_16
#define TILE_BYTES 16
#define TILE_STRIP 1
#define TILE_ROWS SLIDE_LANES
#include "record_tile.h"

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
    switch (n_panels - panel) { /* together: each sum waits for its last term */
    case 3:
        sum_panels(sum, panel, 3, y);
        break;
    case 2:
        sum_panels(sum, panel, 2, y);
        break;
    case 1:
        sum_panels(sum, panel, 1, y);
        break;
    default:
        break;
    }
}

/* y [panels of n_rows][SLIDE_LANES][records], of the rows behind n_rows not all; y may be start.
 * Records are one, or as many as fill some registers of 16 bytes, a power of two. */
SLIDE_CALLED void sum_up(const Sum *sum, size_t records, Real *y) {
    const size_t size = records * sizeof(Real);
    if (records == 1) {
        sum_of_one(sum, y);
    } else if (size >= 2 * WIDEST) {
        sum_by_pairs(sum, records, y);
#if WIDEST >= 64
    } else if (size == 64) {
        sum_by_64(sum, records, y);
#endif
#if WIDEST >= 32
    } else if (size == 32) {
        sum_by_32(sum, records, y);
#endif
    } else {
        sum_by_16(sum, records, y);
    }
}

#endif
