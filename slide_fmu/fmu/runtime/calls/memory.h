/* Where memory of instances and of saved states comes from: from the heap (memory.c), or, in scalar
 * sources, from static arrays (scalar/memory.c). */
#ifndef SLIDE_MEMORY_H
#define SLIDE_MEMORY_H

#include "bytes.h"

typedef enum { SLIDE_INSTANCE_MEMORY, SLIDE_SAVED_STATE_MEMORY } SlideMemoryKind;

/* Zeroed bytes; or NULL, with a message. */
void *slide_memory_take(SlideMemoryKind kind, size_t size, SlideMessage *message);

/* memory: what slide_memory_take gave, or NULL. */
void slide_memory_give_back(void *memory);

#endif
