/* Angles of many samples at once: plain loops over numbers that lie one after the other. */
#ifndef SLIDE_RECORD_DIRECTOR_H
#define SLIDE_RECORD_DIRECTOR_H

#include "director.h"
#include "record_differences.h"

#include <math.h>

static const double HALF_TURN = 3.14159265358979323846;

/* Into (-pi, pi]. */
static inline double wrapped_turn(double turn) {
    return turn - 2 * HALF_TURN * ceil((turn - HALF_TURN) / (2 * HALF_TURN));
}

/* The angle of a vector in (-pi, pi], as atan2 has it up to some units of its rounding; that of no
 * vector is 0. An arc tangent of at most tan(pi / 8) is a fraction of polynomials (Cephes). */
static inline double angle_of(double x, double y) {
    const double across = fabs(y), along = fabs(x);
    const double less = across < along ? across : along, more = across < along ? along : across;
    const int far = less > 0.41421356237309503 * more;
    const double denominator = far ? less + more : more;
    const double z = (far ? less - more : less) / (denominator > 0 ? denominator : 1);
    const double u = z * z;
    double p = -8.750608600031904122785e-1;
    p = p * u - 1.615753718733365076637e1;
    p = p * u - 7.500855792314704667340e1;
    p = p * u - 1.228866684490136173410e2;
    p = p * u - 6.485021904942025371773e1;
    double q = u + 2.485846490142306297962e1;
    q = q * u + 1.650270098316988542046e2;
    q = q * u + 4.328810604912902668951e2;
    q = q * u + 4.853903996359136964868e2;
    q = q * u + 1.945506571482613964425e2;
    double angle = (z + z * (u * p / q)) + (far ? HALF_TURN / 4 : 0);
    angle = across > along ? HALF_TURN / 2 - angle : angle;
    angle = x < 0 ? HALF_TURN - angle : angle;
    return y < 0 ? -angle : angle;
}

/* By how much a vector is turned against the one before. */
static inline double angle_between(double x_before, double y_before, double x, double y) {
    return angle_of(x_before * x + y_before * y, x_before * y - y_before * x);
}

/* Cosine and sine of an angle, two rows; that of no vector is 1, 0. */
SLIDE_CALLED void form_direction(const Angle *angle, const double *x, size_t count,
                                 double *direction) {
    const double *y = x + SLIDE_ROOM;
    double *c = direction, *s = direction + SLIDE_ROOM;
    SLIDE_EACH
    for (size_t p = 0; angle->director && p < count; ++p) {
        const double length = sqrt(x[p] * x[p] + y[p] * y[p]);
        c[p] = length > 0 ? x[p] / length : 1;
        s[p] = length > 0 ? y[p] / length : 0;
    }
    SLIDE_EACH
    for (size_t p = 0; !angle->director && p < count; ++p) {
        const double turn = angle->middle + angle->half_range * x[p];
        c[p] = cos(turn), s[p] = sin(turn);
    }
}

/* The turns of an angle, also in the sample before. */
SLIDE_CALLED void form_turns(const Angle *angle, const SlidePoints *points, double *turns) {
    const size_t records = points->records, count = points->n_points + records;
    const double *x = row(points->inputs, angle->input) - records, *x_before = x - records;
    const double *y = x + SLIDE_ROOM, *y_before = x_before + SLIDE_ROOM;
    turns -= records;
    if (angle->director) {
        SLIDE_EACH
        for (size_t p = 0; p < count; ++p) {
            turns[p] = angle_between(x_before[p], y_before[p], x[p], y[p]);
        }
        return;
    }
    SLIDE_EACH
    for (size_t p = 0; p < count; ++p) {
        const double before = angle->middle + angle->half_range * x_before[p];
        turns[p] = wrapped_turn(angle->middle + angle->half_range * x[p] - before);
    }
}

SLIDE_CALLED void form_directors(const SlideFeatures *features, const SlidePoints *points) {
    const Directors *directors = features->own;
    const size_t n = directors->n_angles, m = directors->n_others;
    SLIDE_EACH
    for (size_t k = 0; k < n; ++k) {
        const Angle *angle = &directors->angles[k];
        double *turns = row(points->signals, 2 * n + k);
        form_direction(angle, row(points->inputs, angle->input), points->n_points,
                       row(points->signals, 2 * k));
        form_turns(angle, points, turns);
        form_changes(points, turns, row(points->signals, 3 * n + k));
    }
    SLIDE_EACH
    for (size_t k = 0; k < m; ++k) {
        const double *input = row(points->inputs, directors->others[k]);
        memcpy(row(points->signals, 4 * n + k), input, points->n_points * sizeof *input);
        form_changes(points, input, row(points->signals, 4 * n + m + k));
    }
}

/* From the gradient by angles, from a place of the inputs on, to that by these inputs. An angle
 * moves with its director across it, over its length squared. */
SLIDE_CALLED void pull_angles(const Angle *angle, const double *x, size_t count,
                              const double *of_angles, double *of_x) {
    const double *y = x + SLIDE_ROOM;
    SLIDE_EACH
    for (size_t p = 0; angle->director && p < count; ++p) {
        const double square = x[p] * x[p] + y[p] * y[p];
        const double slope = square > 0 ? of_angles[p] / square : 0;
        of_x[p] -= y[p] * slope;
        (of_x + SLIDE_ROOM)[p] += x[p] * slope;
    }
    SLIDE_EACH
    for (size_t p = 0; !angle->director && p < count; ++p) {
        of_x[p] += angle->half_range * of_angles[p];
    }
}

SLIDE_CALLED void pull_directors(const SlideFeatures *features, const SlidePoints *points) {
    const Directors *directors = features->own;
    const size_t n = directors->n_angles, m = directors->n_others;
    const size_t before = 2 * points->records; /* the angles of two samples before count, too */
    double *of_angles = points->scratch + SLIDE_LEAD;
    SLIDE_EACH
    for (size_t k = 0; k < n; ++k) {
        const Angle *angle = &directors->angles[k];
        const double *c = row(points->signals, 2 * k), *s = c + SLIDE_ROOM;
        const double *of_c = row(points->of_signals, 2 * k), *of_s = of_c + SLIDE_ROOM;
        memset(points->scratch, 0, SLIDE_ROOM * sizeof *points->scratch);
        SLIDE_EACH
        for (size_t p = 0; p < points->n_points; ++p) {
            of_angles[p] = of_s[p] * c[p] - of_c[p] * s[p];
        }
        pull_changes(points, 1, row(points->of_signals, 2 * n + k), of_angles);
        pull_changes(points, 2, row(points->of_signals, 3 * n + k), of_angles);
        pull_angles(angle, row(points->inputs, angle->input) - before, points->n_points + before,
                    of_angles - before, row(points->of_inputs, angle->input) - before);
    }
    SLIDE_EACH
    for (size_t k = 0; k < m; ++k) {
        double *of_input = row(points->of_inputs, directors->others[k]);
        pull_changes(points, 0, row(points->of_signals, 4 * n + k), of_input);
        pull_changes(points, 1, row(points->of_signals, 4 * n + m + k), of_input);
    }
}

#endif
