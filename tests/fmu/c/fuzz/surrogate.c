#include "surrogate.h"

#include "resource.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROOM = 1 << 16, CHECKSUM = 4 };

static unsigned char content[ROOM];
static size_t content_size;
static char guid[64];

void fuzz_choose_surrogate(FuzzInput *input) {
    const size_t sample = fuzz_u8(input) % fuzz_n_samples;
    size_t size = fuzz_sample_sizes[sample] - CHECKSUM;
    memcpy(content, fuzz_samples[sample], size);
    size = fuzz_edit(input, content, size, ROOM - CHECKSUM);
    const uint32_t checksum = slide_crc32(content, size) ^ (fuzz_u8(input) == 0xFF ? 1u : 0u);
    for (size_t i = 0; i < CHECKSUM; ++i) {
        content[size++] = (unsigned char)(checksum >> 8 * i);
    }
    content_size = size;
    snprintf(guid, sizeof guid, "slide-%08x-%08x-%llx", (unsigned)checksum,
             (unsigned)slide_adler32(content, size), (unsigned long long)size);
}

unsigned char *fuzz_surrogate(size_t *size) {
    unsigned char *copy = malloc(content_size);
    if (copy != NULL) {
        memcpy(copy, content, content_size);
    }
    *size = content_size;
    return copy;
}

const char *fuzz_guid(void) { return guid; }

void *fuzz_calloc(size_t count, size_t size) {
    return count > FUZZ_MOST_MEMORY / size ? NULL : calloc(count, size);
}

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define __SANITIZE_ADDRESS__ 1
#endif
#endif

#if defined(__SANITIZE_ADDRESS__)
void __asan_poison_memory_region(void const volatile *begin, size_t size);
void __asan_unpoison_memory_region(void const volatile *begin, size_t size);
void fuzz_close(void *begin, size_t size) { __asan_poison_memory_region(begin, size); }
void fuzz_open(void *begin, size_t size) { __asan_unpoison_memory_region(begin, size); }
#else
void fuzz_close(void *begin, size_t size) { (void)begin, (void)size; }
void fuzz_open(void *begin, size_t size) { (void)begin, (void)size; }
#endif

void *fuzz_memset(void *begin, int value, size_t size) {
    fuzz_open(begin, size);
    return memset(begin, value, size);
}

/* resource.c of the runtime is compiled with this name for its function. */
const unsigned char *slide_surrogate_on_disk(const char *location, bool is_uri, size_t *size,
                                             SlideMessage *message);

const unsigned char *slide_surrogate_open(const char *location, bool is_uri, size_t *size,
                                          SlideMessage *message) {
    return location != NULL && strcmp(location, FUZZ_LOCATION) == 0
               ? fuzz_surrogate(size)
               : slide_surrogate_on_disk(location, is_uri, size, message);
}
