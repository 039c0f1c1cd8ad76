/* Cells of many records in double precision, forwards and backwards: backpropagation through time
 * (slide_fmu/network/state_space/gradient.py). */
#include "record_kernel.h"

#include <math.h>

typedef double Real;
#include "record_sums.h"

/* tanh |x| = -t / (2 + t) with t = exp(-2 |x|) - 1: n ln 2 + r, a Taylor polynomial in r, and
 * 2^n p + (2^n - 1). What is not a number stays so. */
static inline double tanh_of(double x) {
    const double round_to_integer = 6755399441055744.0; /* 1.5 * 2^52 */
    const double ln2_high = 6.93147180369123816490e-01, ln2_low = 1.90821492927058770002e-10;
    double z = -2 * fabs(x);
    z = z < -40 ? -40 : z;
    const double shifted = z * 1.44269504088896338700 + round_to_integer;
    const double n = shifted - round_to_integer, r = (z - n * ln2_high) - n * ln2_low;
    double p = 1.0 / 479001600 + r * (1.0 / 6227020800);
    p = 1.0 / 39916800 + r * p;
    p = 1.0 / 3628800 + r * p;
    p = 1.0 / 362880 + r * p;
    p = 1.0 / 40320 + r * p;
    p = 1.0 / 5040 + r * p;
    p = 1.0 / 720 + r * p;
    p = 1.0 / 120 + r * p;
    p = 1.0 / 24 + r * p;
    p = 1.0 / 6 + r * p;
    p = 0.5 + r * p;
    p = r + r * r * p;
    uint64_t bits;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (bits << 52) + ((uint64_t)1023 << 52);
    double power;
    memcpy(&power, &bits, sizeof power);
    const double t = power * p + (power - 1), size = -t / (2 + t);
    return x > 0 ? size : (x <= 0 ? -size : x);
}

static void activate(uint32_t activation, double *x, size_t count) {
    if (activation == SLIDE_TANH) {
        SLIDE_EACH
        for (size_t i = 0; i < count; ++i) {
            x[i] = tanh_of(x[i]);
        }
        return;
    }
    SLIDE_EACH
    for (size_t i = 0; i < count; ++i) { /* SLIDE_CUBIC */
        x[i] = x[i] * x[i] * x[i];
    }
}

#include "record_cell.h"

bool SLIDE_RECORD(see_exact)(const SlideFeatures *features, const SlidePoints *points,
                             double *seen) {
    const size_t records = points->records, n_samples = points->n_points / records;
    bool finite = true;
    for (size_t sample = 0; sample < n_samples; ++sample) {
        const double *signals = points->signals + SLIDE_LEAD + sample * records;
        for (size_t i = 0; i < features->count; ++i, seen += records) {
            const double *signal = signals + features->chosen[i] * SLIDE_ROOM;
            SLIDE_EACH
            for (size_t k = 0; k < records; ++k) {
                seen[k] = (signal[k] - features->offset[i]) * features->factor[i];
                finite &= isfinite(seen[k]) != 0;
            }
        }
    }
    return finite;
}

void SLIDE_RECORD(path)(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                        const SlidePath *path) {
    const size_t records = path->records, size = count_states(cell, records);
    const double *features = path->features;
    double *states = path->states;
    for (size_t sample = 0; sample < path->n_samples; ++sample) {
        if (sample == 0 || !path->held) {
            prepare(cell, scratch, features, records);
        }
        for (size_t substep = 0; substep < cell->substeps; ++substep, states += size) {
            move(cell, scratch, features, records, states, states + size);
        }
        features += path->held ? 0 : cell->n_features * records;
    }
}

/* Add what a gradient gives by the transposed matrix of a part of the features. */
SLIDE_CALLED void pull_part(const SlideRecordCell *cell, const SlideRecordPart *part,
                            const double *of, size_t n_in, size_t records,
                            double *of_features) {
    double *to = of_features + (cell->n_factors + part->first) * records;
    const Product product = {part->transposed, n_in, of};
    if (part->count > 0) {
        sum_up(&(Sum){to, NULL, 1, {product}, part->count}, records, to);
    }
}

/* From weights of the values after a sample to the gradient by the states then, and by factors
 * and static features. */
SLIDE_CALLED void pull_values(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                        const double *features, const double *states, const double *weights,
                        size_t records, double *of_states, double *of_features) {
    const double *rows = scratch->rows;
    double *of_rows = scratch->of_rows;
    if (cell->n_factors > 0) {
        form_rows(cell, scratch, features, records, states);
    }
    for (size_t i = 0; i < cell->n_values; ++i, weights += records) {
        memcpy(of_rows, weights, records * sizeof *weights);
        rows += records, of_rows += records;
        for (size_t j = 0; j < cell->n_factors; ++j, rows += records, of_rows += records) {
            SLIDE_EACH
            for (size_t k = 0; k < records; ++k) {
                of_rows[k] = weights[k] * features[j * records + k];
                of_features[j * records + k] += weights[k] * rows[k];
            }
        }
    }
    const Product by_rows = {cell->rows_of_states.transposed, cell->n_rows, scratch->of_rows};
    pull_part(cell, &cell->to_rows, scratch->of_rows, cell->n_rows, records, of_features);
    sum_up(&(Sum){of_states, NULL, 1, {by_rows}, cell->n_states}, records, of_states);
}

