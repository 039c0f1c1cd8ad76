/* All kinds of variables, as slide_fmu/fmu/description/variables.py lists them.
 * Made by python -m slide_fmu.fmu.description.generate; do not edit. */
#ifndef SLIDE_VARIABLE_KINDS_H
#define SLIDE_VARIABLE_KINDS_H

/* A value reference is the number of a kind times this plus an index. */
enum { SLIDE_REFERENCES_PER_KIND = 1000000 };

/* KIND(name, number, causality, type, one for each of what, what the surrogate must
 * have, number of values, first version of FMI) */
#define SLIDE_VARIABLE_KINDS(KIND) \
    KIND(INPUT, 0, INPUT, REAL, INPUT, ALWAYS, SCALAR, 2) \
    KIND(OUTPUT, 1, OUTPUT, REAL, OUTPUT, ALWAYS, SCALAR, 2) \
    KIND(ERROR_ESTIMATE, 2, OUTPUT, REAL, OUTPUT, ESTIMATOR, SCALAR, 2) \
    KIND(WINDOW_FILLED, 3, OUTPUT, REAL, ONE, ALWAYS, SCALAR, 2) \
    KIND(ESTIMATE_FILLED, 4, OUTPUT, REAL, ONE, ESTIMATOR, SCALAR, 2) \
    KIND(TRUNCATION_ERROR, 5, OUTPUT, REAL, OUTPUT, STATE_SPACE, SCALAR, 2) \
    KIND(IN_RANGE, 6, OUTPUT, BOOLEAN, ONE, ALWAYS, SCALAR, 2) \
    KIND(PREHISTORY_KNOWN, 7, PARAMETER, REAL, ONE, ALWAYS, SCALAR, 2) \
    KIND(INITIAL_INPUT, 8, PARAMETER, REAL, INPUT, ALWAYS, SCALAR, 2) \
    KIND(TIME, 9, INDEPENDENT, REAL, ONE, ALWAYS, SCALAR, 3) \
    KIND(OUTPUT_WINDOW, 10, LOCAL, REAL, OUTPUT, SEVERAL_SAMPLES, BLOCK, 3) \
    KIND(INITIAL_WINDOW, 11, PARAMETER, REAL, INPUT, ALWAYS, SAMPLED, 3) \
    KIND(INPUTS_AT_STEP_END, 12, PARAMETER, REAL, ONE, FIRST_ORDER, SCALAR, 2)

#endif
