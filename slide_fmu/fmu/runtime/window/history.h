/* The communication steps of the past, and the input at any time in them. */
#ifndef SLIDE_HISTORY_H
#define SLIDE_HISTORY_H

#include "arena.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* What does not change. */
typedef struct {
    uint32_t n_inputs;
    uint64_t capacity; /* steps remembered */
    double shortest;   /* s; steps that are not longer together are joined */
    double slack;      /* s; a sample this little before a held input already has it */
    double sample_step; /* s */
    double reach;      /* s; nothing depends on inputs so long before the newest step */
    bool first_order;  /* all inputs move within all steps; else each may be held in some */
    bool jumps;        /* with first_order: may they jump in the midst of a step? (jumps.h) */
    const bool *cosine; /* [n_inputs]: this input and the next are cosine and sine of an angle, a
                           director: it turns at a constant rate */
    const double *low, *high; /* [n_inputs], the range */
} SlideHistoryShape;

/* Is an input held in a step, or with first_order on a straight line; does it seem to move smoothly;
 * or did the importer tell so? */
typedef enum { SLIDE_HELD, SLIDE_MOVED, SLIDE_TOLD } SlideMove;

/* What changes; part of the flat state block. A step has its length and what the inputs are at its
 * begin. What they are at its end is what the next step begins with. */
typedef struct {
    uint64_t *count;      /* steps so far, joined ones once; the newest in slot
                             (count - 1) % capacity */
    double *end;          /* [n_inputs], inputs at the end of the newest step */
    unsigned char *moved; /* [capacity][n_inputs], SlideMove, of a director that of its cosine */
    double *steps;        /* [capacity][1 + n_inputs]: length in s, physical inputs */
} SlideHistory;

/* For n_samples samples of the past and one communication step more; so many steps are told apart
 * in a sample step. */
SlideHistoryShape slide_history_shape(uint32_t n_inputs, uint32_t n_samples, double sample_step,
                                      uint32_t steps_per_sample, bool first_order, bool jumps,
                                      const bool *cosine, const double *low, const double *high);

/* The steps are the last thing placed and have this size in bytes. */
size_t slide_history_steps_size(const SlideHistoryShape *shape);

/* Count and end, which lie in the front of the state; and all else. */
void slide_history_place_end(SlideHistory *history, const SlideHistoryShape *shape,
                             SlideArena *arena);
void slide_history_place(SlideHistory *history, const SlideHistoryShape *shape, SlideArena *arena);

/* The newest step, and the one before it. Only after the first and second. */
double *slide_history_newest(const SlideHistoryShape *shape, const SlideHistory *history);
double *slide_history_before(const SlideHistoryShape *shape, const SlideHistory *history);

/* A step begins: its length in s, and its inputs, which are those at the end of the newest step.
 * The two steps before are joined where they are short. What the inputs are at its end is up to
 * who calls: history->end, and the flags of slide_history_moved. */
void slide_history_append(const SlideHistoryShape *shape, SlideHistory *history, double length,
                          const double *inputs);

/* Of so many of the newest steps it may turn out later that an input moved in them. */
enum { SLIDE_TOLD_LATER = 6 };

/* The newest two steps, as they were before a step was appended: it may have joined them. And what
 * inputs did in steps. */
typedef struct {
    double *steps;        /* [2][1 + n_inputs], newest first */
    unsigned char *moved; /* [SLIDE_TOLD_LATER][n_inputs] */
} SlideHistoryUndo;

void slide_history_place_undo(SlideHistoryUndo *undo, size_t n_inputs, SlideArena *arena);
void slide_history_prepare(const SlideHistoryShape *shape, const SlideHistory *history,
                           const SlideHistoryUndo *undo);

/* Once the history has its count again. */
void slide_history_undo(const SlideHistoryShape *shape, const SlideHistoryUndo *undo,
                        SlideHistory *history);

/* The step appended last is taken back; what was joined stays so. */
void slide_history_take_back(const SlideHistoryShape *shape, SlideHistory *history);

/* The length (s) of the newest step but so many. */
double slide_history_length(const SlideHistoryShape *shape, const SlideHistory *history,
                            uint64_t age);

