/* Whole records, many of them side by side: number k of an array belongs to record k of those that
 * go together. The files record_forward.c, record_signals.c and record_back.c are compiled once
 * per instruction set, as kernel.c is; record_choice.c has the table for a kernel. */
#ifndef SLIDE_RECORD_KERNEL_H
#define SLIDE_RECORD_KERNEL_H

#include "feature_set.h"
#include "kernel.h"

#include <stdbool.h>

enum {
    SLIDE_TOGETHER = 32,      /* the most records that go together in single precision */
    SLIDE_TOGETHER_EXACT = 8, /* the same in double precision */
    SLIDE_FEWEST = 4,         /* the fewest that do; those and the most by powers of two, or one */
    SLIDE_POINTS = 512,       /* samples of a block, those of all its records counted */
    SLIDE_LEAD = SLIDE_BEFORE * SLIDE_TOGETHER, /* room for those before a block */
    SLIDE_ROOM = SLIDE_LEAD + SLIDE_POINTS + 8  /* and for a register that ends behind it */
};

/* Before loops over numbers that lie one after the other: a register at a time is enough, and
 * several would make libraries larger. */
#if defined(__clang__)
#define SLIDE_EACH _Pragma("clang loop interleave(disable) unroll(disable)")
#else
#define SLIDE_EACH
#endif

/* Inputs or signals of a block [][SLIDE_ROOM]: first those of the first sample of all records;
 * those of the sample before lie so many numbers before these, down to SLIDE_LEAD. */
typedef struct {
    size_t records;  /* that go together */
    size_t n_points; /* samples times records, at most SLIDE_POINTS */
    double *inputs;  /* scaled, from SLIDE_LEAD on; SLIDE_BEFORE samples before are there too */
    double *signals; /* from SLIDE_LEAD on; others are scratch */
    double *of_inputs, *of_signals; /* gradients by them; on the way back only */
    double *scratch;                /* [n_signals][8] and [SLIDE_ROOM]; on the way back only */
} SlidePoints;

/* A matrix times some of the features, plus constants; numbers are of the cell's precision. */
typedef struct {
    size_t first, count;    /* the features: the first one, and how many follow each other */
    const void *weights;    /* in panels of count columns */
    const void *constants;  /* in a panel of one column */
    const void *transposed; /* the weights; on the way back only */
} SlideRecordPart;

/* A matrix in panels, and the transposed one; on the way back only. */
typedef struct {
    const void *plain, *transposed;
} SlideRecordMatrix;

/* A cell (kernel.h) whose numbers are of either precision. */
typedef struct {
    size_t n_states, n_rows, n_values, n_factors, n_features, substeps, turned;
    size_t unit_panels, state_panels, row_panels;
    uint32_t activation;
    SlideRecordPart to_gates, to_units, to_states, to_rows;
    SlideRecordMatrix units_of_states, states_of_states, states_of_units, rows_of_states;
} SlideRecordCell;

/* Scratch of a cell, in its precision: rows of a vector times the records that go together. */
typedef struct {
    void *open, *offered, *units, *cubes; /* of the units */
    void *driven, *seen, *pushed, *next;  /* of a state */
    void *rows;                           /* of the values */
    void *of_units, *of_arguments, *of_seen, *of_rows; /* gradients; on the way back only */
} SlideRecordScratch;

/* Some samples of a cell in double precision. */
typedef struct {
    size_t records, n_samples;
    bool held;         /* all samples have the features of the first */
    double *features;  /* [n_samples][n_features][records], or of the first alone */
    double *of_features; /* the gradient by them, and SLIDE_LANES more rows behind the last */
    double *states;    /* [n_samples * substeps + 1][state_panels][SLIDE_LANES][records] */
} SlidePath;

/* The functions that are compiled as often as there are kernels, and their table. */
#define SLIDE_RECORD_FUNCTIONS(DO, kernel)                                                        \
    DO(kernel, void, signals, (const SlideFeatures *features, const SlidePoints *points))         \
    DO(kernel, bool, see,                                                                         \
       (const SlideFeatures *features, const SlidePoints *points, float *seen))                   \
    DO(kernel, void, run,                                                                         \
       (const SlideRecordCell *cell, const SlideRecordScratch *scratch, size_t records,           \
        const float *features, size_t n_samples, float *states, float *values))                   \
    DO(kernel, void, settle,                                                                      \
       (const SlideRecordCell *cell, const SlideRecordScratch *scratch, size_t records,           \
        const float *features, size_t n_samples, float *states))                                  \
    DO(kernel, bool, see_exact,                                                                   \
       (const SlideFeatures *features, const SlidePoints *points, double *seen))                  \
    DO(kernel, void, path,                                                                        \
       (const SlideRecordCell *cell, const SlideRecordScratch *scratch, const SlidePath *path))   \
    DO(kernel, void, back,                                                                        \
       (const SlideRecordCell *cell, const SlideRecordScratch *scratch, const SlidePath *path,    \
        const double *weights, double *of_states))                                                \
    DO(kernel, void, pull_signals, (const SlideFeatures *features, const SlidePoints *points))

/* - signals: form the signals of a block from its inputs.
 * - see: what a network sees of them, [sample][features->count][records]. False when one is not
 *   finite in single precision. see_exact: the same in double precision.
 * - run: advance states [state_panels][SLIDE_LANES][records] by the features of a block; values
 *   [sample][n_values][records].
 * - settle: the same over n_samples samples with the same features, without values.
 * - path: the states after every step, in double precision, from the first ones on.
 * - back: from weights of the values [sample][n_values][records], or none, and from the gradient
 *   by the states at the end to that by the states before, in place, and by the features, which is
 *   added.
 * - pull_signals: from the gradient by the signals, which is spent, to that by the inputs, which is
 *   added; after signals for the same inputs. */
#define SLIDE_RECORD_MEMBER(kernel, result, name, arguments) result(*name) arguments;
typedef struct {
    SLIDE_RECORD_FUNCTIONS(SLIDE_RECORD_MEMBER, )
} SlideRecordKernel;

#define SLIDE_RECORD_DECLARE(kernel, result, name, arguments) result kernel##_##name arguments;
SLIDE_RECORD_FUNCTIONS(SLIDE_RECORD_DECLARE, slide_kernel_baseline)
SLIDE_RECORD_FUNCTIONS(SLIDE_RECORD_DECLARE, slide_kernel_avx2)
SLIDE_RECORD_FUNCTIONS(SLIDE_RECORD_DECLARE, slide_kernel_avx512)

/* What defines one of them says SLIDE_RECORD(run) for its name. */
#define SLIDE_RECORD_JOINED(kernel, name) kernel##_##name
#define SLIDE_RECORD_NAME(kernel, name) SLIDE_RECORD_JOINED(kernel, name)
#define SLIDE_RECORD(name) SLIDE_RECORD_NAME(SLIDE_KERNEL, name)

/* The functions for the processor that a kernel is for. */
const SlideRecordKernel *slide_record_kernel(const SlideKernel *kernel);

#endif
