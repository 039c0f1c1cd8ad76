/* Little-endian bytes: numbers, checksums, messages. */
#ifndef SLIDE_BYTES_H
#define SLIDE_BYTES_H

#include "dialect.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Why something was refused, for people. */
typedef struct {
    char text[320];
} SlideMessage;

/* As vsnprintf; or, with SLIDE_QUIET, the format as it is, but for "%s": some C libraries take memory
 * from the heap to write numbers. */
void slide_format(char *text, size_t size, const char *format, va_list arguments);

/* Write a message; always false, so that a check can return it. */
SLIDE_LIKE_PRINTF(2, 3) bool slide_say(SlideMessage *message, const char *format, ...);

/* Numbers at a place that was checked before, at any alignment. */
uint32_t slide_u32(const unsigned char *at);
float slide_f32(const unsigned char *at);
double slide_f64(const unsigned char *at);

/* The checksums of zlib. */
uint32_t slide_crc32(const unsigned char *data, size_t size);
uint32_t slide_adler32(const unsigned char *data, size_t size);

#endif
