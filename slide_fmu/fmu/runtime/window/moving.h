/* Inputs that move within a communication step, where the importer gave their derivatives. */
#ifndef SLIDE_MOVING_H
#define SLIDE_MOVING_H

#include "history.h"

/* A step under inputs that move from given ones on. */
typedef struct {
    const double *given; /* [n_inputs], as they were set */
    const double *rates; /* [n_inputs], 1/s, their derivatives */
    double length;       /* s */
} SlideMovingStep;

/* What the inputs get to by its end. A director turns and grows at constant relative rates, which is
 * on the circle where its derivative is tangential. */
void slide_move_on(const SlideHistoryShape *shape, const SlideMovingStep *step, double *inputs);

#endif
