/* A quarter car: body on a spring with a cubic part and an asymmetric damper, wheel on a tyre, road.
 * States: heights of body and wheel above their rest, in m, and their rates, in m/s. */
#include <math.h>

enum { STATES = 4, PARAMETERS = 7, OUTPUTS = 3 };

enum { BODY_MASS, WHEEL_MASS, SPRING, BUMP_STOP, DAMPER, ASYMMETRY, TYRE };

static const double START_PARAMETERS[PARAMETERS] = {
    300.0, 40.0, 18000.0, 4.0e6, 1800.0, 0.4, 180000.0};

/* Bend of the damper's line between compression and extension, in m/s. */
static const double BEND = 0.05;

static void equations(const double *p, const double *x, double road, double *rates, double *outputs) {
    const double travel = x[0] - x[1], speed = x[2] - x[3];
    const double bend = sqrt(speed * speed + BEND * BEND) - BEND;
    const double force = p[SPRING] * travel + p[BUMP_STOP] * travel * travel * travel
                         + p[DAMPER] * (speed + p[ASYMMETRY] * bend);
    rates[0] = x[2];
    rates[1] = x[3];
    rates[2] = -force / p[BODY_MASS];
    rates[3] = (force - p[TYRE] * (x[1] - road)) / p[WHEEL_MASS];
    outputs[0] = rates[2];    /* acceleration of the body, m/s2 */
    outputs[1] = travel;      /* travel of the suspension, m */
    outputs[2] = x[1] - road; /* deflection of the tyre, m */
}
