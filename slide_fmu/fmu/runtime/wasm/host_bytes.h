/* Where the surrogate comes from in a page: bytes that the host has written. */
#ifndef SLIDE_HOST_BYTES_H
#define SLIDE_HOST_BYTES_H

#include <stddef.h>

/* What a location points at, in place of text. */
typedef struct {
    const unsigned char *data;
    size_t size;
} SlideHostBytes;

#endif
