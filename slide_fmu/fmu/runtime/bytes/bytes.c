#include "bytes.h"

#include <stdio.h>
#include <string.h>

void slide_format(char *text, size_t size, const char *format, va_list arguments) {
#if defined(SLIDE_QUIET)
    const bool is_text = strcmp(format, "%s") == 0;
    strncpy(text, is_text ? va_arg(arguments, const char *) : format, size - 1);
    text[size - 1] = '\0';
#else
    vsnprintf(text, size, format, arguments);
#endif
}

bool slide_say(SlideMessage *message, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    slide_format(message->text, sizeof message->text, format, arguments);
    va_end(arguments);
    return false;
}

uint32_t slide_u32(const unsigned char *at) {
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

float slide_f32(const unsigned char *at) {
    uint32_t bits = slide_u32(at);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

double slide_f64(const unsigned char *at) {
    uint64_t bits = (uint64_t)slide_u32(at) | (uint64_t)slide_u32(at + 4) << 32;
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

uint32_t slide_crc32(const unsigned char *data, size_t size) {
    /* Four bits at a time: entry i is i shifted through the polynomial 0xEDB88320U. */
    static const uint32_t table[16] = {
        0x00000000U, 0x1DB71064U, 0x3B6E20C8U, 0x26D930ACU, 0x76DC4190U, 0x6B6B51F4U,
        0x4DB26158U, 0x5005713CU, 0xEDB88320U, 0xF00F9344U, 0xD6D6A3E8U, 0xCB61B38CU,
        0x9B64C2B0U, 0x86D3D2D4U, 0xA00AE278U, 0xBDBDF21CU,
    };
    uint32_t crc = 0xFFFFFFFFU;
    for (size_t i = 0; i < size; ++i) {
        crc ^= data[i];
        crc = crc >> 4 ^ table[crc & 15];
        crc = crc >> 4 ^ table[crc & 15];
    }
    return ~crc;
}

uint32_t slide_adler32(const unsigned char *data, size_t size) {
    uint32_t sum = 1, sum_of_sums = 0;
    for (size_t i = 0; i < size; ++i) {
        sum = (sum + data[i]) % 65521;
        sum_of_sums = (sum_of_sums + sum) % 65521;
    }
    return sum_of_sums << 16 | sum;
}
