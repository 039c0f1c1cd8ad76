/* Inputs that move within a communication step, where the master gave their derivatives. */
#ifndef SLIDE_MOVING_H
#define SLIDE_MOVING_H

#include "history.h"

/* A step in parts that follow each other; in each the inputs have one value. Held inputs: parts one
 * sample step long, the first shorter or longer, with the value in their middle, so that the mean is
 * kept. First-order hold: one part, with the value at its end, which they reach. */
typedef struct {
    uint32_t count;
    double first, further; /* s, lengths of the first part and of each one after it */
    double taken_at;       /* where the value is taken, as a part of the length */
} SlideParts;

/* largest: number of parts after which older ones no longer matter; the first takes their place. */
SlideParts slide_parts(const SlideHistoryShape *shape, double length, double sample_step,
                       uint32_t largest);

double slide_part_length(const SlideParts *parts, uint32_t part);

/* The inputs of a step. */
typedef struct {
    const double *from;  /* first-order hold over several samples: what was reached before; or
                            NULL */
    const double *given; /* as they were set */
    const double *rates; /* 1/s, their derivatives, where they were given; or NULL */
    SlideParts parts;
} SlideStepInputs;

/* The inputs of a part of a step: as they were set, or moved on. A director turns and grows at
 * constant relative rates, which is on the circle where its derivative is tangential. */
void slide_step_part(const SlideHistoryShape *shape, const SlideStepInputs *inputs, uint32_t part,
                     double *result);

/* One of the samples that a step takes in, count of them, one sample step apart; so many are left
 * after it. */
void slide_step_sample(const SlideHistoryShape *shape, const SlideStepInputs *inputs,
                       uint32_t count, uint32_t left, double *sample);

#endif
