/* The forecast of inputs: what they are expected to be at the end of a step, from what they were
 * until its start. tests/bounds/forecast_along.py has the same equations. */
#ifndef SLIDE_FORECAST_H
#define SLIDE_FORECAST_H

#include "history.h"
#include "payload.h"

enum { SLIDE_LOOKED = 32 }; /* points whose likeness tells a signal from independent values */

/* What does not change. Linear candidates stand beside the held value, of each input its own. */
typedef struct {
    uint32_t n_candidates, n_past, n_scored;
    uint32_t least_changes; /* of the last points scored, of an input that moves */
    double sample_step; /* s */
    bool jumps;         /* did inputs of the training jump between samples? */
    double *largest;    /* [n_inputs], the largest change in a sample step; of an angle its turn,
                           in rad, in the place of its cosine */
    double *weights;    /* [n_inputs][n_candidates][n_past], of u(t - i H) - u(t), i >= 1 */
    double *low, *high; /* [n_inputs], the range */
    double *past;       /* scratch [n_inputs]: the inputs of a point */
} SlideForecast;

/* What changes; part of the flat state block. The points are what the inputs were at times H apart,
 * until the newest communication point. */
typedef struct {
    double *spacing;  /* [1], H in s; 0: nothing is there */
    uint64_t *scored; /* [1], points whose errors were found */
    double *latest;   /* [n_inputs], the newest point */
    double *channels; /* [n_inputs][points], newest first, relative to the newest point; of an angle
                         its turns, in the place of its cosine */
    double *changes;  /* [n_inputs][n_candidates + 2], after the newest point: of the held value, the
                         candidates, a cubic */
    double *errors;   /* [n_inputs][n_candidates + 2][n_scored], of former ones, squared */
    uint64_t *best;   /* [n_inputs], the place of the choice among these that makes the forecast */
    bool *moves;      /* [n_inputs], does an input move smoothly from point to point, so that a
                         forecast is better than holding it? Both of an angle in its cosine's place */
    double *values;   /* of held inputs [n_inputs][SLIDE_LOOKED], the newest in place
                         scored % SLIDE_LOOKED */
    size_t size;      /* bytes of all */
} SlideForecastState;

void slide_forecast_place(SlideForecast *forecast, const SlidePayload *payload,
                          SlideArena *arena);
void slide_forecast_place_state(SlideForecastState *state, const SlideForecast *forecast,
                                uint32_t n_inputs, SlideArena *arena);

/* From one state to another of the same shape; of an empty one only that it is empty. */
void slide_forecast_copy(const SlideForecastState *from, SlideForecastState *to);

/* The newest communication point is the begin of the newest step of the history, whose length is H:
 * it shows how far the changes that were forecast for it are off. The points before it are read from
 * the history, where they are not H apart already. */
void slide_forecast_see(const SlideForecast *forecast, const SlideHistoryShape *shape,
                        const SlideHistory *history, SlideForecastState *state);

/* Are some inputs [n_inputs] others than these, but for rounding? */
bool slide_forecast_differ(const SlideForecast *forecast, const SlideHistoryShape *shape,
                           const double *some, const double *others);

/* Does any input go from some values to others faster than any did in the training: in a time (s)
 * further than there in as much of a sample step, and not by a little only? Where they jumped in the
 * training, they may go at once as far as there in a sample step. */
bool slide_forecast_jumps(const SlideForecast *forecast, const SlideHistoryShape *shape,
                          const double *from, const double *to, double time);

/* The newest points in a row, up to SLIDE_LOOKED - 1, each of which differs from the one before it; of
 * held inputs. */
uint64_t slide_forecast_n_changes(const SlideForecastState *state, size_t input);

/* Does the first of these changes go on as the next one, so that it may have taken a whole step? A jump does
 * not. */
bool slide_forecast_begins(const SlideForecastState *state, size_t input, uint64_t n_changes);

/* Did a held input begin to change in each step, so lately that it cannot be told whether it moves? */
bool slide_forecast_begins_to_change(const SlideForecastState *state, uint32_t n_inputs);

/* Do held inputs follow each other as samples of a signal that is too fast for a forecast, as a tone
 * does? Values that a controller draws or holds do not: they stay, or are independent. */
bool slide_forecast_hides(const SlideForecast *forecast, const SlideForecastState *state,
                          uint32_t n_inputs);

/* Is it unclear of a held input whether it moves smoothly? One that is held, while it leads on as a signal
 * with noise or jumps does, may be late by half a step; one that seems smooth, but is not at many points, may
 * be a walk of held values. */
bool slide_forecast_unclear(const SlideForecast *forecast, const SlideForecastState *state,
                            uint32_t n_inputs);

/* Did an input that moves go further from what was forecast than at the points before, by far? */
bool slide_forecast_surprised(const SlideForecast *forecast, const SlideHistoryShape *shape,
                              const SlideForecastState *state);

/* The inputs expected a time H after the newest point. The candidate whose forecasts of the last
 * n_scored inputs were the best makes it, if their mean square error is below half of that of the
 * held value; else the value is held. The cubic through the last four inputs makes it where its
 * error is below half of the best one's. Changes are at most the largest one, times H over the sample
 * step, and lead out of no range. An angle turns by its forecast turn, and its length stays. */
void slide_forecast(const SlideForecast *forecast, const SlideHistoryShape *shape,
                    const SlideForecastState *state, double *inputs);

#endif
