#include "bytes.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

bool slide_say(SlideMessage *message, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message->text, sizeof message->text, format, arguments);
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
    /* Four bits at a time: entry i is i shifted through the polynomial 0xEDB88320. */
    static const uint32_t table[16] = {
        0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4,
        0x4DB26158, 0x5005713C, 0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C,
        0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C,
    };
    uint32_t crc = 0xFFFFFFFF;
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
