#include "chain_motion.h"

#include "chain_body.h"
#include "kernel.h"

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

typedef struct Chain {
    void (*write)(const struct Chain *chain, const double *const inputs[4], double *signals);
    size_t n_joints;
    double mass, gravity[3];
    double tool[3]; /* in the last link's frame */
    Link *links;
    SlideTwo *sectors; /* of angle.h */
    Joint *joints;     /* scratch */
    bool skew;         /* some inertia is not symmetric */
} Chain;

/* On the quadratic B-spline through four set points. */
INLINE Two angle_of(const Link *link, Two after, Two between) {
    return both(link->middle) + both(link->half_range) * (after + between);
}

INLINE void set_joints(const Chain *chain, const double *const inputs[4]) {
    const double *u0 = inputs[0], *u1 = inputs[1], *u2 = inputs[2], *u3 = inputs[3];
    const SlideTwo *sectors = chain->sectors;
    Joint *joints = chain->joints;
    const size_t n = chain->n_joints;
    Two squares = both(0);
    for (size_t i = 0; i < n; ++i) {
        const Link *link = &chain->links[i];
        const Two after = {u0[i], u1[i]}, between = {u1[i], u2[i]}, before = {u2[i], u3[i]};
        Two change = after - between, angle = angle_of(link, after, between);
        joints[i].rate = both(link->rate) * change;
        joints[i].acceleration = both(link->acceleration) * (change - (between - before));
        joints[i].turned = slide_cosine_sine(sectors, angle);
        squares += angle * angle;
    }
    if (squares[0] + squares[1] < SLIDE_QUICK_ANGLE * SLIDE_QUICK_ANGLE) {
        return;
    }
    for (size_t i = 0; i < n; ++i) {
        const Two after = {u0[i], u1[i]}, between = {u1[i], u2[i]};
        Two angle = angle_of(&chain->links[i], after, between);
        joints[i].turned.c = (Two){cos(angle[0]), cos(angle[1])};
        joints[i].turned.s = (Two){sin(angle[0]), sin(angle[1])};
    }
}

/* Of a vector: that at the end of the step. */
INLINE void store(const Two *v, double *newest) {
    for (int i = X; i <= Z; ++i) {
        newest[i] = v[i][0];
    }
}

/* Weight is added where it does not turn. */
INLINE void store_wrench(const Chain *chain, Body *body, const Turn *turn, double *signals) {
    const double *g = chain->gravity;
    double *turned_change = signals + TURNED_WRENCH_CHANGE + chain->n_joints;
    Two *force = body->first.acceleration, *moment = body->moment, *first = body->first.value;
    const Turn back = {both(turn->c[0]), both(-turn->s[0])};
    turn_vector(force, Z, *turn);
    turn_vector(moment, Z, *turn);
    turn_vector(first, Z, *turn);
    Two parts[2][3];
    for (int i = X; i <= Z; ++i) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        parts[0][i] = both(chain->mass * g[i]) - force[i];
        parts[1][i] = first[p] * both(g[q]) - first[q] * both(g[p]) - moment[i];
    }
    for (size_t part = 0; part < 2; ++part) {
        Two change[3];
        for (int i = X; i <= Z; ++i) {
            change[i] = both(parts[part][i][0] - parts[part][i][1]);
        }
        store(parts[part], signals + WRENCH + 3 * part);
        store(change, signals + WRENCH_CHANGE + 3 * part);
        turn_vector(change, Z, back);
        store(change, turned_change + 3 * part);
    }
}

INLINE void store_loads(Body *body, double *after_rates) {
    double *inertia = after_rates + TURNED_INERTIA;
    double *momentum = after_rates + TURNED_MOMENTUM;
    const Two *skew = body->skew.value, *skew_rate = body->skew.rate;
    Two angular[3]; /* r x m v */
    store(body->first.value, inertia);
    for (int i = X; i <= Z; ++i) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        angular[i] = body->flow[q][p] - body->flow[p][q];
        inertia[3 + i] = body->square[p][0] + body->square[q][0];
        inertia[8 - i] = -body->mixed[i][0];
    }
    for (int i = X; i <= Z; ++i) {
        angular[i] -= skew_rate[i];
        body->moment[i] -= body->skew.acceleration[i];
        inertia[8 - i] += i == Y ? skew[i][0] : -skew[i][0];
    }
    store(body->first.rate, momentum);
    store(angular, momentum + 3);
}

