/* Checks of state-space networks below the FMI functions. */
#ifndef CELL_DRIVER_H
#define CELL_DRIVER_H

#include "stream.h"

/* Largest error of the kernel's cells against double precision, for several sizes and units. */
void report_cells(const SlideKernel *kernel);

/* Three evaluations of a surrogate file's cell on a made-up input, one line for each step. */
int evaluate_three_ways(const char *path, int steps);

/* The state after the first of some samples with known outputs, in double precision, one line for each
 * number. The file has scaled inputs, newest first, with those before, and scaled outputs, oldest first. */
int find_first_state(const char *path, const char *numbers, int count);

#endif
