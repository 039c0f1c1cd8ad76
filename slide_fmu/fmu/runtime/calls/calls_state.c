/* Save, restore and serialise the state. A saved state and its serialised form have the same layout:
 * a header, then the flat state block. What no result depends on is left as it is in a saved one,
 * which is fast, and zero in a serialised one, so that equal states are equal bytes. */
#include "calls.h"
#include "memory.h"

#include <string.h>

enum { STATE_VERSION = 19 };

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

size_t slide_saved_size(const SlideInstance *instance) {
    return sizeof(StateHeader) + instance->state.size;
}

/* Is no argument missing, and does a saved state that is given belong to this surrogate? The bytes
 * may be at any alignment. */
static SlideStatus check(SlideInstance *instance, bool complete, const void *saved) {
    StateHeader expected = header_of(instance), given = expected;
    const char *fault = NULL;
    if (!complete) {
        return slide_null(instance);
    }
    if (saved != NULL) {
        memcpy(&given, saved, sizeof given);
    }
    if (memcmp(given.magic, expected.magic, sizeof given.magic) != 0) {
        fault = "this is no state of a SLIDE FMU";
    } else if (given.version != expected.version) {
        fault = "the state is of another version of the runtime";
    } else if (memcmp(given.guid, expected.guid, sizeof given.guid) != 0) {
        fault = "the state belongs to another FMU (other GUID)";
    } else if (given.size != expected.size) {
        fault = "the state has another size than this FMU's";
    }
    return fault == NULL ? SLIDE_OK : slide_refuse(instance, fault);
}

/* Room for a saved state, where none is given. */
static SlideStatus find_room(const SlideInstance *instance, void **state) {
    SlideMessage message;
    if (*state == NULL) {
        *state = slide_memory_take(SLIDE_SAVED_STATE_MEMORY, slide_saved_size(instance), &message);
    }
    return *state != NULL ? SLIDE_OK
                          : slide_report(instance, SLIDE_ERROR, "%s", message.text);
}

SlideStatus slide_save(SlideInstance *instance, void **state) {
    SlideStatus status = check(instance, state != NULL, state == NULL ? NULL : *state);
    status = status == SLIDE_OK ? find_room(instance, state) : status;
    if (status != SLIDE_OK) {
        return status;
    }
    StateHeader header = header_of(instance);
    memcpy(*state, &header, sizeof header);
    slide_state_copy(&instance->model, &instance->state, instance->state.head,
                     (unsigned char *)*state + sizeof header);
    return SLIDE_OK;
}

SlideStatus slide_restore(SlideInstance *instance, const void *state) {
    SlideStatus status = check(instance, state != NULL, state);
    if (status != SLIDE_OK) {
        return status;
    }
    const unsigned char *block = (const unsigned char *)state + sizeof(StateHeader);
    if (!slide_state_is_sound(&instance->model, &instance->state, block)) {
        return slide_refuse(instance, "the state is damaged: no state has such counters");
    }
    slide_state_copy(&instance->model, &instance->state, block, instance->state.head);
    return SLIDE_OK;
}

SlideStatus slide_free_state(SlideInstance *instance, void **state) {
    (void)instance;
    if (state != NULL) {
        slide_memory_give_back(*state);
        *state = NULL;
    }
    return SLIDE_OK;
}

SlideStatus slide_serialized_size(SlideInstance *instance, const void *state, size_t *size) {
    SlideStatus status = check(instance, state != NULL && size != NULL, state);
    if (status == SLIDE_OK) {
        *size = slide_saved_size(instance);
    }
    return status;
}

SlideStatus slide_serialize(SlideInstance *instance, const void *state, void *bytes, size_t size) {
    SlideStatus status = check(instance, state != NULL && bytes != NULL, state);
    if (status != SLIDE_OK) {
        return status;
    }
    if (size < slide_saved_size(instance)) {
        return slide_report(instance, SLIDE_ERROR,
                            "room for %llu bytes; expected %llu, the size that this FMU gives for "
                            "its serialised state",
                            (unsigned long long)size, (unsigned long long)slide_saved_size(instance));
    }
    unsigned char *block = (unsigned char *)bytes + sizeof(StateHeader);
    StateHeader header = header_of(instance);
    memset(block, 0, instance->state.size);
    slide_state_copy(&instance->model, &instance->state,
                     (const unsigned char *)state + sizeof header, block);
    header.checksum = slide_crc32(block, instance->state.size);
    memcpy(bytes, &header, sizeof header);
    return SLIDE_OK;
}

/* Check the content of a serialised state of the right size. */
static bool is_intact(const SlideInstance *instance, const unsigned char *bytes) {
    const unsigned char *block = bytes + sizeof(StateHeader);
    StateHeader header;
    SlideHead head;
    memcpy(&header, bytes, sizeof header);
    memcpy(&head, block, sizeof head);
    bool known_mode = head.mode == SLIDE_INSTANTIATED || head.mode == SLIDE_INITIALIZATION ||
                      head.mode == SLIDE_STEPPING || head.mode == SLIDE_TERMINATED;
    return known_mode && header.checksum == slide_crc32(block, instance->state.size) &&
           slide_state_is_sound(&instance->model, &instance->state, block);
}

SlideStatus slide_deserialize(SlideInstance *instance, const void *bytes, size_t size,
                              void **state) {
    const bool complete = bytes != NULL && state != NULL;
    void *saved = NULL;
    if (complete && size != slide_saved_size(instance)) {
        return slide_report(instance, SLIDE_ERROR,
                            "%llu bytes; expected %llu; is the state of another FMU, or cut off?",
                            (unsigned long long)size, (unsigned long long)slide_saved_size(instance));
    }
    SlideStatus status = check(instance, complete, bytes);
    if (status == SLIDE_OK && !is_intact(instance, bytes)) {
        status = slide_report(instance, SLIDE_ERROR,
                              "the state is damaged: its checksum does not match its content, or no "
                              "state has such counters");
    }
    if (status == SLIDE_OK) {
        status = find_room(instance, &saved);
    }
    if (status == SLIDE_OK) {
        memcpy(saved, bytes, size);
        *state = saved;
    }
    return status;
}
