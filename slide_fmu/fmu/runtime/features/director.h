/* Direction, turn and change of the turn of an angle given by cosine and sine
 * (slide_fmu/features/director.py). */
#ifndef SLIDE_DIRECTOR_H
#define SLIDE_DIRECTOR_H

#include "feature_set.h"

extern const SlideFeatureSet slide_director;

#endif
