#include "parameters.h"

#include <math.h>
#include <string.h>

enum { ROW = 32 };
static const double RANGE_SLACK = 1e-6; /* of the range: rounding */

static void check_row(const unsigned char *row, uint32_t index, SlideCursor *cursor) {
    const double low = slide_f64(row), high = slide_f64(row + 8), start = slide_f64(row + 16);
    const uint32_t transform = slide_u32(row + 24);
    slide_check(cursor,
                isfinite(low) && isfinite(high) && low < high && start >= low && start <= high,
                "surrogate file: parameter %u in %g to %g starts at %g; expected finite numbers, "
                "the start between the others",
                (unsigned)index, low, high, start);
    slide_check(cursor, transform <= SLIDE_RECIPROCAL && (transform == SLIDE_LINEAR || low > 0),
                "surrogate file: transform %u of parameter %u from %g on; expected 0 to 2, and a "
                "positive range but with 0",
                (unsigned)transform, (unsigned)index, low);
}

void slide_parameters_read(SlideParametersView *view, uint64_t n_weights, SlideCursor *cursor) {
    slide_open_section(cursor, "PARA");
    view->count = slide_take_u32(cursor, "PARA");
    slide_check(cursor, view->count >= 1, "surrogate file: no parameters in section PARA");
    view->rows = slide_take(cursor, view->count, ROW, "parameter");
    for (uint32_t i = 0; cursor->good && i < view->count; ++i) {
        check_row(view->rows + ROW * (size_t)i, i, cursor);
    }
    view->n_terms = slide_take_u32(cursor, "PARA");
    slide_check(cursor, view->n_terms >= 1 && view->n_terms <= SLIDE_MOST_TERMS,
                "surrogate file: %u terms of parameters; expected 1 to %d",
                (unsigned)view->n_terms, (int)SLIDE_MOST_TERMS);
    const uint64_t n_degrees = (uint64_t)view->n_terms * view->count;
    view->degrees = slide_take(cursor, n_degrees, 4, "degree of a parameter");
    for (uint64_t i = 0; cursor->good && i < n_degrees; ++i) {
        slide_check(cursor, slide_u32(view->degrees + 4 * i) <= SLIDE_MOST_DEGREE,
                    "surrogate file: degree %u of a parameter; expected at most %d",
                    (unsigned)slide_u32(view->degrees + 4 * i), (int)SLIDE_MOST_DEGREE);
    }
    view->weights = slide_take_f32s(cursor, view->n_terms, n_weights, "weight");
    slide_close_section(cursor, "PARA");
}

static void take_rows(SlideParameters *parameters, const SlideParametersView *view) {
    for (size_t i = 0; i < view->count; ++i) {
        const unsigned char *row = view->rows + ROW * i;
        parameters->low[i] = slide_f64(row);
        parameters->high[i] = slide_f64(row + 8);
        parameters->start[i] = slide_f64(row + 16);
        parameters->transforms[i] = (SlideTransform)slide_u32(row + 24);
        parameters->formed[i] = NAN;
    }
    for (size_t i = 0; i < (size_t)view->n_terms * view->count; ++i) {
        parameters->degrees[i] = slide_u32(view->degrees + 4 * i);
    }
}

void slide_parameters_place(SlideParameters *parameters, const SlideParametersView *view,
                            SlideArena *arena) {
    const size_t count = view->count;
    parameters->count = view->count;
    parameters->n_terms = view->n_terms;
    parameters->low = slide_place(arena, count, sizeof(double));
    parameters->high = slide_place(arena, count, sizeof(double));
    parameters->start = slide_place(arena, count, sizeof(double));
    parameters->transforms = slide_place(arena, count, sizeof *parameters->transforms);
    parameters->degrees = slide_place(arena, view->n_terms * count, sizeof(uint32_t));
    parameters->powers = slide_place(arena, count, (1 + SLIDE_MOST_DEGREE) * sizeof(double));
    parameters->phi = slide_place(arena, view->n_terms, sizeof(double));
    parameters->formed = slide_place(arena, count, sizeof(double));
    if (arena->base != NULL) {
        take_rows(parameters, view);
    }
}

