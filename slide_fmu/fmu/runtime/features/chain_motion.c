#include "chain_motion.h"

#include "angle.h"
#include "kernel.h"

/* As in the kernels, products and sums are fused where the processor can. GCC has no such
 * pragma. */
#ifdef __clang__
#pragma STDC FP_CONTRACT ON
#endif

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

/* One joint and the link that it moves: standard Denavit-Hartenberg. */
typedef struct {
    double middle, half_range;  /* rad; of the scaled input, and of the sum of two of them */
    double rate, acceleration;  /* rad/s, rad/s^2; of changes of the scaled input */
    double a, d;                /* m */
    double cos_alpha, sin_alpha;
    /* Of the link, and of the masses further out as if they were in the origin of its frame; seen
     * from the frame before it, turned with the joint. */
    double first[3];            /* kg m; moment of mass */
    double square[3], mixed[3]; /* kg m^2; integrals of xx, yy, zz and of yz, xz, xy */
    double skew[3];             /* kg m^2; axis of the part of the inertia that is skew, if any */
} Link;

/* A joint at the end and at the begin of the step. */
typedef struct {
    SlideCosineSine turned;
    SlideTwo rate, acceleration;
} Joint;

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

/* Two motions at once: that at the end of the step, and that at its begin. */
typedef SlideTwo Two;

/* A vector, and its first and second derivatives seen from the frame in which it is given. */
typedef struct {
    Two value[3], rate[3], acceleration[3];
} Moving;

/* All links from some joint on, as they move seen from the frame before it. Sums over their masses
 * m at places r with velocities v. */
typedef struct {
    Moving first;            /* m r; so momentum and force too */
    Two square[3], mixed[3]; /* of m r r': xx, yy, zz and yz, xz, xy */
    Two flow[3][3];          /* m v r': [component of v][component of r] */
    Two moment[3];           /* m r x dv/dt */
    Moving skew;             /* of Link */
    Two tool[3];             /* its place */
} Body;

/* A turn about an axis of a frame. */
typedef SlideCosineSine Turn;

enum { X, Y, Z };

/* Inlined even where large: sums stay in registers. */
#define INLINE static inline __attribute__((always_inline))

INLINE Two both(double value) { return slide_both(value); }

/* Two components of a vector, the axis being across them. */
INLINE void turn_pair(Two *x, Two *y, Turn turn) {
    const Two u = *x, v = *y;
    *x = turn.c * u - turn.s * v;
    *y = turn.s * u + turn.c * v;
}

/* A two by two block of a matrix, from both sides. With e = s (xx - yy) + c (xy + yx), all that
 * changes follows from s e and c e. */
INLINE void turn_block(Two *xx, Two *xy, Two *yx, Two *yy, Turn turn) {
    const Two before[2] = {*xy, *yx};
    const Two e = turn.s * (*xx - *yy) + turn.c * (*xy + *yx);
    const Two moved = turn.s * e, mixed = turn.c * e;
    *xx -= moved, *yy += moved;
    *xy = mixed - before[1], *yx = mixed - before[0];
}

INLINE void turn_vector(Two *v, int axis, Turn turn) {
    turn_pair(&v[(axis + 1) % 3], &v[(axis + 2) % 3], turn);
}

/* What does not depend on motion. */
INLINE void turn_masses(Body *body, int axis, Turn turn) {
    const int p = (axis + 1) % 3, q = (axis + 2) % 3;
    Two other = body->mixed[axis];
    turn_vector(body->first.value, axis, turn);
    turn_block(&body->square[p], &body->mixed[axis], &other, &body->square[q], turn);
    turn_pair(&body->mixed[q], &body->mixed[p], turn);
    turn_vector(body->tool, axis, turn);
}

INLINE void turn_motion(Body *body, int axis, Turn turn) {
    const int p = (axis + 1) % 3, q = (axis + 2) % 3;
    turn_vector(body->first.rate, axis, turn);
    turn_vector(body->first.acceleration, axis, turn);
    turn_block(&body->flow[p][p], &body->flow[p][q], &body->flow[q][p], &body->flow[q][q], turn);
    turn_pair(&body->flow[p][axis], &body->flow[q][axis], turn);
    turn_pair(&body->flow[axis][p], &body->flow[axis][q], turn);
    turn_vector(body->moment, axis, turn);
}

/* Seen from a point that lies back along x and z; but for its mass in the present origin. */
INLINE void shift_masses(Body *body, const Link *link) {
    const Two *first = body->first.value, a = both(link->a), d = both(link->d);
    body->square[X] += (a + a) * first[X];
    body->square[Z] += (d + d) * first[Z];
    body->mixed[X] += d * first[Y];
    body->mixed[Y] += a * first[Z] + d * first[X];
    body->mixed[Z] += a * first[Y];
}

