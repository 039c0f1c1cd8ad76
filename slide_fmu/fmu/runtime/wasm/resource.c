/* In place of resource.c in a page: the surrogate file lies in memory. */
#include "host_bytes.h"

#include "resource.h"

const unsigned char *slide_surrogate_open(const char *location, bool is_uri, size_t *size,
                                          SlideMessage *message) {
    const SlideHostBytes *given = (const void *)location;
    (void)is_uri;
    (void)message;
    *size = given->size;
    return given->data;
}

void slide_surrogate_close(const unsigned char *data) { (void)data; }
