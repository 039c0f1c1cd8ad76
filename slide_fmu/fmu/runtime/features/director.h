/* Angles as features see them. Shared by those who form the signals of single steps (director.c)
 * and of whole records (records/record_director.h). */
#ifndef SLIDE_DIRECTOR_H
#define SLIDE_DIRECTOR_H

#include "feature_set.h"

/* An input that is an angle, or the cosine of one. */
typedef struct {
    size_t input;
    bool director;
    double middle, half_range; /* rad; of one that is an angle itself */
} Angle;

typedef struct {
    size_t n_angles, n_others;
    Angle *angles;  /* [n_angles] */
    size_t *others; /* [n_others] inputs that are no angles */
} Directors;

#endif
