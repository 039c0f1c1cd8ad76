/* Cells of many records in single precision. */
#include "record_kernel.h"

#include <float.h>
#include <math.h>

typedef float Real;
#include "record_sums.h"

/* Numerator and denominator of tanh: polynomials in x and x^2, fitted for single precision (Eigen).
 * The error stays below 4e-7; beyond the largest argument, tanh is 1. */
static inline float tanh_parts(float x, float *denominator) {
    const float largest = 7.90531111f;
    x = x > largest ? largest : x < -largest ? -largest : x;
    const float u = x * x;
    float p = 2.00018790e-13f - 2.76076848e-16f * u;
    p = p * u - 8.60467152e-11f;
    p = p * u + 5.12229709e-08f;
    p = p * u + 1.48572236e-05f;
    p = p * u + 6.37261929e-04f;
    p = p * u + 4.89352456e-03f;
    float q = 1.18534706e-04f + 1.19825840e-06f * u;
    q = q * u + 2.26843463e-03f;
    *denominator = q * u + 4.89352519e-03f;
    return x * p;
}

/* Two units of a record share a division, which takes longer than all else. */
static void tanh_each(float *x, size_t count) {
    float *other = x + count / 2;
    SLIDE_EACH
    for (size_t i = 0; i < count / 2; ++i) {
        float below, other_below;
        const float above = tanh_parts(x[i], &below);
        const float other_above = tanh_parts(other[i], &other_below);
        const float inverse = 1 / (below * other_below);
        x[i] = above * (other_below * inverse);
        other[i] = other_above * (below * inverse);
    }
}

static void activate(uint32_t activation, float *x, size_t count) {
    if (activation == SLIDE_TANH) {
        tanh_each(x, count);
        return;
    }
    SLIDE_EACH
    for (size_t i = 0; i < count; ++i) { /* SLIDE_CUBIC */
        x[i] = x[i] * x[i] * x[i];
    }
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
            SLIDE_EACH
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
            SLIDE_EACH
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
