/* Steps of inputs that move: they are set to what they are at the start, and what they become by
 * the end is forecast. With the true values at the next step, what was only forecast is taken
 * back. */
#ifndef SLIDE_FORECAST_STEP_H
#define SLIDE_FORECAST_STEP_H

#include "stream.h"

/* One step of a length (s). False when a result is not finite; then nothing has changed. */
bool slide_forecast_step(const SlideModel *model, SlideState *state, double length);

/* What the estimator or the bound found of the samples below a number; part of what networks have
 * seen. */
typedef struct {
    uint64_t *known; /* the number; the rest follows it */
    size_t size;     /* bytes from known on */
} SlideFound;

/* The number of samples that stay when the last forecast is taken back; 0 where none of them does,
 * or nothing is forecast. */
uint64_t slide_forecast_known(const SlideModel *model, const SlideState *state);

/* What was found of these stays too. */
void slide_forecast_keep(const SlideState *state, SlideFound found);

/* Parts of any step, in stream.c. */

/* What derivatives need of the state is kept, before what the inputs that were set change. */
void slide_step_keep(const SlideModel *model, SlideState *state);

/* A step of a length (s) begins. Derivatives of the inputs count for this step only. */
void slide_step_begin(const SlideModel *model, SlideState *state, double length);

/* What is known of the time before the start is taken in. */
bool slide_step_begin_run(const SlideModel *model, SlideState *state);

/* The predictor goes on by what is taken in; or by samples that were forecast before. */
bool slide_step_take(const SlideModel *model, SlideState *state, const SlideIntake *intake);
bool slide_step_take_again(const SlideModel *model, SlideState *state, const SlideIntake *intake);

/* The results become the outputs; then the step counts. */
void slide_step_accept(const SlideModel *model, SlideState *state);
void slide_step_count(const SlideModel *model, SlideState *state, double length);

#endif