INLINE void shift_motion(Body *body, const Link *link) {
    const Two *momentum = body->first.rate, *force = body->first.acceleration;
    const Two a = both(link->a), d = both(link->d);
    for (int i = X; i <= Z; ++i) {
        body->flow[i][X] += a * momentum[i];
        body->flow[i][Z] += d * momentum[i];
    }
    body->moment[X] -= d * force[Y];
    body->moment[Y] += d * force[X] - a * force[Z];
    body->moment[Z] += a * force[Y];
}

INLINE void add_to(Two *v, const double *constants) {
    for (int i = X; i <= Z; ++i) {
        v[i] += both(constants[i]);
    }
}

/* The link, and what further masses add to the sums by where their origin is. */
INLINE void add_link(Body *body, const Link *link) {
    body->tool[X] += both(link->a);
    body->tool[Z] += both(link->d);
    add_to(body->first.value, link->first);
    add_to(body->square, link->square);
    add_to(body->mixed, link->mixed);
}

/* A vector that turns about z besides how it moved before. */
INLINE void spin_vector(Moving *v, const Joint *joint) {
    const Two rate = joint->rate, acceleration = joint->acceleration;
    const Two before[2] = {v->rate[X], v->rate[Y]};
    v->rate[X] -= rate * v->value[Y];
    v->rate[Y] += rate * v->value[X];
    v->acceleration[X] -= acceleration * v->value[Y] + rate * (before[Y] + v->rate[Y]);
    v->acceleration[Y] += acceleration * v->value[X] + rate * (before[X] + v->rate[X]);
}

/* The body turns about z besides. With v as before, this adds to accelerations at places r:
 * acceleration z x r + 2 rate z x v + rate^2 z x (z x r). */
INLINE void spin(Body *body, const Joint *joint) {
    const Two rate = joint->rate, acceleration = joint->acceleration;
    const Two *square = body->square, *mixed = body->mixed, turned = rate * mixed[Z];
    Two(*flow)[3] = body->flow;
    const Two before[2] = {flow[X][Z], flow[Y][Z]}, along = flow[X][X] + flow[Y][Y];
    flow[X][X] -= turned, flow[Y][Y] += turned;
    flow[X][Y] -= rate * square[Y], flow[Y][X] += rate * square[X];
    flow[X][Z] -= rate * mixed[X], flow[Y][Z] += rate * mixed[Y];
    body->moment[X] -= acceleration * mixed[Y] + rate * (before[X] + flow[X][Z]);
    body->moment[Y] -= acceleration * mixed[X] + rate * (before[Y] + flow[Y][Z]);
    body->moment[Z] += acceleration * (square[X] + square[Y]) + rate * (along + along);
    spin_vector(&body->first, joint);
}

INLINE void turn_moving(Moving *v, int axis, Turn turn) {
    turn_vector(v->value, axis, turn);
    turn_vector(v->rate, axis, turn);
    turn_vector(v->acceleration, axis, turn);
}

/* The skew part of inertias, where there is any, goes along. */
INLINE void pass_skew(const Link *link, const Joint *joint, Turn twist, Moving *skew) {
    turn_moving(skew, X, twist);
    add_to(skew->value, link->skew);
    turn_moving(skew, Z, joint->turned);
    spin_vector(skew, joint);
}

/* One link and the joint that moves it. */
INLINE void pass(const Link *link, const Joint *joint, bool skew, Body *body) {
    const Turn twist = {both(link->cos_alpha), both(link->sin_alpha)};
    turn_masses(body, X, twist);
    turn_motion(body, X, twist);
    shift_motion(body, link);
    shift_masses(body, link);
    add_link(body, link);
    turn_masses(body, Z, joint->turned);
    turn_motion(body, Z, joint->turned);
    spin(body, joint);
    if (skew) {
        pass_skew(link, joint, twist, &body->skew);
    }
}

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

static bool read_chain(SlideFeaturesView *view, SlideCursor *section, SlideMessage *message) {
    const uint64_t n = view->n_inputs;
    const unsigned char *numbers;
    double step;
    view->n_signals = N_SIGNALS + n;
    if (!slide_take_f64(section, &step)) {
        return slide_too_short(message, "a chain");
    }
    if (!isfinite(step) || !(step > 0)) {
        return slide_say(message, "surrogate file: step %g s of a chain; expected positive", step);
    }
    return slide_read_f64(&numbers, NUMBERS_OF_JOINT * n + NUMBERS_OF_ALL, 1, section, "chain",
                          message);
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
