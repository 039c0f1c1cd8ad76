/* A step that is no whole number of samples ends between the samples that networks have seen. They
 * would have to see all of the window anew. But the next such step may end a whole number of samples
 * after an earlier one, as the second of two half steps does. So what they have seen is put aside
 * before each such step, and the next one may go on from there. Only where inputs are held, or are
 * those of the step's end. */
#ifndef SLIDE_ASIDE_H
#define SLIDE_ASIDE_H

#include "state.h"

/* A step of a length in s begins. Where it goes on from what is aside, this comes to where networks
 * look for it, and state->head->resumed says so; slide_aside_keep was called before such a step. */
void slide_aside_begin(const SlideModel *model, SlideState *state, double length);

/* Keep what is aside before a step that may change it, and go back to it when that has failed. The
 * rest of the state stays. */
void slide_aside_keep(const SlideState *state);
void slide_aside_undo(const SlideState *state);

/* Samples that the last step took in, if it went on from what was aside; or 0. A damaged state may
 * hold any number. */
uint32_t slide_aside_resumed(const SlideModel *model, const SlideState *state);

/* So many samples, one by one or together, come after what is aside. Called before parameters that
 * were set count as those behind the outputs: what is aside knows former ones only. */
void slide_aside_pass(const SlideModel *model, SlideState *state, double samples);

#endif