/* Flags [n_inputs] of the newest step but so many. */
unsigned char *slide_history_moved(const SlideHistoryShape *shape, const SlideHistory *history,
                                   uint64_t age);

/* Steps that belong together, by their numbers. */
typedef struct {
    uint64_t first, end; /* the oldest, and the one after the newest */
} SlideHistorySpan;

/* The newest steps that a time before the begin of the newest one depends on: of n_samples samples.
 * The steps may be those of a copy of the block, at any alignment. */
SlideHistorySpan slide_history_needed(const SlideHistoryShape *shape, uint64_t count,
                                      const void *steps);

/* Copy the steps of a span, from the steps of one block to those of another. */
void slide_history_copy(const SlideHistoryShape *shape, SlideHistorySpan span, const void *from,
                        void *to);

/* Inputs that move, where a part (0 to 1) of the way is left. Linear; a director on the
 * shorter arc, of two equal ones on that which turns to the left, with its length linear. */
void slide_history_between(const SlideHistoryShape *shape, const double *from, const double *to,
                           double left, double *inputs);

/* How an input goes on from some values to others, or, of both of a director, its angle. */
static inline double slide_change_to(bool of_angle, const double *from, const double *to) {
    return of_angle ? atan2(from[0] * to[1] - from[1] * to[0], from[0] * to[0] + from[1] * to[1])
                    : to[0] - from[0];
}

static inline double slide_within(double value, double low, double high) {
    return value < low ? low : (value > high ? high : value);
}

/* Reads samples in the order of time. */
typedef struct {
    const SlideHistoryShape *shape;
    const SlideHistory *history;
    uint64_t at;  /* the step read last */
    double begin; /* s, its start; the present, the end of the newest step, is 0 */
    bool straight; /* do held inputs that move do so on lines, of which samples are the means? */
    double doubted; /* part of the corrections of inputs that move which may be wrong, where four steps in
                       a sample show how they do; with first_order, part of a jump that may come later */
} SlideReader;

SlideReader slide_history_reader(const SlideHistoryShape *shape, const SlideHistory *history);

/* A step by its number: its length in s and the inputs at its begin, [1 + n_inputs]; NULL where none is kept. */
const double *slide_history_step(const SlideReader *reader, uint64_t step);

/* The inputs that are set or reached at a time before the present (s, negative), or at it: where they
 * are held, those of the begin of the step, with first_order on a line to those of its end; where they
 * move smoothly, on a polynomial through both ends of the step and up to two points before. Before
 * the first step: its inputs. Times may only rise from call to call. */
void slide_history_at(SlideReader *reader, double time, double *inputs);

/* Of an input that changes within a sample: the first three. */
enum { SLIDE_MOMENTS = 3 };

/* Of what acts in a sample: inputs, corrected, moments and both edges. */
enum { SLIDE_ACTING = 2 + SLIDE_MOMENTS + 2 };

/* What acts on the networks in a sample, [n_inputs] each. */
typedef struct {
    double *inputs;    /* physical */
    double *corrected; /* of an input that moves: how much of it may be wrong, which is its correction or
                          a part of it (SlideReader.doubted), or, where it may have a kink, how much more
                          it would be if it had none; else 0 */
    double *moments;   /* [SLIDE_MOMENTS][n_inputs], of others, the means of (u - mean) s^n over the
                          sample, s = (t - middle) / h, n = 1, 2, ..: how much later than their mean they
                          come, how far apart, ..; of those with first_order, the first is what jumps
                          before the sample leave to it; else 0 */
    double *edges;     /* [2][n_inputs], of those that move smoothly, at the begin and at the end: the first
                          moment of a sample in which they would rise so fast throughout; else 0 */
} SlideActing;

/* The sample that acts from a time before the present (s, negative) for a sample step. With
 * first_order: the inputs at its end, and what jumps before it leave to it. Else what must be held for a sample step to have the effect
 * of the inputs in it: of held ones the mean over time, of a director the one at the begin; of those
 * that move smoothly the value in the middle, and what a hold loses of it: with u at begin, middle and
 * end (8 u_middle - u_begin - u_end) / 6, and the next order where there are steps enough. Times may
 * only rise. */
void slide_history_sample(SlideReader *reader, double begin, double end, const SlideActing *acting);

#endif
