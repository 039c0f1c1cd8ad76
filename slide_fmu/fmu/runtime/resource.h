/* Files of the unpacked FMU, by the resource location that the master passes. */
#ifndef SLIDE_RESOURCE_H
#define SLIDE_RESOURCE_H

#include "bytes.h"

/* The path of a file in a folder; the folder may end in a separator. Free the result. NULL, with a
 * message, when there is no folder or no memory. */
char *slide_path_in_folder(const char *folder, const char *file, SlideMessage *message);

/* The same of a folder given as URI file:/p, file:///p or file://localhost/p with percent escapes
 * (UTF-8). NULL, with a message, also when the URI is none of these. */
char *slide_path_of_uri(const char *uri, const char *file, SlideMessage *message);

/* Read a whole file, path in UTF-8. Free the result. NULL, with a message, on failure. */
unsigned char *slide_read_file(const char *path, size_t *size, SlideMessage *message);

#endif
