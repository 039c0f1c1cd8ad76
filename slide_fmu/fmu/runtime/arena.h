/* Places arrays one after the other in one block. Without a block it only measures, so the same
 * code finds the size first and fills the block afterwards. */
#ifndef SLIDE_ARENA_H
#define SLIDE_ARENA_H

#include <stddef.h>

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

#endif
