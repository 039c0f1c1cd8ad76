/* Places arrays one after the other in one block. Without a block it only measures, so the same
 * code finds the size first and fills the block afterwards. */
#ifndef SLIDE_ARENA_H
#define SLIDE_ARENA_H

#include <stddef.h>
#include <stdint.h>

#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#error "results that are not finite must be noticed: compile without -ffast-math and -Ofast"
#endif

enum { SLIDE_ALIGNMENT = 64 };

typedef struct {
    unsigned char *base; /* NULL while measuring */
    size_t used;
} SlideArena;

static inline void *slide_place(SlideArena *arena, size_t count, size_t size) {
    size_t start = (arena->used + SLIDE_ALIGNMENT - 1) / SLIDE_ALIGNMENT * SLIDE_ALIGNMENT;
    arena->used = start + count * size;
    return arena->base == NULL ? NULL : arena->base + start;
}

/* Size of a ring with so many places: the place of a number is a mask of it, not a division. */
static inline uint64_t slide_power_of_two(uint64_t least) {
    uint64_t size = 1;
    while (size < least) {
        size *= 2;
    }
    return size;
}

#endif
