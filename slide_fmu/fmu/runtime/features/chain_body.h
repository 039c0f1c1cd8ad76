/* The links of a serial chain, from the last one inwards, as they move seen from each joint: the
 * recursion of chain.h. */
#ifndef SLIDE_CHAIN_BODY_H
#define SLIDE_CHAIN_BODY_H

#include "chain_angle.h"
#include "dialect.h"

#include <stdbool.h>

/* As in the kernels, products and sums are fused where the processor can. GCC has no such
 * pragma. */
#ifdef __clang__
#pragma STDC FP_CONTRACT ON
#endif

/* Axes of joints are mostly parallel or cross at a right angle: then most products of a turn would
 * be with 0 or 1. */
typedef enum { ANY_TURN, NO_TURN, QUARTER_TURN } TurnKind;

/* One joint and the link that it moves: slide_fmu/features/serial_chain.py. */
typedef struct {
    bool prismatic;
    double middle, half_range;             /* rad; of the turn about z, of the scaled input */
    double slide_middle, slide_half_range; /* m; of the way along z; prismatic joints only */
    double rate, acceleration;             /* by s, s^2; of changes of the scaled input */
    double step[3];                        /* m; the way of a prismatic joint apart */
    double cos_alpha, sin_alpha; /* of the turn about x from the axes before */
    TurnKind twist;              /* what this turn is */
    double all; /* kg; the link and all further out */
    /* Of the link, and of the masses further out as if they were in the origin of its frame; seen
     * from the frame before it, turned and moved with the joint. */
    double first[3];            /* kg m; moment of mass */
    double square[3], mixed[3]; /* kg m^2; integrals of xx, yy, zz and of yz, xz, xy */
} Link;

/* A joint in each of the motions. */
typedef struct Joint {
    Turn turned;
    Motions slide, rate, acceleration;
} Joint;

/* All links from some joint on, as they move seen from the frame before it: sums over their masses
 * m at places r with velocities v, in each of the motions. */
typedef struct {
    Motions first[3];            /* m r */
    Motions momentum[3];         /* m v */
    Motions force[3];            /* m dv/dt */
    Motions square[3], mixed[3]; /* of m r r': xx, yy, zz and yz, xz, xy */
    Motions flow[3][3];          /* m v r': [component of v][component of r] */
    Motions moment[3];           /* m r x dv/dt */
    Motions tool[3];             /* its place */
} Body;

enum { X, Y, Z };

/* Two components of a vector, the axis being across them. */
SLIDE_INLINE void turn_pair(Motions *x, Motions *y, Turn turn, TurnKind kind) {
    const Motions u = *x, v = *y;
    if (kind == QUARTER_TURN) {
        *x = -turn.s * v, *y = turn.s * u;
        return;
    }
    *x = turn.c * u - turn.s * v;
    *y = turn.s * u + turn.c * v;
}

/* A two by two block of a matrix, from both sides. With e = s (xx - yy) + c (xy + yx), all that
 * changes follows from s e and c e. */
SLIDE_INLINE void turn_block(Motions *xx, Motions *xy, Motions *yx, Motions *yy, Turn turn,
                             TurnKind kind) {
    const Motions before[2] = {*xy, *yx};
    if (kind == QUARTER_TURN) {
        const Motions other = *xx;
        *xx = *yy, *yy = other;
        *xy = -before[1], *yx = -before[0];
        return;
    }
    const Motions e = turn.s * (*xx - *yy) + turn.c * (*xy + *yx);
    const Motions moved = turn.s * e, mixed = turn.c * e;
    *xx -= moved, *yy += moved;
    *xy = mixed - before[1], *yx = mixed - before[0];
}

SLIDE_INLINE void turn_vector(Motions *v, int axis, Turn turn, TurnKind kind) {
    turn_pair(&v[(axis + 1) % 3], &v[(axis + 2) % 3], turn, kind);
}

/* What does not depend on motion. */
SLIDE_INLINE void turn_masses(Body *body, int axis, Turn turn, TurnKind kind) {
    const int p = (axis + 1) % 3, q = (axis + 2) % 3;
    Motions other = body->mixed[axis];
    turn_vector(body->first, axis, turn, kind);
    turn_block(&body->square[p], &body->mixed[axis], &other, &body->square[q], turn, kind);
    turn_pair(&body->mixed[q], &body->mixed[p], turn, kind);
    turn_vector(body->tool, axis, turn, kind);
}

SLIDE_INLINE void turn_motion(Body *body, int axis, Turn turn, TurnKind kind) {
    const int p = (axis + 1) % 3, q = (axis + 2) % 3;
    turn_vector(body->momentum, axis, turn, kind);
    turn_vector(body->force, axis, turn, kind);
    turn_block(&body->flow[p][p], &body->flow[p][q], &body->flow[q][p], &body->flow[q][q], turn, kind);
    turn_pair(&body->flow[p][axis], &body->flow[q][axis], turn, kind);
    turn_pair(&body->flow[axis][p], &body->flow[axis][q], turn, kind);
    turn_vector(body->moment, axis, turn, kind);
}

