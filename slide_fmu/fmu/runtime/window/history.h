/* The communication steps of the past, and the input at any time in them. */
#ifndef SLIDE_HISTORY_H
#define SLIDE_HISTORY_H

#include "arena.h"

#include <stdbool.h>
#include <stdint.h>

/* What does not change. */
typedef struct {
    uint32_t n_inputs;
    uint64_t capacity; /* steps remembered, a power of two */
    double shortest;   /* s; zero-order hold: a shorter step is joined to the one after it;
                          first-order hold: steps are joined that are not longer together */
    double slack;      /* s; a sample this little before a held input already has it */
    bool first_order;  /* inputs move and reach their value at the end of the step */
    const bool *cosine; /* [n_inputs]: this input and the next are cosine and sine of an angle, a
                           director: it turns at a constant rate */
} SlideHistoryShape;

/* What changes; part of the flat state block. */
typedef struct {
    uint64_t *count; /* [3]: steps so far, joined ones once, the newest in slot
                        (count - 1) % capacity; and those at each of the two marks */
    double *before;  /* [2][2][1 + n_inputs], of each mark the newest step before it, and the place
                        after that */
    double *steps;   /* [capacity][1 + n_inputs]: length in s, physical inputs */
} SlideHistory;

/* So many steps are told apart in each sample of the past. Scalar sources may be compiled with
 * fewer, at least 2, to need less memory. */
#if !defined(SLIDE_STEPS_PER_SAMPLE)
#define SLIDE_STEPS_PER_SAMPLE 32
#endif

/* For n_samples samples of the past; a sample step of them holds 32 steps at most, held ones
 * longer than 1/32 of it, of a first-order hold any two after each other longer than 1/16. There
 * is room for n_samples + 1 more: a communication step that appends as many and is then taken back
 * has written over nothing that these samples depend on. */
SlideHistoryShape slide_history_shape(uint32_t n_inputs, uint32_t n_samples, double sample_step,
                                      bool first_order, const bool *cosine);

/* The count, then the steps, which are the last thing placed and have this size in bytes. */
size_t slide_history_steps_size(const SlideHistoryShape *shape);

/* The same if the runtime were compiled with so many SLIDE_STEPS_PER_SAMPLE. */
size_t slide_history_size_with(uint32_t n_inputs, uint32_t n_samples, uint32_t steps_per_sample);

void slide_history_place(SlideHistory *history, const SlideHistoryShape *shape, SlideArena *arena);

/* Take in a step of this length under these inputs. Unless it goes on from the step appended last,
 * it is joined to the one before where that is short (shape->shortest), whose inputs are then
 * forgotten, or where both hold the same inputs; but never to the first of all. */
void slide_history_append(const SlideHistoryShape *shape, SlideHistory *history, double length,
                          const double *inputs, bool goes_on);

/* From where on what is appended can be taken back: from the last communication step on, or, where
 * that also brings the true end of the step before, from what is only forecast on. */
typedef enum { SLIDE_MARK_STEP, SLIDE_MARK_FORECAST } SlideMark;

/* Set a mark: slide_history_go_back takes back all that is appended from here on. All that samples
 * depend on is then as it was, to the bit; with `whole`, also the oldest step of a full ring, which
 * the next one writes over. A mark is lost where one goes back before it. */
void slide_history_begin(const SlideHistoryShape *shape, SlideHistory *history, SlideMark mark,
                         bool whole);
void slide_history_go_back(const SlideHistoryShape *shape, SlideHistory *history, SlideMark mark);

/* Steps that belong together, by their numbers. */
typedef struct {
    uint64_t first, end; /* the oldest, and the one after the newest */
} SlideHistorySpan;

/* All steps that are remembered; and the newest of them that a time (s) before the present depends
 * on. The steps may be those of a copy of the block, at any alignment. */
SlideHistorySpan slide_history_all(const SlideHistoryShape *shape, uint64_t count);
SlideHistorySpan slide_history_since(const SlideHistoryShape *shape, uint64_t count,
                                     const void *steps, double time);

/* Copy the steps of a span, from the steps of one block to those of another. */
void slide_history_copy(const SlideHistoryShape *shape, SlideHistorySpan span, const void *from,
                        void *to);

/* Inputs that move, where a part (0 to 1) of the way is left. Linear; a director on the
 * shorter arc, of two equal ones on that which turns to the left, with its length linear. */
void slide_history_between(const SlideHistoryShape *shape, const double *from, const double *to,
                           double left, double *inputs);

/* Inputs of the newest step. Only after the first. */
const double *slide_history_newest(const SlideHistoryShape *shape, const SlideHistory *history);

/* Reads samples in the order of time. */
typedef struct {
    const SlideHistoryShape *shape;
    const SlideHistory *history;
    uint64_t at;  /* the step read last */
    double begin; /* s, its start; the present, the end of the newest step, is 0 */
} SlideReader;

SlideReader slide_history_reader(const SlideHistoryShape *shape, const SlideHistory *history);

/* The sample that acts from a time before the present (s, negative) for a sample step: the input
 * there when inputs are held, or the input reached at its end. Before the first step: its inputs.
 * Times may only rise from call to call. */
void slide_history_sample(SlideReader *reader, double begin, double end, double *inputs);

/* Samples, of the newest n_samples up to the present, since a held input last changed within one
 * of them, which has its value at the start; infinite where none changed so. */
double slide_history_since_mixed(const SlideHistoryShape *shape, const SlideHistory *history,
                                 double sample_step, double n_samples);

#endif