INLINE void store_joints(const Chain *chain, double *signals) {
    const Joint *joints = chain->joints;
    double *frame = signals + chain->n_joints + FRAME;
    for (size_t i = 0; i < chain->n_joints; ++i) {
        signals[RATES + i] = joints[i].rate[0];
    }
    frame[0] = joints[0].turned.c[0], frame[1] = joints[0].turned.s[0];
}

/* The chain is seen from axes that turn with its first joint; what is wanted in those of the base
 * is turned in the end. */
INLINE void write_signals(const Chain *chain, const double *const inputs[4],
                          double *signals) {
    double *after_rates = signals + chain->n_joints;
    Body body = {0};
    set_joints(chain, inputs);
    store_joints(chain, signals);
    SlideCosineSine *turned = &chain->joints[0].turned;
    const Turn first = *turned;
    turned->c = both(1), turned->s = both(0);
    for (int i = X; i <= Z; ++i) {
        body.tool[i] = both(chain->tool[i]);
    }
    for (size_t i = chain->n_joints; i-- > 0;) {
        pass(&chain->links[i], &chain->joints[i], chain->skew, &body);
    }
    turn_vector(body.tool, Z, first);
    store(body.tool, signals + POSITION);
    store_loads(&body, after_rates);
    store_wrench(chain, &body, &first, signals);
}

static void write_baseline(const Chain *chain, const double *const inputs[4],
                           double *signals) {
    write_signals(chain, inputs, signals);
}

#if !defined(SLIDE_ONE_KERNEL)
__attribute__((target("avx2,fma"))) static void write_avx2(const Chain *chain,
                                                           const double *const inputs[4],
                                                           double *signals) {
    write_signals(chain, inputs, signals);
}
#endif

static void write_chain(const SlideFeatures *features, const double *input,
                        const double *before) {
    const Chain *chain = features->own;
    const size_t n = chain->n_joints;
    const double *const inputs[4] = {input, before, before + n, before + 2 * n};
    chain->write(chain, inputs, features->signals);
}

/* The numbers of a chain in a file, f64, in their order. */
typedef struct {
    double step;                                         /* s */
    const unsigned char *middle, *half_range;            /* [n] rad */
    const unsigned char *a, *d, *alpha, *masses;         /* [n] */
    const unsigned char *centres, *inertias;             /* [n][3], [n][3][3] */
    const unsigned char *gravity, *tool;                 /* [3] */
} Numbers;

enum { NUMBERS_OF_JOINT = 18, NUMBERS_OF_ALL = 6 };

static Numbers numbers_of(const SlideFeaturesView *view) {
    const size_t column = 8 * (size_t)view->n_inputs;
    const unsigned char *at = view->own + 8;
    const unsigned char *centres = at + 6 * column, *inertias = centres + 3 * column;
    const unsigned char *gravity = inertias + 9 * column;
    return (Numbers){slide_f64(view->own), at,      at + column, at + 2 * column, at + 3 * column,
                     at + 4 * column,      at + 5 * column, centres, inertias, gravity,
                     gravity + 24};
}

static void read_chain(SlideFeaturesView *view, SlideCursor *cursor) {
    const uint64_t n = view->n_inputs;
    const double step = slide_take_f64(cursor, "a chain");
    view->n_signals = N_SIGNALS + n;
    slide_check(cursor, isfinite(step) && step > 0,
                "surrogate file: step %g s of a chain; expected positive", step);
    slide_take_f64s(cursor, NUMBERS_OF_JOINT * n + NUMBERS_OF_ALL, 1, "chain");
}

static void fill(double *target, const unsigned char *source, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        target[i] = slide_f64(source + 8 * i);
    }
}

