/* Motion of a serial chain and its loads on the base (slide_fmu/features/serial_chain.py). */
#ifndef SLIDE_CHAIN_MOTION_H
#define SLIDE_CHAIN_MOTION_H

#include "feature_set.h"

extern const SlideFeatureSet slide_chain_motion;

#endif
