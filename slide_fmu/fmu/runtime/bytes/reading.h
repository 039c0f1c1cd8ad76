/* Parts of the reader of a surrogate file that all its sections share. */
#ifndef SLIDE_READING_H
#define SLIDE_READING_H

#include "bytes.h"

/* Say that a part of the file is cut off; always false. */
bool slide_too_short(SlideMessage *message, const char *what);

/* Take a matrix of numbers that must be finite; its place in the file. */
bool slide_read_f32(const unsigned char **matrix, uint64_t rows, uint64_t columns,
                    SlideCursor *section, const char *what, SlideMessage *message);
bool slide_read_f64(const unsigned char **matrix, uint64_t rows, uint64_t columns,
                    SlideCursor *section, const char *what, SlideMessage *message);

/* A list of indices in the file. */
typedef struct {
    uint32_t count;
    const unsigned char *at; /* u32 [count] */
} SlideIndices;

/* Take a list of indices, each below a bound. */
bool slide_read_indices(SlideIndices *indices, uint64_t bound, SlideCursor *section,
                        const char *what, SlideMessage *message);

#endif
