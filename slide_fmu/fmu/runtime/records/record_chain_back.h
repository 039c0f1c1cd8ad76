/* The way back from the signals of a serial chain to its set points, by differences of a few points
 * as in slide_fmu/features/chain_motion.py: the recursion over the links stays the only one. They
 * are exact to about 1e-12 of the largest terms. */
#ifndef SLIDE_RECORD_CHAIN_BACK_H
#define SLIDE_RECORD_CHAIN_BACK_H

#include "record_chain.h"

#include <math.h>

/* Weights of the changes of the wrench become weights of the wrench, in a sample and in the one
 * before, and of the frame in which they are seen. */
SLIDE_CALLED void pull_wrench_changes(const Chain *chain, const SlidePoints *points) {
    const size_t after_rates = chain->n_joints;
    const double *c = row(points->signals, after_rates + FRAME), *s = c + SLIDE_ROOM;
    double *of_c = row(points->of_signals, after_rates + FRAME), *of_s = of_c + SLIDE_ROOM;
    for (size_t part = 0; part < 6; part += 3) {
        const double *x = row(points->signals, WRENCH_CHANGE + part), *y = x + SLIDE_ROOM;
        double *of_x = row(points->of_signals, WRENCH_CHANGE + part), *of_y = of_x + SLIDE_ROOM;
        double *of_z = of_y + SLIDE_ROOM;
        const double *turned_x =
            row(points->of_signals, after_rates + TURNED_WRENCH_CHANGE + part);
        const double *turned_y = turned_x + SLIDE_ROOM, *turned_z = turned_y + SLIDE_ROOM;
        SLIDE_EACH
        for (size_t p = 0; p < points->n_points; ++p) {
            of_x[p] += c[p] * turned_x[p] - s[p] * turned_y[p];
            of_y[p] += s[p] * turned_x[p] + c[p] * turned_y[p];
            of_z[p] += turned_z[p];
            of_c[p] += turned_x[p] * x[p] + turned_y[p] * y[p];
            of_s[p] += turned_x[p] * y[p] - turned_y[p] * x[p];
        }
    }
    for (size_t part = 0; part < 6; ++part) {
        pull_changes(points, 1, row(points->of_signals, WRENCH_CHANGE + part),
                     row(points->of_signals, WRENCH + part));
    }
}

/* The weighted sum of all signals but the changes, in samples from a place on. */
SLIDE_CALLED Motions weighted_loads(const Chain *chain, const SlidePoints *points, size_t at) {
    const size_t after_rates = chain->n_joints, n_signals = after_rates + TURNED_MOMENTUM + 6;
    const size_t ranges[][2] = {{WRENCH, WRENCH_CHANGE},
                                {POSITION, after_rates + TURNED_WRENCH_CHANGE},
                                {after_rates + TURNED_INERTIA, n_signals}};
    Motions sum = {0};
    write_loads(chain, chain->joints, points->scratch, SLIDE_MOTIONS);
    for (size_t range = 0; range < 3; ++range) {
        for (size_t i = ranges[range][0]; i < ranges[range][1]; ++i) {
            sum += motions_at(points->of_signals + i * SLIDE_ROOM + at) *
                   motions_at(points->scratch + i * SLIDE_MOTIONS);
        }
    }
    return sum;
}

/* By the place of a joint, in rad or m: the five-point formula. */
SLIDE_CALLED Motions slope_by_place(const Chain *chain, const SlidePoints *points, size_t at,
                              size_t joint) {
    static const double weights[] = {1.0 / 12, -2.0 / 3, 2.0 / 3, -1.0 / 12};
    static const double moves[] = {-2, -1, 1, 2};
    const double distance = 1e-3;
    const Joint before = chain->joints[joint];
    Motions slope = {0};
    for (size_t i = 0; i < 4; ++i) {
        const double move = distance * moves[i];
        const Motions c = each(cos(move)), s = each(sin(move));
        Joint *moved = &chain->joints[joint];
        if (chain->links[joint].prismatic) {
            moved->slide = before.slide + move;
        } else {
            moved->turned.c = c * before.turned.c - s * before.turned.s;
            moved->turned.s = s * before.turned.c + c * before.turned.s;
        }
        slope += weights[i] / distance * weighted_loads(chain, points, at);
        *moved = before;
    }
    return slope;
}

/* By the rate, which signals are quadratic in. */
static Motions slope_by_rate(const Chain *chain, const SlidePoints *points, size_t at,
                             size_t joint) {
    Motions *rate = &chain->joints[joint].rate;
    const Motions before = *rate;
    *rate = before + 1;
    const Motions faster = weighted_loads(chain, points, at);
    *rate = before - 1;
    const Motions slower = weighted_loads(chain, points, at);
    *rate = before;
    return 0.5 * (faster - slower);
}

/* By the acceleration, which signals are linear in; base: their weighted sum as they are. */
static Motions slope_by_acceleration(const Chain *chain, const SlidePoints *points, size_t at,
                                     size_t joint, Motions base) {
    Motions *acceleration = &chain->joints[joint].acceleration;
    const Motions before = *acceleration;
    *acceleration = before + 1;
    const Motions slope = weighted_loads(chain, points, at) - base;
    *acceleration = before;
    return slope;
}

/* From how a joint moves to the three set points that it follows (set_joint of chain.h). */
SLIDE_CALLED void pull_joint(const Chain *chain, const SlidePoints *points, size_t at, size_t joint,
                       Motions base) {
    const Link *link = &chain->links[joint];
    const double *law = chain->law, half = link->prismatic ? link->slide_half_range
                                                           : link->half_range;
    const double places[] = {law[0], 1 - law[0] - law[1], law[1]};
    const double rates[] = {law[2], 1 - 2 * law[2], law[2] - 1};
    const double curvatures[] = {law[3], -2 * law[3], law[3]};
    const Motions by_place = half * slope_by_place(chain, points, at, joint);
    const Motions by_rate = link->rate * slope_by_rate(chain, points, at, joint);
    const Motions by_acceleration =
        link->acceleration * slope_by_acceleration(chain, points, at, joint, base);
    double *to = points->of_inputs + joint * SLIDE_ROOM + at;
    for (size_t age = 0; age < 3; ++age, to -= points->records) {
        *(LooseMotions *)to += places[age] * by_place + rates[age] * by_rate +
                               curvatures[age] * by_acceleration;
    }
}

static void pull_chain(const SlideFeatures *features, const SlidePoints *points) {
    const Chain *chain = features->own;
    const size_t first = SLIDE_LEAD - points->records;
    pull_wrench_changes(chain, points);
    for (size_t at = first; at < SLIDE_LEAD + points->n_points; at += SLIDE_MOTIONS) {
        follow_points(chain, points, at, chain->joints);
        const Motions base = weighted_loads(chain, points, at);
        for (size_t joint = 0; joint < chain->n_joints; ++joint) {
            pull_joint(chain, points, at, joint, base);
        }
    }
}

#endif
