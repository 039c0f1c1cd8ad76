/* Motion of a serial chain and its loads on the base (slide_fmu/features/serial_chain.py). */
#include "chain.h"
#include "kernel.h"

#include <math.h>
#include <string.h>

#define ROUNDING 1e-15 /* of an angle, in rad */
#define SYMMETRY 1e-9 /* largest difference of an inertia and its transpose, over its diagonal */
enum { MOST_MOTIONS = 8 }; /* in a register */
#define EXACT 1e-9 /* by which weights of a drive law may miss what they must sum up to */

/* The newest of the motions, and set points of all joints as motions: those of the end of the step,
 * and, where Motions hold two, those of its start. */
#if defined(SLIDE_SCALAR)
SLIDE_INLINE double newest(Motions v) { return v; }
SLIDE_INLINE Motions motions(const double *const *points, size_t i) { return points[0][i]; }
#else
SLIDE_INLINE double newest(Motions v) { return v[0]; }
SLIDE_INLINE Motions motions(const double *const *points, size_t i) {
    return (Motions){points[0][i], points[1][i]};
}
#endif

/* How the joints follow three set points, the newest first. */
SLIDE_INLINE void set_joints(const Chain *chain, const double *const *points) {
    for (size_t i = 0; i < chain->n_joints; ++i) {
        set_joint(chain, i, motions(points, i), motions(points + 1, i), motions(points + 2, i),
                  &chain->joints[i]);
    }
}

/* Of some numbers: those at the end of the step. */
SLIDE_INLINE void store(const Motions *v, int count, double *values) {
    for (int i = 0; i < count; ++i) {
        values[i] = newest(v[i]);
    }
}

/* The wrench at the start of the step, from that at both ends; or the chain once more, whose
 * joints are no longer needed. */
SLIDE_INLINE void find_wrench_before(const Chain *chain, const double *const *points,
                                     const Motions *wrench, double *before) {
#if defined(SLIDE_SCALAR)
    Body body;
    Motions motions[6];
    (void)wrench;
    set_joints(chain, points + 1);
    const Turn turn = gather_body(chain, chain->joints, &body);
    weigh(chain, &body, turn, motions);
    store(motions, 6, before);
#else
    (void)chain;
    (void)points;
    for (int i = 0; i < 6; ++i) {
        before[i] = wrench[i][1];
    }
#endif
}

SLIDE_INLINE void store_wrench(const Chain *chain, const double *const *points, Body *body,
                               Turn turn, double *signals) {
    double *turned_change = signals + TURNED_WRENCH_CHANGE + chain->n_joints, before[6];
    const Turn back = {each(newest(turn.c)), each(-newest(turn.s))};
    Motions wrench[6], change[6];
    weigh(chain, body, turn, wrench);
    find_wrench_before(chain, points, wrench, before);
    for (int i = 0; i < 6; ++i) {
        change[i] = each(newest(wrench[i]) - before[i]);
    }
    store(wrench, 6, signals + WRENCH);
    store(change, 6, signals + WRENCH_CHANGE);
    turn_vector(change, Z, back, ANY_TURN);
    turn_vector(change + 3, Z, back, ANY_TURN);
    store(change, 6, turned_change);
}

SLIDE_INLINE void store_joints(const Chain *chain, double *signals) {
    const Joint *joints = chain->joints;
    double *frame = signals + chain->n_joints + FRAME;
    for (size_t i = 0; i < chain->n_joints; ++i) {
        signals[RATES + i] = newest(joints[i].rate);
    }
    frame[0] = newest(joints[0].turned.c), frame[1] = newest(joints[0].turned.s);
}

/* The chain is seen from axes that turn with its first joint; what is wanted in those of the base
 * is turned in the end. */
SLIDE_INLINE void write_signals(const SlideFeatures *features, const double *input,
                                const double *before) {
    const Chain *chain = features->own;
    const size_t n = chain->n_joints;
    const double *const points[] = {input, before, before + n, before + 2 * n};
    double *signals = features->signals, *after_rates = signals + n;
    Body body;
    Motions inertia[9], momentum[6];
    set_joints(chain, points);
    store_joints(chain, signals);
    const Turn first = gather_body(chain, chain->joints, &body);
    turn_vector(body.tool, Z, first, ANY_TURN);
    store(body.tool, 3, signals + POSITION);
    store_loads(&body, inertia, momentum);
    store(inertia, 9, after_rates + TURNED_INERTIA);
    store(momentum, 6, after_rates + TURNED_MOMENTUM);
    store_wrench(chain, points, &body, first, signals);
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
    double step;                                 /* s */
    const double *law;                           /* [4] */
    const double *middle, *half_range;           /* [n] rad or m */
    const double *prismatic, *theta, *alpha;     /* [n] */
    const double *steps;                         /* [n][3] */
    const double *masses;                        /* [n] */
    const double *centres, *inertias;            /* [n][3], [n][3][3] */
    const double *gravity, *tool;                /* [3] */
} Numbers;

enum { NUMBERS_OF_LAW = 4, NUMBERS_OF_JOINT = 21, NUMBERS_OF_ALL = 10 };

static Numbers numbers_of(const double *at, size_t n) {
    const double *law = at + 1, *middle = law + NUMBERS_OF_LAW, *prismatic = middle + 2 * n;
    const double *steps = prismatic + 3 * n, *masses = steps + 3 * n, *centres = masses + n;
    const double *gravity = middle + NUMBERS_OF_JOINT * n;
    return (Numbers){at[0],         law,           middle,  middle + n, prismatic,
                     prismatic + n, prismatic + 2 * n, steps,   masses,     centres,
                     centres + 3 * n, gravity,     gravity + 3};
}

