/* Cells of many records in single precision. */
#include "record_kernel.h"

#include <float.h>
#include <math.h>

typedef float Real;
enum { TOGETHER = SLIDE_TOGETHER };
#include "record_sums.h"

static void activate(const SlideRecordCell *cell, uint32_t activation, float *x, size_t count) {
    extern const SlideKernel SLIDE_KERNEL;
    (void)cell;
    SLIDE_KERNEL.activate(activation, x, count);
}

#include "record_cell.h"

bool SLIDE_RECORD(see)(const SlideFeatures *features, const SlidePoints *points, float *seen) {
    const size_t records = points->records, n_samples = points->n_points / records;
    const size_t stride = features->count * records;
    bool finite = true;
    for (size_t i = 0; i < features->count; ++i) {
        const double *signal = points->signals + features->chosen[i] * SLIDE_ROOM + SLIDE_LEAD;
        const double offset = features->offset[i], factor = features->factor[i];
        for (size_t sample = 0; sample < n_samples; ++sample) {
            float *to = seen + sample * stride + i * records;
            const double *from = signal + sample * records;
            unsigned good = 1;
            for (size_t k = 0; k < records; ++k) {
                const double feature = (from[k] - offset) * factor;
                to[k] = (float)feature;
                good &= fabs(feature) <= FLT_MAX;
            }
            finite &= good != 0;
        }
    }
    return finite;
}

static void give_values(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                        const float *features, size_t records, float *values) {
    const float *rows = scratch->rows;
    for (size_t i = 0; i < cell->n_values; ++i, values += records) {
        memcpy(values, rows, records * sizeof *rows);
        rows += records;
        for (size_t factor = 0; factor < cell->n_factors; ++factor, rows += records) {
            const float *of_records = features + factor * records;
            for (size_t k = 0; k < records; ++k) {
                values[k] += of_records[k] * rows[k];
            }
        }
    }
}

void SLIDE_RECORD(run)(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                       size_t records, const float *features, size_t n_samples, float *states,
                       float *values) {
    const size_t size = count_states(cell, records) * sizeof *states;
    float *next = scratch->next;
    for (size_t sample = 0; sample < n_samples; ++sample) {
        prepare(cell, scratch, features, records);
        for (size_t substep = 0; substep < cell->substeps; ++substep) {
            move(cell, scratch, features, records, states, next);
            memcpy(states, next, size);
        }
        form_rows(cell, scratch, features, records, states);
        give_values(cell, scratch, features, records, values);
        features += cell->n_features * records;
        values += cell->n_values * records;
    }
}

/* States that do not change any more never will. */
void SLIDE_RECORD(settle)(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                          size_t records, const float *features, size_t n_samples,
                          float *states) {
    const size_t size = count_states(cell, records) * sizeof *states;
    bool moves = true;
    prepare(cell, scratch, features, records);
    for (size_t step = 0; moves && step < n_samples * cell->substeps; ++step) {
        move(cell, scratch, features, records, states, scratch->next);
        moves = memcmp(states, scratch->next, size) != 0;
        memcpy(states, scratch->next, size);
    }
}
