/* Motion of a serial chain and its loads on the base (slide_fmu/features/serial_chain.py). */
#include "chain_body.h"
#include "feature_set.h"
#include "kernel.h"

#define SYMMETRY 1e-9 /* largest difference of an inertia and its transpose, over its diagonal */

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
    const double *gravity; /* [3] */
    const double *tool;    /* [3], in the last link's frame */
    Link *links;
    Two *sectors; /* of chain_angle.h */
    Joint *joints;     /* scratch */
} Chain;

/* On the quadratic B-spline through four set points. */
INLINE void set_joints(const Chain *chain, const double *input, const double *before) {
    const Two *sectors = chain->sectors;
    Joint *joints = chain->joints;
    const size_t n = chain->n_joints;
    const double *u0 = input, *u1 = before, *u2 = before + n, *u3 = before + 2 * n;
    for (size_t i = 0; i < n; ++i) {
        const Link *link = &chain->links[i];
        const Two after = {u0[i], u1[i]}, between = {u1[i], u2[i]}, first = {u2[i], u3[i]};
        const Two angle = both(link->middle) + both(link->half_range) * (after + between);
        const Two change = after - between;
        joints[i].rate = both(link->rate) * change;
        joints[i].acceleration = both(link->acceleration) * (change - (between - first));
        joints[i].turned = turn_by(sectors, angle);
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
    Two *force = body->force, *moment = body->moment, *first = body->first;
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
    Two angular[3]; /* r x m v */
    store(body->first, inertia);
    for (int i = X; i <= Z; ++i) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        angular[i] = body->flow[q][p] - body->flow[p][q];
        inertia[3 + i] = body->square[p][0] + body->square[q][0];
        inertia[8 - i] = -body->mixed[i][0];
    }
    store(body->momentum, momentum);
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
INLINE void write_signals(const SlideFeatures *features, const double *input,
                          const double *before) {
    const Chain *chain = features->own;
    double *signals = features->signals, *after_rates = signals + chain->n_joints;
    Body body = {0};
    set_joints(chain, input, before);
    store_joints(chain, signals);
    Turn *turned = &chain->joints[0].turned;
    const Turn first = *turned;
    turned->c = both(1), turned->s = both(0);
    for (int i = X; i <= Z; ++i) {
        body.tool[i] = both(chain->tool[i]);
    }
    for (size_t i = chain->n_joints; i-- > 0;) {
        pass(&chain->links[i], &chain->joints[i], &body);
    }
    turn_vector(body.tool, Z, first);
    store(body.tool, signals + POSITION);
    store_loads(&body, after_rates);
    store_wrench(chain, &body, &first, signals);
}

/* For each kernel, since more registers hold more of a body. */
#define WRITE(name)                                                                               \
    static void name(const SlideFeatures *features, const double *input, const double *before) {  \
        write_signals(features, input, before);                                                   \
    }

WRITE(write_baseline)
#if !defined(SLIDE_ONE_KERNEL)
__attribute__((target("avx2,fma"))) WRITE(write_avx2)
__attribute__((target("avx2,fma,avx512f,avx512dq,avx512vl"))) WRITE(write_avx512)
#endif

static void write_chain(const SlideFeatures *features, const double *input,
                        const double *before) {
    const Chain *chain = features->own;
    chain->write(features, input, before);
}

/* The numbers of a chain, in the order of a file. */
typedef struct {
    double step;                         /* s */
    const double *middle, *half_range;   /* [n] rad */
    const double *a, *d, *alpha;         /* [n] */
    const double *masses;                /* [n] */
    const double *centres, *inertias;    /* [n][3], [n][3][3] */
    const double *gravity, *tool;        /* [3] */
} Numbers;

enum { NUMBERS_OF_JOINT = 18, NUMBERS_OF_ALL = 6 };

static Numbers numbers_of(const double *at, size_t n) {
    const double *middle = at + 1, *centres = middle + 6 * n, *gravity = middle + 18 * n;
    return (Numbers){at[0],          middle,  middle + n,      middle + 2 * n, middle + 3 * n,
                     middle + 4 * n, middle + 5 * n, centres, centres + 3 * n, gravity,
                     gravity + 3};
}

/* An inertia tensor f64 [3][3] must be symmetric, as slide_fmu/features/serial_chain.py says. */
static void check_inertia(SlideCursor *cursor, const unsigned char *inertia, unsigned link) {
    for (int i = X; i <= Z; ++i) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        const double pp = slide_f64(inertia + 32 * p), qq = slide_f64(inertia + 32 * q);
        const double pq = slide_f64(inertia + 24 * p + 8 * q);
        const double qp = slide_f64(inertia + 24 * q + 8 * p);
        slide_check(cursor, fabs(pq - qp) <= SYMMETRY * (fabs(pp) + fabs(qq)),
                    "surrogate file: inertia of link %u of a chain; expected a symmetric tensor",
                    link);
    }
}

