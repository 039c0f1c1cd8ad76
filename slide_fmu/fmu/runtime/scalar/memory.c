/* In place of memory.c in scalar source FMUs: all memory is in static arrays, whose sizes are known
 * when they are compiled. Instances that share them must be made and freed by one thread. */
#include "memory.h"

#include <string.h>

#if !defined(SLIDE_INSTANCES)
#define SLIDE_INSTANCES 1 /* at a time */
#endif
#if !defined(SLIDE_SAVED_STATES)
#define SLIDE_SAVED_STATES 1 /* of all instances, at a time; may be 0 */
#endif
#if SLIDE_INSTANCES < 1 || SLIDE_SAVED_STATES < 0
#error "expected SLIDE_INSTANCES of at least 1 and SLIDE_SAVED_STATES of at least 0"
#endif

/* Aligned for all types. SLIDE_INSTANCE_BYTES and SLIDE_SAVED_STATE_BYTES: own_names.h. */
typedef union {
    unsigned char bytes[SLIDE_INSTANCE_BYTES];
    uint64_t aligned_as;
} InstancePlace;

typedef union {
    unsigned char bytes[SLIDE_SAVED_STATE_BYTES];
    uint64_t aligned_as;
} SavedStatePlace;

static InstancePlace instances[SLIDE_INSTANCES];
static bool instances_taken[SLIDE_INSTANCES];
#if SLIDE_SAVED_STATES > 0
static SavedStatePlace saved_states[SLIDE_SAVED_STATES];
static bool saved_states_taken[SLIDE_SAVED_STATES];
#else
static SavedStatePlace *const saved_states = NULL;
static bool *const saved_states_taken = NULL;
#endif

/* Places of one kind, which lie one after the other. */
typedef struct {
    unsigned char *first;
    bool *taken; /* [count] */
    size_t count, room, stride;
    const char *what, *macro;
} Places;

static Places places_for(SlideMemoryKind kind) {
    const Places of_instances = {(unsigned char *)instances, instances_taken, SLIDE_INSTANCES,
                                 SLIDE_INSTANCE_BYTES, sizeof(InstancePlace), "instances",
                                 "SLIDE_INSTANCES"};
    const Places of_states = {(unsigned char *)saved_states, saved_states_taken,
                              SLIDE_SAVED_STATES, SLIDE_SAVED_STATE_BYTES,
                              sizeof(SavedStatePlace), "saved states", "SLIDE_SAVED_STATES"};
    return kind == SLIDE_INSTANCE_MEMORY ? of_instances : of_states;
}

void *slide_memory_take(SlideMemoryKind kind, size_t size, SlideMessage *message) {
    const Places places = places_for(kind);
    if (size > places.room) {
        slide_say(message, "%lu bytes are needed; expected at most %lu, which own_names.h has "
                           "room for: is the instance's name longer than 255 characters?",
                  (unsigned long)size, (unsigned long)places.room);
        return NULL;
    }
    for (size_t i = 0; i < places.count; ++i) {
        if (!places.taken[i]) {
            places.taken[i] = true;
            return memset(places.first + i * places.stride, 0, size);
        }
    }
    slide_say(message, "all %lu %s are in use; free one, or compile with -D%s=N of a larger N",
              (unsigned long)places.count, places.what, places.macro);
    return NULL;
}

static void give_back_to(const Places *places, const unsigned char *memory) {
    for (size_t i = 0; i < places->count; ++i) {
        if (places->first + i * places->stride == memory) {
            places->taken[i] = false;
        }
    }
}

void slide_memory_give_back(void *memory) {
    const Places of_instances = places_for(SLIDE_INSTANCE_MEMORY);
    const Places of_states = places_for(SLIDE_SAVED_STATE_MEMORY);
    give_back_to(&of_instances, memory);
    give_back_to(&of_states, memory);
}
