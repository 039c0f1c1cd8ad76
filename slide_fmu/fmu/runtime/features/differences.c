/* Inputs, their changes and the changes of these (slide_fmu/features/differences.py). */
#include "feature_set.h"

#include <string.h>

enum { MAX_ORDER = 2 };

static void read_order(SlideFeaturesView *view, SlideCursor *cursor) {
    const uint32_t order = slide_take_u32(cursor, "a set of features");
    view->n_signals = (uint64_t)view->n_inputs * ((uint64_t)order + 1);
    slide_check(cursor, order <= MAX_ORDER,
                "surrogate file: differences of order %u; expected at most %d", (unsigned)order,
                (int)MAX_ORDER);
}

/* Differences cancel: they are formed before anything is rounded. */
static void write_signals(const SlideFeatures *features, const double *input,
                          const double *before) {
    const size_t n = features->n_inputs, n_signals = features->n_signals;
    double *signals = features->signals;
    if (n_signals == n) {
        memcpy(signals, input, n * sizeof *input);
        return;
    }
    for (size_t i = 0; i < n; ++i) {
        double change = input[i] - before[i], change_before = before[i] - before[n + i];
        signals[i] = input[i];
        signals[n + i] = change;
        if (n_signals > 2 * n) {
            signals[2 * n + i] = change - change_before;
        }
    }
}

const SlideFeatureSet slide_differences = {
    .number = 1,
    .read = read_order,
    .write = write_signals,
};
