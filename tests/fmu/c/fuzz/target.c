#include "target.h"

#include "surrogate.h"

#include <stdio.h>
#include <stdlib.h>

void fuzz_expect(int holds, const char *what) {
    if (!holds) {
        fprintf(stderr, "fuzz target: expected %s\n", what);
        abort();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    FuzzInput input = {data, data + size};
    const int without_fmi = fuzz_u8(&input) == 1;
    fuzz_choose_surrogate(&input);
    if (without_fmi) {
        fuzz_native(&input);
    } else {
        fuzz_calls(&input);
    }
    return 0;
}
