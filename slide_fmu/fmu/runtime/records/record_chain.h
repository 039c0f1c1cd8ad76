/* A serial chain in several samples at once, as many as a register holds. */
#ifndef SLIDE_RECORD_CHAIN_H
#define SLIDE_RECORD_CHAIN_H

#include "record_differences.h"

#if defined(__AVX512F__)
#define SLIDE_MOTIONS 8
#elif defined(__AVX2__)
#define SLIDE_MOTIONS 4
#else
#define SLIDE_MOTIONS 2
#endif
#include "chain.h"

/* Motions at any place of memory. */
typedef double LooseMotions
    __attribute__((vector_size(8 * SLIDE_MOTIONS), aligned(8), may_alias));

static inline Motions motions_at(const double *numbers) {
    return *(const LooseMotions *)numbers;
}

/* How the joints follow the set points of samples from a place of the block on. */
SLIDE_CALLED void follow_points(const Chain *chain, const SlidePoints *points, size_t at,
                          Joint *joints) {
    const size_t records = points->records;
    const double *input = points->inputs + at;
    for (size_t i = 0; i < chain->n_joints; ++i, input += SLIDE_ROOM) {
        set_joint(chain, i, motions_at(input), motions_at(input - records),
                  motions_at(input - 2 * records), &joints[i]);
    }
}

/* Numbers of the samples to rows of signals, which are stride apart. */
SLIDE_INLINE void write_rows(const Motions *numbers, size_t count, double *rows, size_t stride) {
    for (size_t i = 0; i < count; ++i) {
        *(LooseMotions *)(rows + i * stride) = numbers[i];
    }
}

/* All signals but the changes of the wrench. */
SLIDE_CALLED void write_loads(const Chain *chain, Joint *joints,
                                                  double *signals, size_t stride) {
    double *after_rates = signals + chain->n_joints * stride;
    Motions inertia[9], momentum[6], wrench[6];
    Body body;
    const Turn first = gather_body(chain, joints, &body);
    turn_vector(body.tool, Z, first, ANY_TURN);
    write_rows(body.tool, 3, signals + POSITION * stride, stride);
    store_loads(&body, inertia, momentum);
    write_rows(inertia, 9, after_rates + TURNED_INERTIA * stride, stride);
    write_rows(momentum, 6, after_rates + TURNED_MOMENTUM * stride, stride);
    weigh(chain, &body, first, wrench);
    write_rows(wrench, 6, signals + WRENCH * stride, stride);
    write_rows(&first.c, 1, after_rates + FRAME * stride, stride);
    write_rows(&first.s, 1, after_rates + (FRAME + 1) * stride, stride);
    for (size_t i = 0; i < chain->n_joints; ++i) {
        write_rows(&joints[i].rate, 1, signals + (RATES + i) * stride, stride);
    }
}

/* The changes of the wrench, in the axes of the base and in those that turn with the first
 * joint. */
SLIDE_CALLED void form_wrench_changes(const Chain *chain, const SlidePoints *points) {
    const size_t after_rates = chain->n_joints;
    const double *c = row(points->signals, after_rates + FRAME), *s = c + SLIDE_ROOM;
    for (size_t part = 0; part < 6; ++part) {
        form_changes(points, row(points->signals, WRENCH + part),
                     row(points->signals, WRENCH_CHANGE + part));
    }
    for (size_t part = 0; part < 6; part += 3) {
        const double *x = row(points->signals, WRENCH_CHANGE + part), *y = x + SLIDE_ROOM;
        double *turned = row(points->signals, after_rates + TURNED_WRENCH_CHANGE + part);
        SLIDE_EACH
        for (size_t p = 0; p < points->n_points; ++p) {
            turned[p] = c[p] * x[p] + s[p] * y[p];
            (turned + SLIDE_ROOM)[p] = c[p] * y[p] - s[p] * x[p];
        }
        memcpy(turned + 2 * SLIDE_ROOM, y + SLIDE_ROOM, points->n_points * sizeof *y);
    }
}

/* The wrench is that of the sample before, too. */
static void form_chain(const SlideFeatures *features, const SlidePoints *points) {
    const Chain *chain = features->own;
    const size_t first = SLIDE_LEAD - points->records;
    for (size_t at = first; at < SLIDE_LEAD + points->n_points; at += SLIDE_MOTIONS) {
        follow_points(chain, points, at, chain->joints);
        write_loads(chain, chain->joints, points->signals + at, SLIDE_ROOM);
    }
    form_wrench_changes(chain, points);
}

#endif
