#include "memory.h"

#include <stdlib.h>

void *slide_memory_take(SlideMemoryKind kind, size_t size, SlideMessage *message) {
    (void)kind;
    void *memory = calloc(size, 1);
    if (memory == NULL) {
        slide_say(message, "out of memory: %llu bytes", (unsigned long long)size);
    }
    return memory;
}

void slide_memory_give_back(void *memory) { free(memory); }
