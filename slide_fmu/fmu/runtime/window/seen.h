/* What networks have seen of the inputs: samples one sample step apart. Where communication steps
 * are shorter, each phase of time has its own: the next sample after one of them comes a sample
 * step later, and the steps in between go on with others. */
#ifndef SLIDE_SEEN_H
#define SLIDE_SEEN_H

#include "model.h"

typedef struct {
    SlideSeenHead *head;
    SlideSamples samples;
    SlideSamples others; /* the same as the companion of the bound sees them, where it sees others */
    SlideNetworkState predictor;
    SlideNetworkState known; /* of recurrent networks: as it was before the open samples; and, of held
                                inputs, before the newest ones, by their numbers % SLIDE_SPREAD */
    SlideNetworkState later[SLIDE_SPREAD];
    float *given; /* [n_outputs], what the predictor gave after the newest sample, scaled */
    double *revised; /* [n_outputs], mean squares of what became of the outputs lately, when it was known
                        how held inputs went on, relative to their scales */
    double *kept; /* [SLIDE_SPREAD + 1][SLIDE_ACTING][n_inputs], what acts in the oldest open samples and in
                     the one before them, newest first: it stays as it is */
    SlideEstimate estimate; /* this and the bound: at most until the open samples, or, where sample 0
                               is one of them, until the last */
    SlideBoundState bound;
} SlideSeen;

void slide_seen_place(SlideSeen *seen, const SlideModel *model, SlideArena *arena);

/* Bytes from the head to the end. */
size_t slide_seen_size(const SlideModel *model);

/* One becomes what another one is. */
void slide_seen_copy(const SlideModel *model, const SlideSeen *from, SlideSeen *to);

/* All bytes of one are 0, so that nothing depends on what was in it, but for what another one, if any,
 * has of a recurrent network: its truncation errors stay when it is restarted. */
void slide_seen_clear(const SlideModel *model, SlideSeen *seen, const SlideSeen *other);

/* A sample, scaled [n_inputs], and what the companion of the bound sees in its place; may be the same. */
typedef struct {
    const double *inputs, *others;
    bool strays; /* from the training: is what was set out of range? */
} SlideSample;

/* Forget all samples; this one counts for all. */
void slide_seen_restart(const SlideModel *model, SlideSeen *seen, SlideSample sample);

/* The predictor goes on by a sample, or does not look at it. Layers are evaluated only where their
 * values are wanted, in seen->given. False when a result is not finite. */
bool slide_seen_take(const SlideModel *model, SlideSeen *seen, SlideSample sample,
                     bool wanted);
void slide_seen_pass(const SlideModel *model, SlideSeen *seen, SlideSample sample);

/* The predictor looks at the sample taken in last until it has forgotten all else; so many times less. */
bool slide_seen_settle(const SlideModel *model, SlideSeen *seen, SlideSample sample,
                       uint64_t less);

/* The sample that counts for all before has no number of its own: so many that come next have numbers
 * until its own. */
void slide_seen_number_back(const SlideModel *model, SlideSeen *seen, uint64_t count);

/* From here on samples are open. */
void slide_seen_open(const SlideModel *model, SlideSeen *seen);

/* The open samples are taken back, and what estimate and bound saw of them. */
void slide_seen_take_back(const SlideModel *model, SlideSeen *seen);

/* The same of the newest of them only; where no state before so many is there, of all. Gives of how
 * many. */
uint64_t slide_seen_take_some_back(const SlideModel *model, SlideSeen *seen, uint64_t count);

/* Of the open samples only so many of the newest stay open; but all, where no state before them is
 * there. */
void slide_seen_know(const SlideModel *model, SlideSeen *seen, uint64_t n_open);

/* Back to how it was when it had this head and so many samples, and this state of a recurrent
 * predictor before the open ones: without these. */
void slide_seen_restore(const SlideModel *model, SlideSeen *seen, const SlideSeenHead *head,
                        uint64_t count, const SlideNetworkState *known);

/* The end of the newest sample that is not open. */
static inline double slide_seen_known_end(const SlideModel *model, const SlideSeen *seen) {
    return seen->head->end - (double)seen->head->n_open * model->step;
}

/* Samples that are not open; where none are that have numbers, all. */
static inline uint64_t slide_seen_n_known(const SlideModel *model, const SlideSeen *seen) {
    const uint64_t count = *seen->samples.count, known = count - seen->head->n_open;
    return known < model->samples.capacity ? count : known;
}

static inline const double *slide_seen_newest(const SlideModel *model, const SlideSeen *seen) {
    return slide_samples_at(&model->samples, &seen->samples, *seen->samples.count - 1);
}

#endif
