/* Inputs, their changes and the changes of these (slide_fmu/features/differences.py). */
#ifndef SLIDE_DIFFERENCES_H
#define SLIDE_DIFFERENCES_H

#include "feature_set.h"

extern const SlideFeatureSet slide_differences;

#endif
