/* Save, restore and serialise the state. A saved state and its serialised form are the same bytes:
 * a header, then the flat state block. */
#include "calls.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STATE_VERSION = 9 };

/* Counters of past inputs: none comes near it, and loops over them end. */
static const uint64_t LARGEST_COUNT = (uint64_t)1 << 62;

typedef struct {
    char magic[8];
    uint32_t version;
    uint32_t checksum; /* CRC-32 of the state block; 0 unless serialised */
    uint64_t size;     /* of the state block, bytes */
    char guid[48];     /* of the surrogate; its rest is zero */
} StateHeader;

static const char MAGIC[8] = "SLIDEST";

static StateHeader header_of(const SlideInstance *instance) {
    StateHeader header = {{0}, STATE_VERSION, 0, instance->state.size, {0}};
    memcpy(header.magic, MAGIC, sizeof header.magic);
    strcpy(header.guid, instance->model.guid);
    return header;
}

static size_t saved_size(const SlideInstance *instance) {
    return sizeof(StateHeader) + instance->state.size;
}

/* Does a saved state belong to this surrogate? The bytes may be at any alignment. */
static bool belongs(const SlideInstance *instance, const void *saved, const char *function) {
    StateHeader expected = header_of(instance), found;
    memcpy(&found, saved, sizeof found);
    const char *fault = NULL;
    if (memcmp(found.magic, expected.magic, sizeof found.magic) != 0) {
        fault = "this is no state of a SLIDE FMU";
    } else if (found.version != expected.version) {
        fault = "the state is of another version of the runtime";
    } else if (memcmp(found.guid, expected.guid, sizeof found.guid) != 0) {
        fault = "the state belongs to another FMU (other GUID)";
    } else if (found.size != expected.size) {
        fault = "the state has another size than this FMU's";
    }
    if (fault != NULL) {
        slide_report(instance, SLIDE_ERROR, "%s: %s; nothing was changed", function, fault);
    }
    return fault == NULL;
}

/* The instance, where no argument is missing and a state that is given is its own. */
static SlideInstance *enter(void *component, bool complete, const void *state,
                            const char *function) {
    SlideInstance *instance = slide_enter(component, SLIDE_ANY_MODE, function);
    if (instance != NULL && !complete) {
        slide_null(instance, function);
        return NULL;
    }
    bool own = instance != NULL && (state == NULL || belongs(instance, state, function));
    return own ? instance : NULL;
}

SlideStatus slide_save(void *component, void **state, const char *function) {
    const void *given = state == NULL ? NULL : *state;
    SlideInstance *instance = enter(component, state != NULL, given, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    unsigned char *saved = *state != NULL ? *state : malloc(saved_size(instance));
    if (saved == NULL) {
        return slide_report(instance, SLIDE_ERROR, "%s: out of memory", function);
    }
    StateHeader header = header_of(instance);
    memcpy(saved, &header, sizeof header);
    memcpy(saved + sizeof header, instance->state.head, instance->state.size);
    *state = saved;
    return SLIDE_OK;
}

SlideStatus slide_restore(void *component, const void *state, const char *function) {
    SlideInstance *instance = enter(component, state != NULL, state, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    const unsigned char *saved = state;
    memcpy(instance->state.head, saved + sizeof(StateHeader), instance->state.size);
    return SLIDE_OK;
}

SlideStatus slide_free_state(void *component, void **state, const char *function) {
    SlideInstance *instance = slide_enter(component, SLIDE_ANY_MODE, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return SLIDE_OK;
}

SlideStatus slide_serialized_size(void *component, const void *state, size_t *size,
                                  const char *function) {
    SlideInstance *instance = enter(component, state != NULL && size != NULL, state, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    *size = saved_size(instance);
    return SLIDE_OK;
}

SlideStatus slide_serialize(void *component, const void *state, void *bytes, size_t size,
                            const char *function) {
    SlideInstance *instance = enter(component, state != NULL && bytes != NULL, state, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    if (size < saved_size(instance)) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: room for %llu bytes; expected %llu, the size that this FMU "
                            "gives for its serialised state",
                            function, (unsigned long long)size,
                            (unsigned long long)saved_size(instance));
    }
    const unsigned char *block = (const unsigned char *)state + sizeof(StateHeader);
    StateHeader header = header_of(instance);
    header.checksum = slide_crc32(block, instance->state.size);
    memcpy(bytes, &header, sizeof header);
    memcpy((unsigned char *)bytes + sizeof header, block, instance->state.size);
    return SLIDE_OK;
}

/* Check the content of a serialised state of the right size. */
static bool is_intact(const SlideInstance *instance, const unsigned char *bytes) {
    StateHeader header;
    SlideHead head;
    memcpy(&header, bytes, sizeof header);
    memcpy(&head, bytes + sizeof header, sizeof head);
    bool known_mode = head.mode == SLIDE_INSTANTIATED || head.mode == SLIDE_INITIALIZATION ||
                      head.mode == SLIDE_STEPPING || head.mode == SLIDE_TERMINATED;
    const unsigned char *block = bytes + sizeof header;
    const SlideState *state = &instance->state;
    size_t counter = (size_t)((const char *)state->history.count - (const char *)state->head);
    uint64_t steps;
    memcpy(&steps, block + counter, sizeof steps);
    return known_mode && steps < LARGEST_COUNT && isfinite(slide_clock_time(&head.clock)) &&
           header.checksum == slide_crc32(block, instance->state.size);
}

SlideStatus slide_deserialize(void *component, const void *bytes, size_t size, void **state,
                              const char *function) {
    SlideInstance *instance = enter(component, bytes != NULL && state != NULL, NULL, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    if (size != saved_size(instance)) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: %llu bytes; expected %llu; is the state of another FMU, or cut "
                            "off?",
                            function, (unsigned long long)size,
                            (unsigned long long)saved_size(instance));
    }
    if (!belongs(instance, bytes, function)) {
        return SLIDE_ERROR;
    }
    if (!is_intact(instance, bytes)) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: the state is damaged: its checksum does not match its content",
                            function);
    }
    void *saved = malloc(size);
    if (saved == NULL) {
        return slide_report(instance, SLIDE_ERROR, "%s: out of memory", function);
    }
    memcpy(saved, bytes, size);
    *state = saved;
    return SLIDE_OK;
}