/* What the weights that follow from those of a drive law f64 [4] sum up to, after rounding
 * (slide_fmu/features/drive_law.py). */
static void check_law(SlideCursor *cursor, const unsigned char *law) {
    const double newest = slide_f64(law), oldest = slide_f64(law + 8);
    const double rate = slide_f64(law + 16), curvature = slide_f64(law + 24);
    const double middle = 1 - newest - oldest, rate_before = 1 - 2 * rate, rest = rate - 1;
    const bool rests = fabs(newest + middle + oldest - 1) <= EXACT &&
                       fabs(rate + rate_before + rest) <= EXACT;
    slide_check(cursor, rests && fabs(-rate_before - 2 * rest - 1) <= EXACT &&
                            isfinite(2 * curvature),
                "surrogate file: drive law %g, %g, %g, %g of a chain; expected weights that can be "
                "summed up without loss",
                newest, oldest, rate, curvature);
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
    if (!cursor->good) {
        return;
    }
    check_law(cursor, numbers);
    const unsigned char *joints = numbers + 8 * NUMBERS_OF_LAW;
    for (uint64_t i = 0; cursor->good && i < n; ++i) {
        const double prismatic = slide_f64(joints + 8 * (2 * n + i));
        slide_check(cursor, prismatic == 0 || prismatic == 1,
                    "surrogate file: joint %u of a chain is of kind %g; expected 1 (prismatic) or "
                    "0",
                    (unsigned)i, prismatic);
        check_inertia(cursor, joints + 8 * (12 * n + 9 * i), (unsigned)i);
    }
}

/* The cosine of a quarter in a file is its rounding, 6e-17, and so is the sine of a half. */
static void fill_twist(Link *link, double alpha) {
    const double c = cos(alpha), s = sin(alpha);
    const bool quarter = fabs(c) < ROUNDING, none = fabs(s) < ROUNDING && c > 0;
    link->cos_alpha = quarter ? 0 : c;
    link->sin_alpha = quarter ? copysign(1, s) : s;
    link->twist = quarter ? QUARTER_TURN : none ? NO_TURN : ANY_TURN;
}

/* The axes of the first joint turn with it alone: its constant turn is the chain's. */
static void fill_joint(Link *link, const Numbers *chain, size_t i) {
    const double half_range = chain->half_range[i], theta = i == 0 ? 0 : chain->theta[i];
    const bool prismatic = chain->prismatic[i] == 1;
    link->prismatic = prismatic;
    link->middle = prismatic ? theta : theta + chain->middle[i];
    link->half_range = prismatic ? 0 : half_range;
    link->slide_middle = prismatic ? chain->middle[i] : 0;
    link->slide_half_range = prismatic ? half_range : 0;
    link->rate = half_range / chain->step;
    link->acceleration = link->rate / chain->step;
    memcpy(link->step, chain->steps + 3 * i, sizeof link->step);
    fill_twist(link, chain->alpha[i]);
}

/* A link alone in its frame. With S the sums of m r r', its inertia is trace(S) 1 - S. */
static Body body_of(double mass, const double *centre, const double *inertia) {
    double half_trace = 0.5 * (inertia[0] + inertia[4] + inertia[8]);
    Body body = {0};
    for (int i = X; i <= Z; ++i) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        body.first[i] = each(mass * centre[i]);
        body.square[i] = each(half_trace - inertia[4 * i] + mass * centre[i] * centre[i]);
        body.mixed[i] = each(mass * centre[p] * centre[q] - inertia[3 * p + q]);
    }
    return body;
}

/* Further: the mass further out. */
static void fill_masses(Link *link, const Numbers *chain, size_t i, double further) {
    const double all = chain->masses[i] + further, *step = link->step;
    Body alone = body_of(chain->masses[i], chain->centres + 3 * i, chain->inertias + 9 * i);
    turn_masses(&alone, X, (Turn){each(link->cos_alpha), each(link->sin_alpha)}, link->twist);
    shift_masses(&alone, link);
    store(alone.first, 3, link->first);
    store(alone.square, 3, link->square);
    store(alone.mixed, 3, link->mixed);
    link->all = all;
    for (int k = X; k <= Z; ++k) {
        link->first[k] += all * step[k];
        link->square[k] += all * step[k] * step[k];
        link->mixed[k] += all * step[(k + 1) % 3] * step[(k + 2) % 3];
    }
}

static void fill_chain(Chain *chain, const Numbers *numbers) {
    chain->first[0] = cos(numbers->theta[0]), chain->first[1] = sin(numbers->theta[0]);
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
    Joint *joints = slide_place(arena, n, sizeof *joints / SLIDE_MOTIONS * MOST_MOTIONS);
    if (chain != NULL) {
        for (size_t i = 0; i < n_numbers; ++i) {
            numbers[i] = slide_f64(view->own + 8 * i);
        }
        const Numbers of = numbers_of(numbers, n);
        *chain = (Chain){.write = write_baseline,
                         .n_joints = n,
                         .law = of.law,
                         .gravity = of.gravity,
                         .tool = of.tool,
                         .links = links,
                         .joints = joints};
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
    .number = 4,
    .read = read_chain,
    .place = place_chain,
    .write = write_chain,
};
