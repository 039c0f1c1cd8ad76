/* The bytes that a fuzzer gives, read as numbers, and edits of other bytes by them. When they have
 * run out, zeros follow. */
#ifndef FUZZ_INPUT_H
#define FUZZ_INPUT_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    const uint8_t *at, *end;
} FuzzInput;

uint8_t fuzz_u8(FuzzInput *input);
uint16_t fuzz_u16(FuzzInput *input);
uint32_t fuzz_u32(FuzzInput *input);

/* Mostly within -2 .. 2; also any bits, and values that hurt: NaN, infinity, what overflows. */
double fuzz_value(FuzzInput *input);

/* A new string of up to 255 characters; free it. */
char *fuzz_string(FuzzInput *input);

/* Some edits of size bytes at data, where there is room for more: bytes are replaced, put in or
 * taken out, words changed a little or replaced by some that hurt readers. Returns the new size. */
size_t fuzz_edit(FuzzInput *input, unsigned char *data, size_t size, size_t room);

#endif
