/* In place of exact.c in a page, likewise. */
#include "exact.h"

void slide_activate_exact(uint32_t activation, double *x, size_t count) {
    (void)activation;
    (void)x;
    (void)count;
    __builtin_trap();
}