static void fill_joint(Link *link, const Numbers *chain, size_t i) {
    double alpha = slide_f64(chain->alpha + 8 * i), range = slide_f64(chain->half_range + 8 * i);
    fill(&link->middle, chain->middle + 8 * i, 1);
    fill(&link->a, chain->a + 8 * i, 1);
    fill(&link->d, chain->d + 8 * i, 1);
    link->half_range = 0.5 * range; /* of the sum of two inputs */
    link->rate = range / chain->step;
    link->acceleration = link->rate / chain->step;
    link->cos_alpha = cos(alpha);
    link->sin_alpha = sin(alpha);
}

/* A link alone in its frame. With S the sums of m r r', the symmetric part of its inertia is
 * trace(S) 1 - S; what is left is a cross product with the axis of skew. */
static Body body_of(double mass, const double *centre, const double *inertia) {
    double half_trace = 0.5 * (inertia[0] + inertia[4] + inertia[8]);
    Body body = {0};
    for (int i = X; i <= Z; ++i) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        double pq = inertia[3 * p + q], qp = inertia[3 * q + p];
        body.first.value[i] = both(mass * centre[i]);
        body.square[i] = both(half_trace - inertia[4 * i] + mass * centre[i] * centre[i]);
        body.mixed[i] = both(mass * centre[p] * centre[q] - 0.5 * (pq + qp));
        body.skew.value[i] = both(0.5 * (qp - pq));
    }
    return body;
}

/* Further: the mass further out. */
static void fill_masses(Link *link, const Numbers *chain, size_t i, double further) {
    double mass = slide_f64(chain->masses + 8 * i), centre[3], inertia[9];
    double all = mass + further;
    const Turn twist = {both(link->cos_alpha), both(link->sin_alpha)};
    fill(centre, chain->centres + 24 * i, 3);
    fill(inertia, chain->inertias + 72 * i, 9);
    Body alone = body_of(mass, centre, inertia);
    turn_masses(&alone, X, twist);
    turn_vector(alone.skew.value, X, twist);
    shift_masses(&alone, link);
    store(alone.first.value, link->first);
    store(alone.square, link->square);
    store(alone.mixed, link->mixed);
    store(alone.skew.value, link->skew);
    link->first[X] += all * link->a;
    link->first[Z] += all * link->d;
    link->square[X] += all * link->a * link->a;
    link->square[Z] += all * link->d * link->d;
    link->mixed[Y] += all * link->a * link->d;
}

static void fill_chain(Chain *chain, const Numbers *numbers) {
    fill(chain->gravity, numbers->gravity, 3);
    fill(chain->tool, numbers->tool, 3);
    slide_fill_sectors(chain->sectors);
    for (size_t i = chain->n_joints; i-- > 0;) {
        Link *link = &chain->links[i];
        fill_joint(link, numbers, i);
        fill_masses(link, numbers, i, chain->mass);
        chain->skew |= link->skew[X] != 0 || link->skew[Y] != 0 || link->skew[Z] != 0;
        chain->mass += slide_f64(numbers->masses + 8 * i);
    }
}

static void *place_chain(const SlideFeaturesView *view, SlideArena *arena) {
    const Numbers numbers = numbers_of(view);
    Chain chain = {.n_joints = view->n_inputs, .write = write_baseline};
#if !defined(SLIDE_ONE_KERNEL)
    if (slide_kernel_choose() != &slide_kernel_baseline) {
        chain.write = write_avx2;
    }
#endif
    Chain *placed = slide_place(arena, 1, sizeof *placed);
    chain.links = slide_place(arena, view->n_inputs, sizeof *chain.links);
    chain.sectors = slide_place(arena, SLIDE_SECTORS, sizeof *chain.sectors);
    chain.joints = slide_place(arena, view->n_inputs, sizeof *chain.joints);
    if (arena->base != NULL) {
        fill_chain(&chain, &numbers);
        *placed = chain;
    }
    return placed;
}

const SlideFeatureSet slide_chain_motion = {
    .number = 3,
    .read = read_chain,
    .place = place_chain,
    .write = write_chain,
};
