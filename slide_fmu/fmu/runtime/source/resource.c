/* In place of resource.c in source FMUs: the surrogate file is part of the program. */
#include "resource.h"

#include "surrogate.h"

const unsigned char *slide_surrogate_open(const char *location, bool is_uri, size_t *size,
                                          SlideMessage *message) {
    (void)location;
    (void)is_uri;
    (void)message;
    *size = sizeof surrogate;
    return surrogate;
}

void slide_surrogate_close(const unsigned char *data) { (void)data; }
