/* Files of the unpacked FMU, by the resource location that the master passes. */
#ifndef SLIDE_RESOURCE_H
#define SLIDE_RESOURCE_H

#include "bytes.h"

/* Turn a URI file:/p, file:///p or file://localhost/p with percent escapes (UTF-8) into the path
 * of a file in it. Free the result. NULL, with a message, when the URI is none of these. */
char *slide_resource_path(const char *uri, const char *file, SlideMessage *message);

/* Read a whole file, path in UTF-8. Free the result. NULL, with a message, on failure. */
unsigned char *slide_read_file(const char *path, size_t *size, SlideMessage *message);

/* The bytes of the surrogate file in the folder with this URI; in a source FMU (source/resource.c)
 * those compiled in, wherever it is. Close the result. NULL, with a message, on failure. */
const unsigned char *slide_surrogate_open(const char *location, size_t *size,
                                          SlideMessage *message);
void slide_surrogate_close(const unsigned char *data);

#endif
