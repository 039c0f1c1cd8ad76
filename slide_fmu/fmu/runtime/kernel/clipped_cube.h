/* The cube of an argument that is clipped (slide_fmu/network/activations.py). Who includes this says
 * before what numbers are, Real. */
#ifndef SLIDE_CLIPPED_CUBE_H
#define SLIDE_CLIPPED_CUBE_H

static inline Real clipped_cube(Real x) {
    const Real bound = 8;
    x = x > bound ? bound : x < -bound ? -bound : x;
    return x * x * x;
}

#endif
