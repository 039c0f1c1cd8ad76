/* A step that is no whole number of samples ends between the samples that networks have seen. They
 * would have to see all of the window anew. But the next such step may end a whole number of samples
 * after an earlier one, as the second of two half steps does. So what they have seen is put aside,
 * and that step goes on from there. Only where inputs are those of the step's end, or are held. */
#ifndef SLIDE_ASIDE_H
#define SLIDE_ASIDE_H

#include "state.h"

/* A step of a length in s begins, and slide_aside_keep was called before: what it goes on from comes
 * to where networks look for it, and state->head->resumed says so. Before a step for which all
 * samples are taken anew, what they have seen is put aside. */
void slide_aside_begin(const SlideModel *model, SlideState *state, double length);

/* Keep what is aside, and go back to it when a step has failed. The rest of the state stays. */
void slide_aside_keep(const SlideState *state);
void slide_aside_undo(const SlideState *state);

/* Samples that the last step took in, if it went on from what was aside; or 0. A damaged state may
 * hold any number. */
static inline uint32_t slide_aside_resumed(const SlideModel *model, const SlideState *state) {
    const double resumed = state->head->resumed;
    return resumed > 0 && resumed < model->memory_length ? (uint32_t)resumed : 0;
}

/* A step of so many samples, which did not begin here, was taken. */
static inline void slide_aside_pass(SlideState *state, double samples) {
    if (state->head->aside > 0) {
        state->head->aside += samples;
    }
}

#endif
