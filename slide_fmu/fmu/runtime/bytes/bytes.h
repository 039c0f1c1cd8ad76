/* Little-endian bytes: a cursor that never reads beyond its end, checksums, messages. */
#ifndef SLIDE_BYTES_H
#define SLIDE_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Why something was refused, for people. */
typedef struct {
    char text[320];
} SlideMessage;

/* Write a message; always false, so that a check can return it. */
__attribute__((format(printf, 2, 3))) bool slide_say(SlideMessage *message, const char *format,
                                                     ...);

typedef struct {
    const unsigned char *at;
    const unsigned char *end;
} SlideCursor;

/* Advance by count elements of a size (positive) and give their place; NULL when too few are left.
 */
const unsigned char *slide_take(SlideCursor *cursor, uint64_t count, size_t size);

/* Read one number from the cursor; false when too few bytes are left. */
bool slide_take_u32(SlideCursor *cursor, uint32_t *value);
bool slide_take_f64(SlideCursor *cursor, double *value);

/* Numbers at a place that was checked before, at any alignment. */
uint32_t slide_u32(const unsigned char *at);
float slide_f32(const unsigned char *at);
double slide_f64(const unsigned char *at);

/* The checksums of zlib. */
uint32_t slide_crc32(const unsigned char *data, size_t size);
uint32_t slide_adler32(const unsigned char *data, size_t size);

#endif
