/* What networks have seen of the inputs: samples one sample step apart. Where communication steps
 * are shorter, each phase of time has its own: the next sample after one of them comes a sample
 * step later, and the steps in between go on with others. */
#ifndef SLIDE_PHASE_H
#define SLIDE_PHASE_H

#include "model.h"

typedef struct {
    SlidePhaseHead *head;
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
} SlidePhase;

/* All but the head, which lies in the front of the state. */
void slide_phase_place(SlidePhase *phase, const SlideModel *model, SlideArena *arena);

/* Bytes of all but the head, from samples.count on. */
size_t slide_phase_size(const SlideModel *model);

/* One becomes what another one is. */
void slide_phase_copy(const SlideModel *model, const SlidePhase *from, SlidePhase *to);

/* All bytes of one are 0, so that nothing depends on what was in it, but for what another one, if any,
 * has of a recurrent network: its truncation errors stay when it is restarted. */
void slide_phase_clear(const SlideModel *model, SlidePhase *phase, const SlidePhase *other);

/* A sample, scaled [n_inputs], and what the companion of the bound sees in its place; may be the same. */
typedef struct {
    const double *inputs, *others;
    bool strays; /* from the training: is what was set out of range? */
} SlideSample;

/* Forget all samples; this one counts for all. */
void slide_phase_restart(const SlideModel *model, SlidePhase *phase, SlideSample sample);

/* The predictor goes on by a sample, or does not look at it. Layers are evaluated only where their
 * values are wanted, in phase->given. False when a result is not finite. */
bool slide_phase_take(const SlideModel *model, SlidePhase *phase, SlideSample sample,
                     bool wanted);
void slide_phase_pass(const SlideModel *model, SlidePhase *phase, SlideSample sample);

/* The predictor looks at the sample taken in last until it has forgotten all else; so many times less. */
bool slide_phase_settle(const SlideModel *model, SlidePhase *phase, SlideSample sample,
                       uint64_t less);

/* The sample that counts for all before has no number of its own: so many that come next have numbers
 * until its own. */
void slide_phase_number_back(const SlideModel *model, SlidePhase *phase, uint64_t count);

/* From here on samples are open. */
void slide_phase_open(const SlideModel *model, SlidePhase *phase);

/* The open samples are taken back, and what estimate and bound saw of them. */
void slide_phase_take_back(const SlideModel *model, SlidePhase *phase);

/* The same of the newest of them only; where no state before so many is there, of all. Gives of how
 * many. */
uint64_t slide_phase_take_some_back(const SlideModel *model, SlidePhase *phase, uint64_t count);

/* Of the open samples only so many of the newest stay open; but all, where no state before them is
 * there. */
void slide_phase_know(const SlideModel *model, SlidePhase *phase, uint64_t n_open);

/* Back to how it was when it had its head and so many samples, and this state of a recurrent
 * predictor before the open ones: without these. */
void slide_phase_restore(const SlideModel *model, SlidePhase *phase, uint64_t count,
                        const SlideNetworkState *known);

/* The end of the newest sample that is not open. */
static inline double slide_phase_known_end(const SlideModel *model, const SlidePhase *phase) {
    return phase->head->end - (double)phase->head->n_open * model->step;
}

/* Samples that are not open; where none are that have numbers, all. */
static inline uint64_t slide_phase_n_known(const SlideModel *model, const SlidePhase *phase) {
    const uint64_t count = *phase->samples.count, known = count - phase->head->n_open;
    return known < model->samples.capacity ? count : known;
}

static inline const double *slide_phase_newest(const SlideModel *model, const SlidePhase *phase) {
    return slide_samples_at(&model->samples, &phase->samples, *phase->samples.count - 1);
}

#endif
