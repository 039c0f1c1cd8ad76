#include "chain.h"

#include <math.h>

/* Two motions at once: that at the end of the step, and that at its begin. Each is seen from axes
 * that turn with its first joint: there this angle is zero and gravity turns the other way. */
typedef double Two __attribute__((vector_size(16)));

typedef struct {
    Two x, y, z;
} Vector;

typedef struct {
    Vector x, y, z; /* columns */
} Matrix;

/* From the base to the links: the origin of the present frame, and how its link moves. */
typedef struct {
    Vector position;
    Matrix axes;
    Vector omega, alpha, velocity, acceleration;
} Motion;

typedef struct {
    Vector force, moment;       /* that the motion of the links needs, about the base */
    Vector linear, angular;     /* momentum */
    Vector first, square, mixed; /* of inertia: xx, yy, zz and xy, xz, yz */
} Loads;

static inline Two both(double value) { return (Two){value, value}; }

static inline Vector fixed(const double *v) {
    return (Vector){both(v[0]), both(v[1]), both(v[2])};
}

static inline Vector add(Vector a, Vector b) {
    return (Vector){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline Vector times(Two factor, Vector v) {
    return (Vector){factor * v.x, factor * v.y, factor * v.z};
}

static inline Two dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static inline Vector cross(Vector a, Vector b) {
    return (Vector){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline Vector product(const Matrix *matrix, Vector v) {
    return add(add(times(v.x, matrix->x), times(v.y, matrix->y)), times(v.z, matrix->z));
}

/* A vector in axes turned about z by an angle with this cosine and sine. */
static inline Vector turned(Vector v, Two c, Two s) {
    return (Vector){c * v.x + s * v.y, c * v.y - s * v.x, v.z};
}

static void store(Vector v, double *newest) {
    newest[0] = v.x[0], newest[1] = v.y[0], newest[2] = v.z[0];
}

/* Columns of the inertia of a link, rotated to the base's axes. */
static inline Matrix inertia_of(const SlideLink *link, const Matrix *axes) {
    const double *i = link->inertia;
    Vector columns[3]; /* of the rotation times the tensor */
    for (size_t k = 0; k < 3; ++k) {
        columns[k] = product(axes, (Vector){both(i[k]), both(i[3 + k]), both(i[6 + k])});
    }
    Matrix half = {columns[0], columns[1], columns[2]};
    Vector x = {axes->x.x, axes->y.x, axes->z.x}, y = {axes->x.y, axes->y.y, axes->z.y};
    Vector z = {axes->x.z, axes->y.z, axes->z.z};
    return (Matrix){product(&half, x), product(&half, y), product(&half, z)};
}

/* Acceleration of a point of a link, an arm away from the present origin. */
static inline Vector acceleration_at(const Motion *motion, Vector arm) {
    Vector turning = cross(motion->omega, cross(motion->omega, arm));
    return add(add(motion->acceleration, cross(motion->alpha, arm)), turning);
}

/* Go over to the next link, at the origin of the frame before it; then to its own axes. Gives the
 * arm to its own origin. */
static inline Vector turn_joint(Motion *motion, const SlideLink *link, Two c, Two s) {
    Matrix *axes = &motion->axes;
    Vector x = add(times(c, axes->x), times(s, axes->y));
    Vector y = add(times(c, axes->y), times(-s, axes->x));
    Vector z = axes->z;
    Two ca = both(link->cos_alpha), sa = both(link->sin_alpha);
    axes->x = x;
    axes->y = add(times(ca, y), times(sa, z));
    axes->z = add(times(ca, z), times(-sa, y));
    return add(times(both(link->a), x), times(both(link->d), z));
}

static inline void add_wrench(Loads *loads, const SlideLink *link, const Motion *motion,
                              const Matrix *inertia, Vector arm, Vector centre, Vector spin) {
    Vector force = times(both(link->mass), acceleration_at(motion, arm));
    Vector moment = add(product(inertia, motion->alpha), cross(motion->omega, spin));
    loads->force = add(loads->force, force);
    loads->moment = add(loads->moment, add(moment, cross(centre, force)));
}

static inline void add_momentum(Loads *loads, const SlideLink *link, const Motion *motion,
                                Vector arm, Vector centre, Vector spin) {
    Vector velocity = add(motion->velocity, cross(motion->omega, arm));
    Vector momentum = times(both(link->mass), velocity);
    loads->linear = add(loads->linear, momentum);
    loads->angular = add(loads->angular, add(cross(centre, momentum), spin));
}

static inline void add_inertia(Loads *loads, const SlideLink *link, const Matrix *inertia,
                               Vector centre) {
    const Two mass = both(link->mass);
    Vector x = inertia->x, y = inertia->y, z = inertia->z;
    Two square = dot(centre, centre);
    Vector diagonal = {x.x + mass * (square - centre.x * centre.x),
                       y.y + mass * (square - centre.y * centre.y),
                       z.z + mass * (square - centre.z * centre.z)};
    Vector mixed = {y.x - mass * centre.x * centre.y, z.x - mass * centre.x * centre.z,
                    z.y - mass * centre.y * centre.z};
    loads->first = add(loads->first, times(mass, centre));
    loads->square = add(loads->square, diagonal);
    loads->mixed = add(loads->mixed, mixed);
}

/* Of the link whose axes are reached, its own origin a step away. */
static inline void add_loads(const SlideChain *chain, const SlideLink *link, const Motion *motion,
                             Vector step, Loads *loads) {
    Vector arm = add(step, product(&motion->axes, fixed(link->centre)));
    Vector centre = add(motion->position, arm);
    Matrix inertia = inertia_of(link, &motion->axes);
    Vector spin = product(&inertia, motion->omega);
    if (chain->wrench) {
        add_wrench(loads, link, motion, &inertia, arm, centre, spin);
    }
    if (chain->momentum) {
        add_momentum(loads, link, motion, arm, centre, spin);
    }
    if (chain->inertia) {
        add_inertia(loads, link, &inertia, centre);
    }
}

/* How a joint turns; cosine and sine of its angle. */
typedef struct {
    Two c, s, rate, acceleration;
} Turn;

/* A joint at the end and at the begin of the step, on the quadratic B-spline through four set
 * points. */
static inline Turn turn_of(const SlideChain *chain, size_t joint, const double *const inputs[4]) {
    const SlideLink *link = &chain->links[joint];
    double points[4];
    for (size_t age = 0; age < 4; ++age) {
        points[age] = link->middle + link->half_range * inputs[age][joint];
    }
    Two after = {points[0], points[1]}, between = {points[1], points[2]};
    Two before = {points[2], points[3]}, step = both(chain->step);
    Two angle = both(0.5) * (after + between), rate = (after - between) / step;
    return (Turn){{cos(angle[0]), cos(angle[1])},
                  {sin(angle[0]), sin(angle[1])},
                  rate,
                  (rate - (between - before) / step) / step};
}

/* One link further. */
static void pass_link(const SlideChain *chain, const SlideLink *link, const Turn *turn,
                      Motion *motion, Loads *loads) {
    Vector turning = times(turn->rate, motion->axes.z);
    motion->alpha = add(add(motion->alpha, times(turn->acceleration, motion->axes.z)),
                        cross(motion->omega, turning));
    motion->omega = add(motion->omega, turning);
    Vector step = turn_joint(motion, link, turn->c, turn->s);
    if (chain->wrench || chain->momentum || chain->inertia) {
        add_loads(chain, link, motion, step, loads);
    }
    motion->acceleration = acceleration_at(motion, step);
    motion->velocity = add(motion->velocity, cross(motion->omega, step));
    motion->position = add(motion->position, step);
}

static Vector change_of(Vector v) {
    return (Vector){both(v.x[0] - v.x[1]), both(v.y[0] - v.y[1]), both(v.z[0] - v.z[1])};
}

static void store_wrench(const SlideChain *chain, const Loads *loads, Two c, Two s,
                         double *signals) {
    double *turned_change = signals + SLIDE_TURNED_WRENCH_CHANGE + chain->n_joints;
    const Vector parts[2] = {times(both(-1), turned(loads->force, c, -s)),
                             times(both(-1), turned(loads->moment, c, -s))};
    for (size_t i = 0; i < 2; ++i) {
        Vector change = change_of(parts[i]);
        store(parts[i], signals + SLIDE_WRENCH + 3 * i);
        store(change, signals + SLIDE_WRENCH_CHANGE + 3 * i);
        store(turned(change, c, s), turned_change + 3 * i);
    }
}

void slide_chain_write(const SlideChain *chain, const double *const inputs[4], double *signals) {
    const Two zero = both(0), one = both(1);
    const Vector nothing = {zero, zero, zero};
    double *after_rates = signals + chain->n_joints;
    Motion motion = {nothing, {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}},
                     nothing, nothing, nothing, nothing};
    Loads loads = {nothing, nothing, nothing, nothing, nothing, nothing, nothing};
    Two c = one, s = zero; /* of the first joint */
    for (size_t i = 0; i < chain->n_joints; ++i) {
        Turn turn = turn_of(chain, i, inputs);
        if (i == 0) {
            c = turn.c, s = turn.s;
            turn.c = one, turn.s = zero;
            motion.acceleration = times(both(-1), turned(fixed(chain->gravity), c, s));
        }
        signals[SLIDE_RATES + i] = turn.rate[0];
        pass_link(chain, &chain->links[i], &turn, &motion, &loads);
    }
    Vector tool = add(motion.position, product(&motion.axes, fixed(chain->tool)));
    store(turned(tool, c, -s), signals + SLIDE_POSITION);
    after_rates[SLIDE_FRAME] = c[0], after_rates[SLIDE_FRAME + 1] = s[0];
    store_wrench(chain, &loads, c, s, signals);
    store(loads.first, after_rates + SLIDE_TURNED_INERTIA);
    store(loads.square, after_rates + SLIDE_TURNED_INERTIA + 3);
    store(loads.mixed, after_rates + SLIDE_TURNED_INERTIA + 6);
    store(loads.linear, after_rates + SLIDE_TURNED_MOMENTUM);
    store(loads.angular, after_rates + SLIDE_TURNED_MOMENTUM + 3);
}

static void fill(double *target, const unsigned char *source, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        target[i] = slide_f64(source + 8 * i);
    }
}

static void fill_link(SlideLink *link, const SlideChainView *view, size_t i) {
    double alpha = slide_f64(view->alpha + 8 * i);
    fill(&link->middle, view->middle + 8 * i, 1);
    fill(&link->half_range, view->half_range + 8 * i, 1);
    fill(&link->a, view->a + 8 * i, 1);
    fill(&link->d, view->d + 8 * i, 1);
    fill(&link->mass, view->masses + 8 * i, 1);
    fill(link->centre, view->centres + 24 * i, 3);
    fill(link->inertia, view->inertias + 72 * i, 9);
    link->cos_alpha = cos(alpha);
    link->sin_alpha = sin(alpha);
}

void slide_chain_place(SlideChain *chain, const SlideFeaturesView *view, SlideArena *arena) {
    chain->n_joints = view->n_inputs;
    chain->step = view->chain.step;
    chain->wrench = chain->inertia = chain->momentum = false;
    chain->links = slide_place(arena, view->n_inputs, sizeof *chain->links);
    fill(chain->gravity, view->chain.gravity, 3);
    fill(chain->tool, view->chain.tool, 3);
    for (size_t i = 0; arena->base != NULL && i < chain->n_joints; ++i) {
        fill_link(&chain->links[i], &view->chain, i);
    }
}

void slide_chain_need(SlideChain *chain, size_t signal) {
    size_t n = chain->n_joints;
    bool changes = signal >= n + SLIDE_TURNED_WRENCH_CHANGE && signal < n + SLIDE_TURNED_INERTIA;
    bool of_inertia = signal >= n + SLIDE_TURNED_INERTIA && signal < n + SLIDE_TURNED_MOMENTUM;
    chain->wrench = chain->wrench || signal < SLIDE_POSITION || changes;
    chain->inertia = chain->inertia || of_inertia;
    chain->momentum = chain->momentum || signal >= n + SLIDE_TURNED_MOMENTUM;
}
