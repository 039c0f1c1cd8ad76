/* Files of the unpacked FMU, by the resource location that the importer passes. */
#ifndef SLIDE_RESOURCE_H
#define SLIDE_RESOURCE_H

#include "bytes.h"

/* Read a whole file, path in UTF-8. Free the result. NULL, with a message, on failure. */
unsigned char *slide_read_file(const char *path, size_t *size, SlideMessage *message);

/* Read the surrogate file in the folder of the resources. location: a URI file:/p, file:///p or
 * file://localhost/p with percent escapes (UTF-8), or a path that may end in a separator. Close
 * the result. NULL, with a message, on failure. In a source FMU (source/resource.c) the file is
 * compiled in, and its location does not matter. */
const unsigned char *slide_surrogate_open(const char *location, bool is_uri, size_t *size,
                                          SlideMessage *message);
void slide_surrogate_close(const unsigned char *data);

#endif
