#include "input.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

uint8_t fuzz_u8(FuzzInput *input) { return input->at < input->end ? *input->at++ : 0; }

uint16_t fuzz_u16(FuzzInput *input) {
    const uint16_t low = fuzz_u8(input);
    return (uint16_t)(low | fuzz_u8(input) << 8);
}

uint32_t fuzz_u32(FuzzInput *input) {
    const uint32_t low = fuzz_u16(input);
    return low | (uint32_t)fuzz_u16(input) << 16;
}

double fuzz_value(FuzzInput *input) {
    static const double special[] = {NAN,   INFINITY, -INFINITY, 0.0,   -0.0,  1e300,
                                     3e38,  -3e38,    1e-300,    1e15,  -1e15, 1e7,
                                     1e-20, 4.9e-324, 1.0,       1000.0};
    const uint8_t kind = fuzz_u8(input);
    if (kind == 0xFF) {
        const uint64_t low = fuzz_u32(input), bits = low | (uint64_t)fuzz_u32(input) << 32;
        double value;
        memcpy(&value, &bits, sizeof value);
        return value;
    }
    return kind >= 0xE0 ? special[kind & 15] : (kind - 112) / 56.0;
}

char *fuzz_string(FuzzInput *input) {
    const size_t length = fuzz_u8(input);
    char *text = calloc(length + 1, 1);
    for (size_t i = 0; text != NULL && i < length; ++i) {
        text[i] = (char)fuzz_u8(input);
    }
    return text;
}

static void put_word(unsigned char *data, size_t size, size_t place, uint32_t word) {
    for (size_t i = 0; i < 4 && place + i < size; ++i) {
        data[place + i] = (unsigned char)(word >> 8 * i);
    }
}

/* Off by a little, up or down: of counts, indices, exponents. */
static void add_to_word(unsigned char *data, size_t size, size_t place, size_t length) {
    if (place + 4 <= size) {
        uint32_t word = 0;
        for (size_t i = 0; i < 4; ++i) {
            word |= (uint32_t)data[place + i] << 8 * i;
        }
        put_word(data, size, place, word + (uint32_t)length - 128);
    }
}

/* One edit: what, where and how long are its first bytes. */
static size_t edit_once(FuzzInput *input, unsigned char *data, size_t size, size_t room) {
    static const uint32_t words[] = {0,          1,          2,       3,       0x7F,
                                     0x80000000, 0xFFFFFFFF, 1 << 20, 1 << 16, 0x7FC00000,
                                     0x7F800000, 0x3F800000, 0x7FF0,  1 << 30, 0x7FEFFFFF,
                                     0x40000000};
    const uint8_t what = fuzz_u8(input);
    const size_t place = fuzz_u16(input) % (size + 1), length = fuzz_u8(input);
    const size_t behind = size - place, fits = length < behind ? length : behind;
    switch (what % 5) {
    case 0:
        for (size_t i = 0; i < fits; ++i) {
            data[place + i] = fuzz_u8(input);
        }
        return size;
    case 1:
        put_word(data, size, what & 128 ? place : place / 4 * 4, words[length % 16]);
        return size;
    case 2:
        memmove(data + place, data + place + fits, behind - fits);
        return size - fits;
    case 3:
        add_to_word(data, size, place / 4 * 4, length);
        return size;
    default:
        if (length > room - size) {
            return size;
        }
        memmove(data + place + length, data + place, behind);
        for (size_t i = 0; i < length; ++i) {
            data[place + i] = fuzz_u8(input);
        }
        return size + length;
    }
}

size_t fuzz_edit(FuzzInput *input, unsigned char *data, size_t size, size_t room) {
    for (unsigned left = fuzz_u8(input) % 16; left > 0; --left) {
        size = edit_once(input, data, size, room);
    }
    return size;
}