static double transformed(SlideTransform transform, double value) {
    switch (transform) {
    case SLIDE_LOG:
        return log(value);
    case SLIDE_RECIPROCAL:
        return 1 / value;
    default:
        return value;
    }
}

/* Half the range of a parameter's transform: it is scaled to -1 to 1. */
static double half_range(const SlideParameters *parameters, size_t index) {
    const SlideTransform transform = parameters->transforms[index];
    return 0.5 * (transformed(transform, parameters->high[index]) -
                  transformed(transform, parameters->low[index]));
}

static double scaled(const SlideParameters *parameters, size_t index, double value) {
    const SlideTransform transform = parameters->transforms[index];
    const double middle = 0.5 * (transformed(transform, parameters->low[index]) +
                                 transformed(transform, parameters->high[index]));
    return (transformed(transform, value) - middle) / half_range(parameters, index);
}

double slide_parameter_slope(const SlideParameters *parameters, size_t index, double value) {
    const SlideTransform transform = parameters->transforms[index];
    const double of_transform = transform == SLIDE_LOG          ? 1 / value
                                : transform == SLIDE_RECIPROCAL ? -1 / (value * value)
                                                                : 1;
    return of_transform / half_range(parameters, index);
}

/* Chebyshev polynomials of a parameter's scaled transform. */
static void fill_powers(const SlideParameters *parameters, size_t index, double z) {
    double *powers = parameters->powers + index * (1 + SLIDE_MOST_DEGREE);
    powers[0] = 1;
    powers[1] = z;
    for (size_t degree = 2; degree <= SLIDE_MOST_DEGREE; ++degree) {
        powers[degree] = 2 * z * powers[degree - 1] - powers[degree - 2];
    }
}

/* From the powers of all parameters. */
static void fill_phi(const SlideParameters *parameters) {
    for (size_t term = 0; term < parameters->n_terms; ++term) {
        double product = 1;
        for (size_t i = 0; i < parameters->count; ++i) {
            const size_t degree = parameters->degrees[term * parameters->count + i];
            product *= parameters->powers[i * (1 + SLIDE_MOST_DEGREE) + degree];
        }
        parameters->phi[term] = product;
    }
}

/* From phi. */
static void fill_weights(const SlideParameters *parameters, const SlideTerms *terms) {
    for (size_t k = 0; k < terms->count; ++k) {
        const SlideTermMatrix *matrix = &terms->matrices[k];
        for (size_t i = 0; i < matrix->size; ++i) {
            const float *weight = matrix->constant + i;
            double sum = *weight;
            for (size_t term = 0; term < terms->n_terms; ++term) {
                weight += terms->stride;
                sum += parameters->phi[term] * *weight;
            }
            matrix->now[i] = (float)sum;
        }
    }
}

void slide_parameters_form(const SlideParameters *parameters, const SlideTerms *terms,
                           const double *values) {
    const size_t row = parameters->count * sizeof *values;
    if (memcmp(parameters->formed, values, row) != 0) {
        for (size_t i = 0; i < parameters->count; ++i) {
            fill_powers(parameters, i, scaled(parameters, i, values[i]));
        }
        fill_phi(parameters);
        fill_weights(parameters, terms);
        memcpy(parameters->formed, values, row);
    }
}

void slide_parameters_form_near(const SlideParameters *parameters, const SlideTerms *terms,
                                const double *values, const double *direction, double amount) {
    for (size_t i = 0; i < parameters->count; ++i) {
        const double z = scaled(parameters, i, values[i]);
        fill_powers(parameters, i, z + amount * direction[i]);
        parameters->formed[i] = NAN;
    }
    fill_phi(parameters);
    fill_weights(parameters, terms);
}

static double slack(const SlideParameters *parameters, size_t index) {
    return RANGE_SLACK * (parameters->high[index] - parameters->low[index]);
}

bool slide_parameter_in_range(const SlideParameters *parameters, size_t index, double value) {
    return value >= parameters->low[index] - slack(parameters, index) &&
           value <= parameters->high[index] + slack(parameters, index);
}

double slide_parameter_within(const SlideParameters *parameters, size_t index, double value) {
    return fmin(fmax(value, parameters->low[index]), parameters->high[index]);
}
