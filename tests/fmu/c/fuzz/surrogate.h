/* The surrogate file that instances of the fuzz target read: in memory, and as large as an attacker
 * likes, but for the memory that it may ask for. */
#ifndef FUZZ_SURROGATE_H
#define FUZZ_SURROGATE_H

#include "input.h"

/* Small surrogates of all kinds; written by tests/fmu/fuzz.py. */
extern const unsigned char *const fuzz_samples[];
extern const size_t fuzz_sample_sizes[], fuzz_n_samples;

/* Choose a sample, edit it and repair its checksum, or not: the next bytes say which. */
void fuzz_choose_surrogate(FuzzInput *input);

/* The file and its GUID; a caller gets exactly its bytes, so that a sanitizer sees any read behind
 * them. Free it. */
unsigned char *fuzz_surrogate(size_t *size);
const char *fuzz_guid(void);

/* The resource location, URI or path, where it lies; others are looked for on the disk. */
#define FUZZ_LOCATION "memory"

/* In place of calloc where instances are made: none gets more than this. */
enum { FUZZ_MOST_MEMORY = 1 << 22 };
void *fuzz_calloc(size_t count, size_t size);

/* In place of memset where states are reset: opens their memory (guarded_arena.h). */
void *fuzz_memset(void *begin, int value, size_t size);

#endif
