/* What the last forecast of moving inputs missed, as a change of the outputs: as much may be missing now. */
#ifndef SLIDE_FORECAST_MISS_H
#define SLIDE_FORECAST_MISS_H

#include "state.h"

/* Outputs, scaled [n_outputs], of a recurrent network after the sample in model->taken, which its state does not
 * keep. False when one is not finite. */
bool slide_forecast_miss_outputs(const SlideModel *model, SlideNetworkState *state, double *outputs);

/* What the last forecast missed would change the outputs [n_outputs] so much, which a state gives with the newest
 * sample, in model->taken; the bound counts it. False when that is not finite. */
bool slide_forecast_miss_judge(const SlideModel *model, SlideState *state, SlideNetworkState *before,
                        const double *outputs);

/* The same of the phase at the present, where the last forecast missed far more than those before: at a kink. The
 * phase itself will show it, but a sample step later. */
bool slide_forecast_miss_surprise(const SlideModel *model, SlideState *state);

#endif
