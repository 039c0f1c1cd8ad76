/* How all parts of a surrogate file are read: a cursor that never goes beyond its end and keeps the
 * first fault. After a fault, numbers read as 0, places as NULL and lists as empty, so that readers
 * ask whether all is good only before they follow a place. */
#ifndef SLIDE_READING_H
#define SLIDE_READING_H

#include "bytes.h"

typedef struct {
    const unsigned char *at, *end; /* of the open section, or of the file */
    const unsigned char *file_end;
    SlideMessage *message; /* the first fault */
    bool good;             /* no fault yet */
} SlideCursor;

/* Note a fault, unless a condition holds or there was one before. */
SLIDE_LIKE_PRINTF(3, 4)
void slide_check(SlideCursor *cursor, bool holds, const char *format, ...);

/* Only what is in the section can be read until it is closed; then all of it must have been. */
void slide_open_section(SlideCursor *cursor, const char *tag);
void slide_close_section(SlideCursor *cursor, const char *tag);

/* Take count elements of a size (positive); what: their name, should they be cut off. */
const unsigned char *slide_take(SlideCursor *cursor, uint64_t count, size_t size,
                                const char *what);
uint32_t slide_take_u32(SlideCursor *cursor, const char *what);
double slide_take_f64(SlideCursor *cursor, const char *what);

/* Take a matrix of numbers that must be finite. */
const unsigned char *slide_take_f32s(SlideCursor *cursor, uint64_t rows, uint64_t columns,
                                     const char *what);
const unsigned char *slide_take_f64s(SlideCursor *cursor, uint64_t rows, uint64_t columns,
                                     const char *what);

/* A list of indices in the file. */
typedef struct {
    uint32_t count;
    const unsigned char *at; /* u32 [count] */
} SlideIndices;

/* Take a list of indices, each below a bound. */
SlideIndices slide_take_indices(SlideCursor *cursor, uint64_t bound, const char *what);

#endif
