/* In place of arena.h, which it keeps from being included: the same, with a gap behind every array
 * that a sanitizer does not let anybody touch. The state is one block that is copied as a whole: the
 * gaps in it are opened when it is reset. */
#ifndef SLIDE_ARENA_H
#define SLIDE_ARENA_H

#include <stddef.h>
#include <stdint.h>

enum { SLIDE_ALIGNMENT = 64 };

typedef struct {
    unsigned char *base;
    size_t used;
} SlideArena;

/* Close or open memory; no effect without the address sanitizer. */
void fuzz_close(void *begin, size_t size);
void fuzz_open(void *begin, size_t size);

static inline void *slide_place(SlideArena *arena, size_t count, size_t size) {
    size_t start = (arena->used + SLIDE_ALIGNMENT - 1) / SLIDE_ALIGNMENT * SLIDE_ALIGNMENT;
    size_t end = start + count * size;
    arena->used = end + SLIDE_ALIGNMENT;
    if (arena->base == NULL) {
        return NULL;
    }
    fuzz_close(arena->base + end, SLIDE_ALIGNMENT);
    return arena->base + start;
}

static inline uint64_t slide_power_of_two(uint64_t least) {
    uint64_t size = 1;
    while (size < least) {
        size *= 2;
    }
    return size;
}

#endif
