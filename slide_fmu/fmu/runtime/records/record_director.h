/* Angles of many samples at once: plain loops over numbers that lie one after the other. */
#ifndef SLIDE_RECORD_DIRECTOR_H
#define SLIDE_RECORD_DIRECTOR_H

#include "chain_angle.h"
#include "director.h"

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
static void form_direction(const Angle *angle, const double *x, size_t count, double *direction) {
    const double *y = x + SLIDE_ROOM;
    double *c = direction, *s = direction + SLIDE_ROOM;
    for (size_t p = 0; angle->director && p < count; ++p) {
        const double length = sqrt(x[p] * x[p] + y[p] * y[p]);
        c[p] = length > 0 ? x[p] / length : 1;
        s[p] = length > 0 ? y[p] / length : 0;
    }
    for (size_t p = 0; !angle->director && p < count; ++p) {
        const double turn = angle->middle + angle->half_range * x[p];
        c[p] = cos(turn), s[p] = sin(turn);
    }
}

#endif