/* Seen from a point that lies back by the link's step; but for its mass in the present origin. */
SLIDE_INLINE void shift_masses(Body *body, const Link *link) {
    const Motions *first = body->first;
    for (int i = X; i <= Z; ++i) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        const Motions step = each(link->step[i]);
        body->square[i] += (step + step) * first[i];
        body->mixed[i] += each(link->step[p]) * first[q] + each(link->step[q]) * first[p];
    }
}

SLIDE_INLINE void shift_motion(Body *body, const Link *link) {
    const Motions *momentum = body->momentum, *force = body->force;
    for (int i = X; i <= Z; ++i) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        for (int j = X; j <= Z; ++j) {
            body->flow[i][j] += each(link->step[j]) * momentum[i];
        }
        body->moment[i] += each(link->step[p]) * force[q] - each(link->step[q]) * force[p];
    }
}

SLIDE_INLINE void add_to(Motions *v, const double *constants) {
    for (int i = X; i <= Z; ++i) {
        v[i] += each(constants[i]);
    }
}

/* The link, and what further masses add to the sums by where their origin is. */
SLIDE_INLINE void add_link(Body *body, const Link *link) {
    add_to(body->tool, link->step);
    add_to(body->first, link->first);
    add_to(body->square, link->square);
    add_to(body->mixed, link->mixed);
}

/* The body turns about z besides. With v as before, this adds to accelerations at places r:
 * acceleration z x r + 2 rate z x v + rate^2 z x (z x r). */
SLIDE_INLINE void spin(Body *body, const Joint *joint) {
    const Motions rate = joint->rate, acceleration = joint->acceleration;
    const Motions *square = body->square, *mixed = body->mixed, turned = rate * mixed[Z];
    const Motions *first = body->first;
    Motions(*flow)[3] = body->flow, *momentum = body->momentum;
    const Motions before[2] = {flow[X][Z], flow[Y][Z]}, along = flow[X][X] + flow[Y][Y];
    flow[X][X] -= turned, flow[Y][Y] += turned;
    flow[X][Y] -= rate * square[Y], flow[Y][X] += rate * square[X];
    flow[X][Z] -= rate * mixed[X], flow[Y][Z] += rate * mixed[Y];
    body->moment[X] -= acceleration * mixed[Y] + rate * (before[X] + flow[X][Z]);
    body->moment[Y] -= acceleration * mixed[X] + rate * (before[Y] + flow[Y][Z]);
    body->moment[Z] += acceleration * (square[X] + square[Y]) + rate * (along + along);
    const Motions linear[2] = {momentum[X], momentum[Y]};
    momentum[X] -= rate * first[Y], momentum[Y] += rate * first[X];
    body->force[X] -= acceleration * first[Y] + rate * (linear[Y] + momentum[Y]);
    body->force[Y] += acceleration * first[X] + rate * (linear[X] + momentum[X]);
}

/* The body slides along z besides, its mass with it. With v as before, this adds the rate to
 * velocities and the acceleration to accelerations. */
SLIDE_INLINE void slide(Body *body, const Link *link, const Joint *joint) {
    const Motions way = joint->slide, mass = each(link->all);
    Motions *first = body->first, *force = body->force;
    for (int i = X; i <= Z; ++i) {
        body->flow[i][Z] += way * body->momentum[i];
    }
    body->moment[X] -= way * force[Y], body->moment[Y] += way * force[X];
    body->square[Z] += way * (first[Z] + first[Z] + mass * way);
    body->mixed[X] += way * first[Y], body->mixed[Y] += way * first[X];
    first[Z] += mass * way;
    body->tool[Z] += way;
    for (int j = X; j <= Z; ++j) {
        body->flow[Z][j] += joint->rate * first[j];
    }
    body->moment[X] += joint->acceleration * first[Y];
    body->moment[Y] -= joint->acceleration * first[X];
    body->momentum[Z] += mass * joint->rate;
    force[Z] += mass * joint->acceleration;
}

SLIDE_INLINE void turn_body(Body *body, int axis, Turn turn, TurnKind kind) {
    turn_masses(body, axis, turn, kind);
    turn_motion(body, axis, turn, kind);
}

/* One link and the joint that moves it. */
SLIDE_INLINE void pass(const Link *link, const Joint *joint, Body *body) {
    const Turn twist = {each(link->cos_alpha), each(link->sin_alpha)};
    if (link->twist == QUARTER_TURN) {
        turn_body(body, X, twist, QUARTER_TURN);
    } else if (link->twist == ANY_TURN) {
        turn_body(body, X, twist, ANY_TURN);
    }
    shift_motion(body, link);
    shift_masses(body, link);
    add_link(body, link);
    turn_body(body, Z, joint->turned, ANY_TURN);
    if (link->prismatic) {
        slide(body, link, joint);
    } else {
        spin(body, joint);
    }
}

#endif
