/* Phases of time: which of what networks have seen goes on to the present. */
#ifndef SLIDE_PHASES_H
#define SLIDE_PHASES_H

#include "state.h"

/* How many phases steps of a length (s) come through, if there is room for so many; else 0. */
uint64_t slide_phases_of(const SlideModel *model, double length);

/* What networks have seen goes on to a time (s of the inner one), which may be before the present by
 * two sample steps: the samples up to it are taken in, those that end after the last communication
 * point, or at least so many, as open ones. It is in state->phases[*place]. False when a result is not
 * finite; then what was seen in this phase is forgotten, and is taken in anew from the history when it
 * is needed again. */
bool slide_phases_reach(const SlideModel *model, SlideState *state, double time,
                        uint64_t least_open, size_t *place);

/* Is the phase of a time kept, or may it begin with what was before the first step? */
bool slide_phases_have(const SlideModel *model, SlideState *state, double time);

/* A step failed: the front of the state and what networks have seen are what they were before it. A
 * phase of which this is not known any more is empty. */
void slide_phases_undo(const SlideModel *model, SlideState *state);

/* To do the last step again, all samples are taken in anew. */
void slide_phases_note_nothing(SlideState *state);

/* An output turns out to be another one than was given, by so much: into the mean square of such
 * changes lately. */
void slide_phases_judge(double *mean, double change);

#endif
