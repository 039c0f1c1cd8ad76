/* The forecast of inputs that move: what they are expected to be at the end of a step, from what
 * they were until its start. slide_fmu/surrogate/input_forecast.py has the same equations. */
#ifndef SLIDE_FORECAST_H
#define SLIDE_FORECAST_H

#include "history.h"
#include "payload.h"

/* What does not change. Linear candidates stand beside the held value, of each input its own. */
typedef struct {
    uint32_t n_candidates, n_past, n_scored;
    double sample_step; /* s */
    double *largest;    /* [n_inputs], the largest change in a sample step; of an angle its turn,
                           in rad, in the place of its cosine */
    double *weights;    /* [n_inputs][n_candidates][n_past], of u(t - i H) - u(t), i >= 1 */
    double *low, *high; /* [n_inputs], the range */
    double *past;       /* scratch [most n_past + n_scored + 1][n_inputs]: inputs H apart, newest
                           first */
    double *channel;    /* scratch [the same], of one input, or the turns of an angle until the
                           newest */
} SlideForecast;

void slide_forecast_place(SlideForecast *forecast, const SlidePayload *payload,
                          SlideArena *arena);

/* The inputs expected a time H (s) after the end of the newest step. The candidate whose forecasts
 * of the last n_scored inputs were the best makes it, if their mean square error is below half of
 * that of the held value; else the value is held. The cubic through the last four inputs makes it
 * where its error is below half of the best one's. Changes are at most the largest one, times H over
 * the sample step, and lead out of no range. An angle turns by its forecast turn, and its length
 * stays. */
void slide_forecast(const SlideForecast *forecast, const SlideHistoryShape *shape,
                    const SlideHistory *history, double length, double *inputs);

#endif
