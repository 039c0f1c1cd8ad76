/* Whole records by a network of cells: one state for each record, never started anew. */
#ifndef SLIDE_RECORDS_H
#define SLIDE_RECORDS_H

#include "network.h"
#include "payload.h"
#include "record_kernel.h"

/* Records that go together; where there are fewer than places, the last one fills them. */
typedef struct {
    size_t count, places; /* of records */
    size_t length;        /* samples of each */
    const double *inputs; /* of the first record, physical */
} SlideGroup;

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

/* Inputs of a block from a sample on, scaled, and the signals of it; before a record, its first
 * input counts. Gives the block with its number of points. */
SlidePoints slide_records_look(const SlideRecords *records, const SlideGroup *group, size_t first,
                               size_t n_samples);

/* The cell of a network; the weights are those of the network itself. */
SlideRecordCell slide_records_cell(const SlideNetwork *network);

/* Room for the scratch of so many records whose numbers have so many bytes. */
void slide_records_place_scratch(SlideRecordScratch *scratch, const SlideRecordCell *cell,
                                 size_t places, size_t number, SlideArena *arena);

/* Records that go together from a record on: all that are left, at most so many; or one. */
SlideGroup slide_records_group(const SlideRecords *records, const double *inputs, size_t count,
                               size_t length, size_t first, size_t together);

#endif
