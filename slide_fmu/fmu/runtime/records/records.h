/* Whole records by a network of cells: one state for each record, never started anew. */
#ifndef SLIDE_RECORDS_H
#define SLIDE_RECORDS_H

#include "network.h"
#include "payload.h"
#include "record_kernel.h"

/* Records [length][n_inputs] of physical inputs, stride samples after each other: windows of one
 * record may overlap. */
typedef struct {
    const double *inputs;
    size_t count, length, stride;
} SlideRecordList;

/* Some of them that go together; where there are fewer than places, the last one fills them. */
typedef struct {
    SlideRecordList list;
    size_t places;
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

/* Whether the signals of a set are formed along records (record_signals.c). */
bool slide_records_know(const SlideFeatureSet *set);

/* Place what a network of cells needs for whole records; the network stays where it is. While the
 * arena measures, it is not usable. */
void slide_records_place(SlideRecords *records, const SlidePayload *payload,
                         const SlideNetwork *network, const SlideKernel *kernel,
                         SlideArena *arena);

/* The last n_given outputs of each record [count][n_given][n_values], physical, after its first
 * input has been held for n_held samples; 1 <= n_given <= length. False when a feature is not
 * finite. */
bool slide_records_run(const SlideRecords *records, const SlideRecordList *list, size_t n_held,
                       size_t n_given, double *outputs);

/* Inputs of a block from a sample on, scaled, and the signals of it; before a record, its first
 * input counts. Gives the block with its number of points. */
SlidePoints slide_records_look(const SlideRecords *records, const SlideGroup *group, size_t first,
                               size_t n_samples);

/* The cell of a network; the weights are those of the network itself. */
SlideRecordCell slide_records_cell(const SlideNetwork *network);

/* Room for the scratch of so many records whose numbers have so many bytes. */
void slide_records_place_scratch(SlideRecordScratch *scratch, const SlideRecordCell *cell,
                                 size_t places, size_t number, SlideArena *arena);

/* Records that go together from one on, at most so many: a power of two, or one. */
SlideGroup slide_records_group(const SlideRecords *records, const SlideRecordList *list,
                               size_t first, size_t together);

#endif
