#include "reading.h"

#include <math.h>

bool slide_too_short(SlideMessage *message, const char *what) {
    return slide_say(message, "surrogate file is damaged: %s ends too early", what);
}

/* Take rows * columns elements; NULL when too few are left. */
static const unsigned char *take(SlideCursor *section, uint64_t rows, uint64_t columns,
                                 size_t size) {
    bool overflows = columns > 0 && rows > UINT64_MAX / columns;
    return overflows ? NULL : slide_take(section, rows * columns, size);
}

static bool say_not_finite(SlideMessage *message, const char *what, uint64_t index) {
    return slide_say(message, "surrogate file: %s number %llu is not finite", what,
                     (unsigned long long)index);
}

bool slide_read_f32(const unsigned char **matrix, uint64_t rows, uint64_t columns,
                    SlideCursor *section, const char *what, SlideMessage *message) {
    *matrix = take(section, rows, columns, 4);
    if (*matrix == NULL) {
        return slide_too_short(message, what);
    }
    for (uint64_t i = 0; i < rows * columns; ++i) {
        if (!isfinite(slide_f32(*matrix + 4 * i))) {
            return say_not_finite(message, what, i);
        }
    }
    return true;
}

bool slide_read_f64(const unsigned char **matrix, uint64_t rows, uint64_t columns,
                    SlideCursor *section, const char *what, SlideMessage *message) {
    *matrix = take(section, rows, columns, 8);
    if (*matrix == NULL) {
        return slide_too_short(message, what);
    }
    for (uint64_t i = 0; i < rows * columns; ++i) {
        if (!isfinite(slide_f64(*matrix + 8 * i))) {
            return say_not_finite(message, what, i);
        }
    }
    return true;
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