/* The gradient by cosine and sine of what turned vectors give, the sine times a sign. */
SLIDE_CALLED void pull_turn(const SlideRecordCell *cell, const double *of_turned,
                            const double *vectors, double sign, size_t records,
                            double *of_features) {
    double *of_c = of_features + cell->n_factors * records, *of_s = of_c + records;
    for (size_t pair = 0; pair < cell->turned; ++pair) {
        const double *a = of_turned + 2 * pair * records, *b = a + records;
        const double *x = vectors + 2 * pair * records, *y = x + records;
        SLIDE_EACH
        for (size_t k = 0; k < records; ++k) {
            of_c[k] += a[k] * x[k] + b[k] * y[k];
            of_s[k] += sign * (b[k] * x[k] - a[k] * y[k]);
        }
    }
}

/* From the gradient by the values of units to that by their arguments; z are the arguments. */
SLIDE_CALLED void pull_activation(const SlideRecordCell *cell, size_t records, const double *z,
                            double *of_units) {
    const size_t n_units = cell->unit_panels * SLIDE_LANES;
    for (size_t unit = 0; unit < n_units; ++unit, z += records, of_units += records) {
        const bool cubic = cell->activation == SLIDE_CUBIC ||
                           (cell->activation == SLIDE_MIXED && unit % 2 == 0);
        const double bound = cell->activation == SLIDE_MIXED ? 8 : INFINITY;
        SLIDE_EACH
        for (size_t k = 0; cubic && k < records; ++k) {
            of_units[k] *= fabs(z[k]) <= bound ? 3 * z[k] * z[k] : 0;
        }
        SLIDE_EACH
        for (size_t k = 0; !cubic && k < records; ++k) {
            const double value = tanh_of(z[k]);
            of_units[k] *= 1 - value * value;
        }
    }
}

/* Of gated units: from the gradient by them to those by the gates' arguments and by what is offered
 * to them, in place. products: what is offered; spent, it is what the units are. */
static void pull_gates(size_t count, const double *open, double *products, double *of_units,
                       double *of_arguments) {
    SLIDE_EACH
    for (size_t i = 0; i < count; ++i) {
        of_arguments[i] = of_units[i] * products[i] * (1 - open[i] * open[i]);
        of_units[i] *= open[i];
        products[i] *= open[i];
    }
}

/* From the gradient by the states after a step to that by the states before it, in place. */
static void pull_step(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                      const double *features, const double *states, size_t records,
                      double *of_states, double *of_features) {
    const size_t n = cell->n_states, n_units = cell->unit_panels * SLIDE_LANES;
    const bool gated = cell->activation == SLIDE_GATED, turns = cell->turned > 0;
    double *of_units = scratch->of_units, *of_seen = scratch->of_seen, *zeros = scratch->driven;
    const double *pushed = of_states; /* the gradient by what the units push */
    pull_part(cell, &cell->to_states, of_states, n, records, of_features);
    offer(cell, scratch, features, records, states);
    if (turns) {
        turn_states(cell, features, -1, records, of_states, of_seen);
        pushed = of_seen;
    }
    memset(of_units, 0, n_units * records * sizeof *of_units);
    const Product by_pushed = {cell->states_of_units.transposed, n, pushed};
    sum_up(&(Sum){of_units, NULL, 1, {by_pushed}, n_units}, records, of_units);
    if (gated) {
        pull_gates(n_units * records, scratch->open, scratch->units, of_units,
                   scratch->of_arguments);
        pull_part(cell, &cell->to_gates, scratch->of_arguments, n_units, records, of_features);
    } else {
        pull_activation(cell, records, scratch->units, of_units);
    }
    pull_part(cell, &cell->to_units, of_units, n_units, records, of_features);
    memset(zeros, 0, count_states(cell, records) * sizeof *zeros);
    if (turns) {
        const Product by_units = {cell->states_of_units.plain, n_units, scratch->units};
        sum_up(&(Sum){zeros, NULL, 1, {by_units}, n}, records, scratch->pushed);
        pull_turn(cell, of_states, scratch->pushed, 1, records, of_features);
    }
    const Product by_units = {cell->units_of_states.transposed, n_units, of_units};
    const Product by_states = {cell->states_of_states.transposed, n, of_states};
    sum_up(&(Sum){zeros, NULL, 1, {by_units}, n}, records, of_seen);
    if (turns) {
        pull_turn(cell, of_seen, states, -1, records, of_features);
        turn_states(cell, features, 1, records, of_seen, of_seen);
    }
    sum_up(&(Sum){of_seen, NULL, 1, {by_states}, n}, records, of_seen);
    memcpy(of_states, of_seen, count_states(cell, records) * sizeof *of_states);
}

void SLIDE_RECORD(back)(const SlideRecordCell *cell, const SlideRecordScratch *scratch,
                        const SlidePath *path, const double *weights, double *of_states) {
    const size_t records = path->records, size = count_states(cell, records);
    const double *states = path->states + path->n_samples * cell->substeps * size;
    for (size_t sample = path->n_samples; sample-- > 0;) {
        const size_t place = path->held ? 0 : sample * cell->n_features * records;
        const double *features = path->features + place;
        double *of_features = path->of_features + place;
        if (weights != NULL) {
            pull_values(cell, scratch, features, states,
                        weights + sample * cell->n_values * records, records, of_states,
                        of_features);
        }
        if (!path->held || sample + 1 == path->n_samples) {
            prepare(cell, scratch, features, records);
        }
        for (size_t substep = 0; substep < cell->substeps; ++substep) {
            states -= size;
            pull_step(cell, scratch, features, states, records, of_states, of_features);
        }
    }
}
