/* Inputs that move within a communication step, where the importer gave their derivatives. */
#ifndef SLIDE_MOVING_H
#define SLIDE_MOVING_H

#include "history.h"

/* A step of a length under inputs that move from given ones on. */
typedef struct {
    double length;       /* s */
    const double *given; /* [n_inputs], as they were set */
    const double *rates; /* [n_inputs], 1/s, their derivatives */
    double sample_step;  /* s */
    uint32_t largest;    /* number of parts after which older ones no longer matter; the first
                            takes their place */
} SlideMovingStep;

/* Inputs that were given, at a time (s) after that. */
void slide_move_on(const SlideHistoryShape *shape, const SlideMovingStep *step, double time,
                   double *inputs);

/* The step becomes the newest of the history. Held inputs: in parts one sample step long, the
 * first shorter or longer, each with the value in its middle, so that the mean is kept.
 * First-order hold: as one part, with the value at its end, which the inputs reach. A director
 * turns and grows at constant relative rates, which is on the circle where its derivative is
 * tangential. inputs: room for those of a part. */
void slide_append_moving(const SlideHistoryShape *shape, SlideHistory *history,
                         const SlideMovingStep *step, double *inputs);

#endif
