#include "reading.h"

#include <math.h>

bool slide_too_short(SlideMessage *message, const char *what) {
    return slide_say(message, "surrogate file is damaged: %s ends too early", what);
}

static double f32_at(const unsigned char *at) { return slide_f32(at); }

/* Take rows * columns numbers of a size, which a function reads. */
static bool read_numbers(const unsigned char **matrix, uint64_t rows, uint64_t columns,
                         size_t size, double (*at)(const unsigned char *), SlideCursor *section,
                         const char *what, SlideMessage *message) {
    const bool overflows = columns > 0 && rows > UINT64_MAX / columns;
    *matrix = overflows ? NULL : slide_take(section, rows * columns, size);
    if (*matrix == NULL) {
        return slide_too_short(message, what);
    }
    for (uint64_t i = 0; i < rows * columns; ++i) {
        if (!isfinite(at(*matrix + size * i))) {
            return slide_say(message, "surrogate file: %s number %llu is not finite", what,
                             (unsigned long long)i);
        }
    }
    return true;
}

bool slide_read_f32(const unsigned char **matrix, uint64_t rows, uint64_t columns,
                    SlideCursor *section, const char *what, SlideMessage *message) {
    return read_numbers(matrix, rows, columns, 4, f32_at, section, what, message);
}

bool slide_read_f64(const unsigned char **matrix, uint64_t rows, uint64_t columns,
                    SlideCursor *section, const char *what, SlideMessage *message) {
    return read_numbers(matrix, rows, columns, 8, slide_f64, section, what, message);
}

bool slide_read_indices(SlideIndices *indices, uint64_t bound, SlideCursor *section,
                        const char *what, SlideMessage *message) {
    if (!slide_take_u32(section, &indices->count)) {
        return slide_too_short(message, what);
    }
    indices->at = slide_take(section, indices->count, 4);
    if (indices->at == NULL) {
        return slide_too_short(message, what);
    }
    for (size_t i = 0; i < indices->count; ++i) {
        uint32_t index = slide_u32(indices->at + 4 * i);
        if (index >= bound) {
            return slide_say(message, "surrogate file: %s: index %u; expected less than %llu",
                             what, (unsigned)index, (unsigned long long)bound);
        }
    }
    return true;
}
