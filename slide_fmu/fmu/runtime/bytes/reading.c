#include "reading.h"

#include <math.h>
#include <string.h>

void slide_check(SlideCursor *cursor, bool holds, const char *format, ...) {
    if (cursor->good && !holds) {
        va_list arguments;
        va_start(arguments, format);
        slide_format(cursor->message->text, sizeof cursor->message->text, format, arguments);
        va_end(arguments);
        cursor->good = false;
    }
}

const unsigned char *slide_take(SlideCursor *cursor, uint64_t count, size_t size,
                                const char *what) {
    const unsigned char *place = cursor->at;
    slide_check(cursor, count <= (size_t)(cursor->end - cursor->at) / size,
                "surrogate file is damaged: %s ends too early", what);
    if (!cursor->good) {
        return NULL;
    }
    cursor->at += (size_t)count * size;
    return place;
}

uint32_t slide_take_u32(SlideCursor *cursor, const char *what) {
    const unsigned char *place = slide_take(cursor, 1, 4, what);
    return place == NULL ? 0 : slide_u32(place);
}

double slide_take_f64(SlideCursor *cursor, const char *what) {
    const unsigned char *place = slide_take(cursor, 1, 8, what);
    return place == NULL ? 0 : slide_f64(place);
}

void slide_open_section(SlideCursor *cursor, const char *tag) {
    const bool is_next =
        cursor->end - cursor->at >= 4 && memcmp(cursor->at, tag, 4) == 0;
    slide_check(cursor, is_next, "surrogate file is damaged: expected section %s", tag);
    slide_take(cursor, 4, 1, tag);
    const uint32_t length = slide_take_u32(cursor, tag);
    const unsigned char *begin = slide_take(cursor, length, 1, tag);
    if (begin != NULL) {
        cursor->end = cursor->at;
        cursor->at = begin;
    }
}

void slide_close_section(SlideCursor *cursor, const char *tag) {
    slide_check(cursor, cursor->at == cursor->end,
                "surrogate file is damaged: %u bytes too many in section %s",
                (unsigned)(cursor->end - cursor->at), tag);
    cursor->end = cursor->file_end;
}

static double f32_at(const unsigned char *at) { return slide_f32(at); }

/* Numbers of a size, which a function reads. */
static const unsigned char *take_numbers(SlideCursor *cursor, uint64_t rows, uint64_t columns,
                                         size_t size, double (*at)(const unsigned char *),
                                         const char *what) {
    const bool overflows = columns > 0 && rows > UINT64_MAX / columns;
    const uint64_t count = overflows ? UINT64_MAX : rows * columns;
    const unsigned char *numbers = slide_take(cursor, count, size, what);
    for (uint64_t i = 0; cursor->good && i < count; ++i) {
        slide_check(cursor, isfinite(at(numbers + size * i)),
                    "surrogate file: %s number %llu is not finite", what, (unsigned long long)i);
    }
    return numbers;
}

const unsigned char *slide_take_f32s(SlideCursor *cursor, uint64_t rows, uint64_t columns,
                                     const char *what) {
    return take_numbers(cursor, rows, columns, 4, f32_at, what);
}

const unsigned char *slide_take_f64s(SlideCursor *cursor, uint64_t rows, uint64_t columns,
                                     const char *what) {
    return take_numbers(cursor, rows, columns, 8, slide_f64, what);
}

SlideIndices slide_take_indices(SlideCursor *cursor, uint64_t bound, const char *what) {
    SlideIndices indices = {slide_take_u32(cursor, what), NULL};
    indices.at = slide_take(cursor, indices.count, 4, what);
    for (size_t i = 0; cursor->good && i < indices.count; ++i) {
        uint32_t index = slide_u32(indices.at + 4 * i);
        slide_check(cursor, index < bound, "surrogate file: %s: index %u; expected less than %llu",
                    what, (unsigned)index, (unsigned long long)bound);
    }
    return cursor->good ? indices : (SlideIndices){0, NULL};
}