static void read_chain(SlideFeaturesView *view, SlideCursor *cursor) {
    const uint64_t n = view->n_inputs;
    const double step = slide_take_f64(cursor, "a chain");
    view->n_signals = N_SIGNALS + n;
    slide_check(cursor, isfinite(step) && step > 0,
                "surrogate file: step %g s of a chain; expected positive", step);
    const unsigned char *numbers =
        slide_take_f64s(cursor, NUMBERS_OF_JOINT * n + NUMBERS_OF_ALL, 1, "chain");
    for (uint64_t i = 0; cursor->good && i < n; ++i) {
        check_inertia(cursor, numbers + 72 * (n + i), (unsigned)i);
    }
}

static void fill_joint(Link *link, const Numbers *chain, size_t i) {
    link->middle = chain->middle[i];
    link->half_range = 0.5 * chain->half_range[i]; /* of the sum of two inputs */
    link->rate = chain->half_range[i] / chain->step;
    link->acceleration = link->rate / chain->step;
    link->a = chain->a[i];
    link->d = chain->d[i];
    link->cos_alpha = cos(chain->alpha[i]);
    link->sin_alpha = sin(chain->alpha[i]);
}

/* A link alone in its frame. With S the sums of m r r', its inertia is trace(S) 1 - S. */
static Body body_of(double mass, const double *centre, const double *inertia) {
    double half_trace = 0.5 * (inertia[0] + inertia[4] + inertia[8]);
    Body body = {0};
    for (int i = X; i <= Z; ++i) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        body.first[i] = both(mass * centre[i]);
        body.square[i] = both(half_trace - inertia[4 * i] + mass * centre[i] * centre[i]);
        body.mixed[i] = both(mass * centre[p] * centre[q] - inertia[3 * p + q]);
    }
    return body;
}

/* Further: the mass further out. */
static void fill_masses(Link *link, const Numbers *chain, size_t i, double further) {
    const double all = chain->masses[i] + further;
    Body alone = body_of(chain->masses[i], chain->centres + 3 * i, chain->inertias + 9 * i);
    turn_masses(&alone, X, (Turn){both(link->cos_alpha), both(link->sin_alpha)});
    shift_masses(&alone, link);
    store(alone.first, link->first);
    store(alone.square, link->square);
    store(alone.mixed, link->mixed);
    link->first[X] += all * link->a;
    link->first[Z] += all * link->d;
    link->square[X] += all * link->a * link->a;
    link->square[Z] += all * link->d * link->d;
    link->mixed[Y] += all * link->a * link->d;
}

static void fill_chain(Chain *chain, const Numbers *numbers) {
    fill_sectors(chain->sectors);
    for (size_t i = chain->n_joints; i-- > 0;) {
        fill_joint(&chain->links[i], numbers, i);
        fill_masses(&chain->links[i], numbers, i, chain->mass);
        chain->mass += numbers->masses[i];
    }
}

static void *place_chain(const SlideFeaturesView *view, SlideArena *arena) {
    const size_t n = view->n_inputs, n_numbers = 1 + NUMBERS_OF_JOINT * n + NUMBERS_OF_ALL;
    Chain *chain = slide_place(arena, 1, sizeof *chain);
    double *numbers = slide_place(arena, n_numbers, sizeof *numbers);
    Link *links = slide_place(arena, n, sizeof *links);
    Two *sectors = slide_place(arena, SECTORS, sizeof *sectors);
    Joint *joints = slide_place(arena, n, sizeof *joints);
    if (chain != NULL) {
        for (size_t i = 0; i < n_numbers; ++i) {
            numbers[i] = slide_f64(view->own + 8 * i);
        }
        const Numbers of = numbers_of(numbers, n);
        *chain = (Chain){write_baseline, n, 0, of.gravity, of.tool, links, sectors, joints};
#if !defined(SLIDE_ONE_KERNEL)
        const SlideKernel *kernel = slide_kernel(0);
        chain->write = kernel == &slide_kernel_avx512 ? write_avx512
                       : kernel == &slide_kernel_avx2 ? write_avx2
                                                      : write_baseline;
#endif
        fill_chain(chain, &of);
    }
    return chain;
}

const SlideFeatureSet slide_chain_motion = {
    .number = 3,
    .read = read_chain,
    .place = place_chain,
    .write = write_chain,
};
