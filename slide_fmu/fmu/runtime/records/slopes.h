/* How the outputs of whole records (records.h) move with all inputs: reverse mode, in double
 * precision. */
#ifndef SLIDE_SLOPES_H
#define SLIDE_SLOPES_H

#include "records.h"

typedef struct SlideSlopes SlideSlopes;

/* What the way back of records needs beside them; NULL when there is no memory for it. The records
 * stay where they are, and are used by one thread at a time. */
SlideSlopes *slide_slopes_open(const SlideRecords *records);
void slide_slopes_close(SlideSlopes *slopes);

/* From weights of all outputs of slide_records_run [count][length][n_values], the first input being
 * held for n_samples - 1 samples before each record, to the gradient of their weighted sum by the
 * inputs [count][length][n_inputs]; the list's stride is its length. False when a feature is not
 * finite, or when there is no memory. */
bool slide_slopes_run(const SlideSlopes *slopes, const SlideRecordList *list,
                      const double *weights, double *gradient);

#endif
