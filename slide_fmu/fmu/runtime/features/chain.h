/* A serial chain as features see it: its links, how its joints follow their set points, and the
 * loads of its motion on its base. Shared by those who form the signals of single steps
 * (chain_motion.c) and of whole records (records/record_chain.h). */
#ifndef SLIDE_CHAIN_H
#define SLIDE_CHAIN_H

#include "chain_body.h"
#include "feature_set.h"

/* Signals: their places, those of joint rates after the tool's position. */
enum {
    WRENCH = 0,
    WRENCH_CHANGE = 6,
    POSITION = 12,
    RATES = 15 /* n_joints; then as below, with n_joints added */
};
enum {
    FRAME = 15,
    TURNED_WRENCH_CHANGE = 17,
    TURNED_INERTIA = 23,
    TURNED_MOMENTUM = 32,
    N_SIGNALS = 38
};

typedef struct {
    void (*write)(const SlideFeatures *features, const double *input, const double *before);
    size_t n_joints;
    double mass;
    double first[2];       /* cosine and sine of the first joint where its place is 0 */
    const double *law;     /* [4] weights of the newest and the oldest of three set points in the
                              place, and of the newest in rate and acceleration */
    const double *gravity; /* [3] */
    const double *tool;    /* [3], in the last link's frame */
    Link *links;
    struct Joint *joints; /* scratch for the motions of any register */
} Chain;

/* How a joint follows three set points. */
SLIDE_INLINE void set_joint(const Chain *chain, size_t i, Motions after, Motions between,
                            Motions first, Joint *joint) {
    const Link *link = &chain->links[i];
    const double *law = chain->law;
    const Motions newest = each(law[0]), oldest = each(law[1]);
    const Motions rate = each(law[2]), rest = each(1 - law[2]), curvature = each(law[3]);
    const Motions newer = after - between, older = between - first;
    const Motions at = between + (newest * newer - oldest * older);
    joint->rate = each(link->rate) * (rate * newer + rest * older);
    joint->acceleration = each(link->acceleration) * (curvature * (newer - older));
    joint->slide = each(link->slide_middle) + each(link->slide_half_range) * at;
    joint->turned = turn_by(each(link->middle) + each(link->half_range) * at);
}

/* The whole chain, seen from axes that turn with its first joint, and the turn of these axes. */
SLIDE_INLINE Turn gather_body(const Chain *chain, Joint *joints, Body *body) {
    const Turn first = joints[0].turned;
    *body = (Body){0};
    joints[0].turned = (Turn){each(chain->first[0]), each(chain->first[1])};
    for (int i = X; i <= Z; ++i) {
        body->tool[i] = each(chain->tool[i]);
    }
    for (size_t i = chain->n_joints; i-- > 0;) {
        pass(&chain->links[i], &joints[i], body);
    }
    joints[0].turned = first;
    return first;
}

/* Force and moment on the base, in its axes; weight is added where it does not turn. The body's
 * own are spent. */
SLIDE_INLINE void weigh(const Chain *chain, Body *body, Turn turn, Motions *wrench) {
    const double *g = chain->gravity;
    Motions *force = body->force, *moment = body->moment, *first = body->first;
    turn_vector(force, Z, turn, ANY_TURN);
    turn_vector(moment, Z, turn, ANY_TURN);
    turn_vector(first, Z, turn, ANY_TURN);
    for (int i = X; i <= Z; ++i) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        wrench[i] = each(chain->mass * g[i]) - force[i];
        wrench[3 + i] = first[p] * each(g[q]) - first[q] * each(g[p]) - moment[i];
    }
}

/* First moment and inertia [9], and linear and angular momentum [6], in the body's axes. */
SLIDE_INLINE void store_loads(const Body *body, Motions *inertia, Motions *momentum) {
    for (int i = X; i <= Z; ++i) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        inertia[i] = body->first[i];
        inertia[3 + i] = body->square[p] + body->square[q];
        inertia[8 - i] = -body->mixed[i];
        momentum[i] = body->momentum[i];
        momentum[3 + i] = body->flow[q][p] - body->flow[p][q]; /* r x m v */
    }
}

#endif
