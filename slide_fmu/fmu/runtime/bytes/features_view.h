/* Reader of the features of a network in a surrogate file; byte contract:
 * slide_fmu/network/bytes.py, signals of the sets: slide_fmu/features/base.py. */
#ifndef SLIDE_FEATURES_VIEW_H
#define SLIDE_FEATURES_VIEW_H

#include "reading.h"

typedef enum { SLIDE_DIFFERENCES = 1, SLIDE_DIRECTOR = 2, SLIDE_CHAIN_MOTION = 3 } SlideSet;

/* A serial chain; all numbers f64, finite. */
typedef struct {
    double step;                                      /* s */
    const unsigned char *middle, *half_range;         /* [n] rad */
    const unsigned char *a, *d, *alpha, *masses;      /* [n] */
    const unsigned char *centres, *inertias;          /* [n][3], [n][3][3] */
    const unsigned char *gravity, *tool;              /* [3] */
} SlideChainView;

/* All pointers point into the bytes that were read; their extent has been checked. */
typedef struct {
    uint32_t set; /* SlideSet */
    uint32_t order, n_inputs;
    uint64_t n_signals;
    SlideChainView chain;         /* of set SLIDE_CHAIN_MOTION */
    SlideIndices chosen;          /* signals of the set */
    const unsigned char *offset;  /* f64 [chosen.count] */
    const unsigned char *scale;   /* the same, positive */
} SlideFeaturesView;

void slide_features_read(SlideFeaturesView *features, uint32_t n_inputs, SlideCursor *cursor);

#endif
