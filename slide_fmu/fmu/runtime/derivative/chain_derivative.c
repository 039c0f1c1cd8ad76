/* Derivatives of the signals of a chain, from four evaluations nearby: in double precision, the
 * five-point formula is exact to about 1e-12 of the largest terms, where features are rounded to
 * 6e-8. So the recursions of chain.c stay the only ones. */
#include "chain.h"

#include <string.h>

static const double TURN = 1e-3; /* rad; of the joint that moves most, to the nearest point */

static void write_nearby(const SlideChain *chain, const double *inputs, const double *d_inputs,
                         double amount) {
    const size_t n = chain->n_joints;
    const double *const moved[4] = {chain->moved, chain->moved + n, chain->moved + 2 * n,
                                    chain->moved + 3 * n};
    for (size_t i = 0; i < 4 * n; ++i) {
        chain->moved[i] = inputs[i] + amount * d_inputs[i];
    }
    slide_chain_write(chain, moved, chain->nearby);
}

/* The turn of the joint that moves most, for the whole of d_inputs. */
static double largest_turn(const SlideChain *chain, const double *d_inputs) {
    const size_t n = chain->n_joints;
    double largest = 0;
    for (size_t i = 0; i < 4 * n; ++i) {
        double range = 2 * chain->links[i % n].half_range;
        largest = fmax(largest, fabs(range * d_inputs[i]));
    }
    return largest;
}

void slide_chain_differentiate(const SlideChain *chain, const double *inputs,
                               const double *d_inputs, double *d_signals) {
    static const double points[4] = {-2, -1, 1, 2};
    static const double weights[4] = {1.0 / 12, -2.0 / 3, 2.0 / 3, -1.0 / 12};
    const size_t n_signals = SLIDE_CHAIN_SIGNALS + chain->n_joints;
    const double largest = largest_turn(chain, d_inputs);
    memset(d_signals, 0, n_signals * sizeof *d_signals);
    for (size_t point = 0; largest > 0 && point < 4; ++point) {
        write_nearby(chain, inputs, d_inputs, points[point] * (TURN / largest));
        for (size_t i = 0; i < n_signals; ++i) {
            d_signals[i] += weights[point] * (largest / TURN) * chain->nearby[i];
        }
    }
}
