/* Some rows of a panel, for a strip of records from a place on: a function for one width of
 * registers. record_sums.h includes this several times, and says each time before what its name is
 * (TILE_NAME), how many bytes a register has (TILE_BYTES), how many of them lie side by side in a
 * strip (TILE_STRIP), and how many rows of a panel are summed up together (TILE_ROWS). */
#define TILE_JOINED(name, part) name##_##part
#define TILE_PART(name, part) TILE_JOINED(name, part)
#define TILE_WIDE TILE_PART(TILE_NAME, wide)

enum { TILE_PART(TILE_NAME, strip) = TILE_STRIP * (TILE_BYTES / sizeof(Real)) };
typedef Real TILE_WIDE
    __attribute__((vector_size(TILE_BYTES), aligned(sizeof(Real)), may_alias));

SLIDE_INLINE void TILE_PART(TILE_NAME, rows)(const Sum *sum, size_t records, size_t first,
                                             size_t n_rows, size_t at, Real *y) {
    const size_t panel = first / SLIDE_LANES, row = first % SLIDE_LANES;
    TILE_WIDE sums[TILE_ROWS][TILE_STRIP];
    for (size_t i = 0; i < n_rows; ++i) {
        for (size_t k = 0; k < TILE_STRIP; ++k) {
            if (sum->start == NULL) {
                sums[i][k] = sum->constants[first + i] - (TILE_WIDE){0};
            } else {
                sums[i][k] = ((const TILE_WIDE *)(sum->start + (first + i) * records + at))[k];
            }
        }
    }
    for (size_t part = 0; part < sum->n_products; ++part) {
        const Product *product = &sum->products[part];
        const Real *w = product->weights + panel * product->n_in * SLIDE_LANES + row;
        const Real *x = product->x + at;
        for (size_t j = 0; j < product->n_in; ++j, w += SLIDE_LANES, x += records) {
            for (size_t k = 0; k < TILE_STRIP; ++k) {
                const TILE_WIDE of_records = ((const TILE_WIDE *)x)[k];
                for (size_t i = 0; i < n_rows; ++i) {
                    sums[i][k] += w[i] * of_records;
                }
            }
        }
    }
    for (size_t i = 0; i < n_rows; ++i) {
        for (size_t k = 0; k < TILE_STRIP; ++k) {
            ((TILE_WIDE *)(y + (first + i) * records + at))[k] = sums[i][k];
        }
    }
}

/* All rows, of so many records that they are whole strips. */
static void TILE_NAME(const Sum *sum, size_t records, Real *y) {
    for (size_t row = 0; row < sum->n_rows; row += SLIDE_LANES) {
        const bool half = sum->n_rows - row <= SLIDE_LANES / 2;
        for (size_t at = 0; at < records; at += TILE_PART(TILE_NAME, strip)) {
            if (half) {
                TILE_PART(TILE_NAME, rows)(sum, records, row, SLIDE_LANES / 2, at, y);
            } else {
                for (size_t i = 0; i < SLIDE_LANES; i += TILE_ROWS) {
                    TILE_PART(TILE_NAME, rows)(sum, records, row + i, TILE_ROWS, at, y);
                }
            }
        }
    }
}

#undef TILE_JOINED
#undef TILE_PART
#undef TILE_WIDE
#undef TILE_NAME
#undef TILE_BYTES
#undef TILE_STRIP
#undef TILE_ROWS
