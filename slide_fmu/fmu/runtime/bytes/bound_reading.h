/* Reader of the error bound in a surrogate file, the section BOUN and what follows it. The byte
 * contract is in slide_fmu/surrogate/payload.py, the writer slide_fmu/surrogate/bound_payload.py. */
#ifndef SLIDE_BOUND_READING_H
#define SLIDE_BOUND_READING_H

#include "payload.h"

/* Take the section of a surrogate whose predictor, window and outputs have been read. */
void slide_bound_read(SlidePayload *payload, SlideCursor *file);

/* Take the section SPAN after it, the error estimate of a surrogate without an estimator. */
void slide_span_read(SlidePayload *payload, SlideCursor *file);

/* After all: the head gives a local scale of each output and, with SPAN, its expected error too. */
void slide_bound_check_head(const SlidePayload *payload, const SlideBoundView *view,
                            SlideCursor *file);

#endif
