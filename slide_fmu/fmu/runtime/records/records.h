/* Whole records by a network of cells: one state for each record, never started anew. */
#ifndef SLIDE_RECORDS_H
#define SLIDE_RECORDS_H

#include "network.h"
#include "payload.h"
#include "record_kernel.h"

/* physical = offset + scale * scaled */
typedef struct {
    double offset, scale;
} SlideChannel;

typedef struct {
    const SlideNetwork *network;
    const SlideRecordKernel *kernel;
    size_t n_inputs;
    SlideChannel *inputs, *outputs; /* [n_inputs], [n_values] */
    /* Scratch. */
    SlidePoints points;
    SlideRecordCell cell;
    SlideRecordScratch scratch;
    float *seen;   /* features of a block */
    float *states; /* of the records that go together */
    float *values; /* of a block */
} SlideRecords;

/* Place what a network of cells needs for whole records; the network stays where it is. While the
 * arena measures, it is not usable. */
void slide_records_place(SlideRecords *records, const SlidePayload *payload,
                         const SlideNetwork *network, const SlideKernel *kernel,
                         SlideArena *arena);

/* Physical inputs [count][length][n_inputs] to outputs [count][length][n_values]; before a record,
 * its first input has been held for n_samples - 1 samples. False when a feature is not finite. */
bool slide_records_run(const SlideRecords *records, const double *inputs, size_t count,
                       size_t length, double *outputs);

#endif
