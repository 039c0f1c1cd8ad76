/* What the way back of records holds: slopes_layout.c places it. */
#ifndef SLIDE_SLOPES_LAYOUT_H
#define SLIDE_SLOPES_LAYOUT_H

#include "slopes.h"

struct SlideSlopes {
    unsigned char *block;
    const SlideRecords *records;
    SlideRecordCell cell;
    SlideRecordScratch scratch;
    SlidePoints points; /* those of the records, with gradients */
    SlidePath held;     /* the samples before a record, held */
    SlidePath path;     /* of a block */
    double *weights;    /* of the values of a block */
    double *of_states;
};

#endif
