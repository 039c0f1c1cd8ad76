/* The fuzz target: what it does with bytes, and what it checks. */
#ifndef FUZZ_TARGET_H
#define FUZZ_TARGET_H

#include "input.h"

/* Choose a surrogate, make one instance of it in each standard, and call functions as the bytes
 * say. */
void fuzz_calls(FuzzInput *input);

/* The surrogate without FMI: parts of a step, many windows at once, with any kernel. */
void fuzz_native(FuzzInput *input);

/* End the program with a message unless a condition holds. */
void fuzz_expect(int holds, const char *what);

/* As libFuzzer calls it. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
