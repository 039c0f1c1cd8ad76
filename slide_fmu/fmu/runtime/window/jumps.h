/* Inputs that move may jump between samples, which are points of straight lines. In a communication step that
 * is shorter than a sample step, the jump is known better than that: samples after it make up for what the
 * line between two samples has too early or too late. When within its communication step the input jumped,
 * nobody knows. */
#ifndef SLIDE_JUMPS_H
#define SLIDE_JUMPS_H

#include "history.h"

/* What jumps before a sample leave to it, which ends at a time before the present (s, negative), is added to
 * acting->moments; and to acting->corrected, what of it the companion of a bound sees later. Only with
 * shape->jumps. */
void slide_jumps_add(const SlideReader *reader, double end, const SlideActing *acting);

#endif
