/* Outputs at times between the phases of which it is kept what networks have seen. */
#ifndef SLIDE_INTERPOLATION_H
#define SLIDE_INTERPOLATION_H

#include "state.h"

/* Are outputs at the present to be interpolated? Where steps of the last length come through too many
 * phases; or where no phase leads here and too many took in all their samples anew, as under steps of
 * many lengths. By a network whose state tells what it has seen, and if there are phases enough. */
bool slide_interpolation_serves(const SlideModel *model, SlideState *state);

/* Outputs at the present, scaled, to outputs [n_outputs], by a cubic through four of the phases that
 * divide a sample step evenly. Of inputs that move they are given by the sample that ends now, after the
 * state that lies between those of these phases a sample step ago; of held ones by phases around the present,
 * as if inputs went on as they do now. In state->phases[*place] is the phase that ends last before the present, or of
 * held inputs first after it.
 * False when a result is not finite. */
bool slide_interpolation_reach(const SlideModel *model, SlideState *state, size_t *place,
                         double *outputs);

#endif
