#include "kernel.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#define TEXT_OF(name) #name
#define TEXT(name) TEXT_OF(name)

/* As much of a panel as one register holds, 16 numbers with AVX-512 and else 8, which are two
 * registers of SSE or NEON; sums of each output in one pass; rows that a pass over weights serves.
 * All sums of a pass fit in the registers. */
#if defined(SLIDE_SCALAR)
enum { WIDTH = 1, N_CHAINS = 1, N_ROWS = 2 };
#elif defined(__AVX512F__)
enum { WIDTH = 16, N_CHAINS = 2, N_ROWS = 12 };
#elif defined(__AVX2__) || defined(__aarch64__)
enum { WIDTH = 8, N_CHAINS = 2, N_ROWS = 6 };
#else
enum { WIDTH = 8, N_CHAINS = 1, N_ROWS = 2 };
#endif

/* Vector extension of GCC and Clang, at any alignment; or one number. Of cells, Lanes are a whole
 * panel, or one number too. */
#if defined(SLIDE_SCALAR)
typedef float Wide, Lanes;
enum { PARTS = SLIDE_LANES };
#else
typedef float Wide __attribute__((vector_size(4 * WIDTH), aligned(4), may_alias));
typedef float Lanes __attribute__((vector_size(4 * SLIDE_LANES), aligned(4), may_alias));
enum { PARTS = 1 };
#endif

enum { WIDES = SLIDE_PANEL / WIDTH, STRIP = 2 * WIDTH, PREFETCH = 4096 /* bytes */ };

/* Panels are read once, in order; what comes next is fetched early, beyond the end of a layer too:
 * there the next one lies. */
static inline void fetch_ahead(const float *weights) {
#if defined(SLIDE_SCALAR)
    (void)weights; /* standard C has no word for it */
#else
    const uintptr_t ahead = (uintptr_t)weights + PREFETCH;
    for (size_t line = 0; line < SLIDE_PANEL * sizeof(float); line += 64) {
        __builtin_prefetch((const void *)(ahead + line));
    }
#endif
}

/* Each output adds its terms in the order of the inputs, in chains that take turns, so that an
 * addition need not wait for the one before. */
static void affine(const float *weights, const float *start, const float *x, size_t n_in,
                   size_t n_panels, float *y) {
    for (size_t panel = 0; panel < n_panels; ++panel) {
        Wide sums[N_CHAINS][WIDES];
        for (size_t part = 0; part < WIDES; ++part) {
            sums[0][part] = ((const Wide *)start)[part];
            for (size_t chain = 1; chain < N_CHAINS; ++chain) {
                sums[chain][part] = (Wide){0};
            }
        }
        size_t i = 0;
        for (; i + N_CHAINS <= n_in; i += N_CHAINS) {
            for (size_t chain = 0; chain < N_CHAINS; ++chain, weights += SLIDE_PANEL) {
                fetch_ahead(weights);
                for (size_t part = 0; part < WIDES; ++part) {
                    sums[chain][part] += x[i + chain] * ((const Wide *)weights)[part];
                }
            }
        }
        for (; i < n_in; ++i, weights += SLIDE_PANEL) {
            for (size_t part = 0; part < WIDES; ++part) {
                sums[0][part] += x[i] * ((const Wide *)weights)[part];
            }
        }
        for (size_t part = 0; part < WIDES; ++part) {
            for (size_t chain = 1; chain < N_CHAINS; ++chain) {
                sums[0][part] += sums[chain][part];
            }
            ((Wide *)y)[part] = sums[0][part];
        }
        start += SLIDE_PANEL;
        y += SLIDE_PANEL;
    }
}

/* Two rows as affine treats one. */
static void affine_two(const float *weights, const float *const start[2], const float *const x[2],
                       size_t n_in, size_t n_panels, float *const y[2]) {
    for (size_t panel = 0; panel < n_panels; ++panel) {
        Wide sums[2][N_CHAINS][WIDES];
        for (size_t part = 0; part < WIDES; ++part) {
            for (size_t row = 0; row < 2; ++row) {
                sums[row][0][part] = ((const Wide *)(start[row] + panel * SLIDE_PANEL))[part];
                for (size_t chain = 1; chain < N_CHAINS; ++chain) {
                    sums[row][chain][part] = (Wide){0};
                }
            }
        }
        size_t i = 0;
        for (; i + N_CHAINS <= n_in; i += N_CHAINS) {
            for (size_t chain = 0; chain < N_CHAINS; ++chain, weights += SLIDE_PANEL) {
                fetch_ahead(weights);
                for (size_t part = 0; part < WIDES; ++part) {
                    const Wide weight = ((const Wide *)weights)[part];
                    sums[0][chain][part] += x[0][i + chain] * weight;
                    sums[1][chain][part] += x[1][i + chain] * weight;
                }
            }
        }
        for (; i < n_in; ++i, weights += SLIDE_PANEL) {
            for (size_t part = 0; part < WIDES; ++part) {
                const Wide weight = ((const Wide *)weights)[part];
                sums[0][0][part] += x[0][i] * weight;
                sums[1][0][part] += x[1][i] * weight;
            }
        }
        for (size_t part = 0; part < WIDES; ++part) {
            for (size_t row = 0; row < 2; ++row) {
                for (size_t chain = 1; chain < N_CHAINS; ++chain) {
                    sums[row][0][part] += sums[row][chain][part];
                }
                ((Wide *)(y[row] + panel * SLIDE_PANEL))[part] = sums[row][0][part];
            }
        }
    }
}

/* N_ROWS rows of x and a strip of a panel: y = start + weights x. */
static inline void affine_strip(const float *weights, size_t n_in, const float *const *x,
                                const float *start, size_t start_stride, float *y,
                                size_t y_stride) {
    Wide sums[N_ROWS][2];
    for (size_t row = 0; row < N_ROWS; ++row) {
        const Wide *first = (const Wide *)(start + row * start_stride);
        sums[row][0] = first[0], sums[row][1] = first[1];
    }
    for (size_t i = 0; i < n_in; ++i) {
        const Wide *w = (const Wide *)(weights + i * SLIDE_PANEL);
        for (size_t row = 0; row < N_ROWS; ++row) {
            sums[row][0] += x[row][i] * w[0];
            sums[row][1] += x[row][i] * w[1];
        }
    }
    for (size_t row = 0; row < N_ROWS; ++row) {
        Wide *result = (Wide *)(y + row * y_stride);
        result[0] = sums[row][0], result[1] = sums[row][1];
    }
}

static void affine_rows(const float *weights, size_t n_in, size_t n_panels,
                        const SlideRows *rows) {
    const size_t width = n_panels * SLIDE_PANEL;
    for (size_t at = 0; at < width; at += STRIP) {
        const size_t panel = at / SLIDE_PANEL, lane = at % SLIDE_PANEL;
        const float *strip = weights + panel * n_in * SLIDE_PANEL + lane;
        for (size_t row = 0; row < rows->count; row += N_ROWS) {
            affine_strip(strip, n_in, rows->x + row,
                         rows->start + row * rows->start_stride + at, rows->start_stride,
                         rows->y + row * width + at, width);
        }
    }
}

static inline uint32_t bits_of(float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline float of_bits(uint32_t bits) {
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* All bits if a > b, else none; both below 2^31. Unlike a comparison of numbers, this is no branch
 * to any compiler, so that loops over it become vectors. */
static inline uint32_t bits_if_above(uint32_t a, uint32_t b) { return 0u - ((b - a) >> 31); }

/* exp(-x) - 1 for x >= 0, error below 1.2e-7; what is not a number stays so. -x = n ln 2 + r, Taylor
 * polynomial in r, and 2^n (1 + p) - 1 = 2^n p + (2^n - 1), which keeps small results accurate. */
static inline float expm1_of_minus(float x) {
    const uint32_t largest = 0x41a00000u, infinite = 0x7f800000u, bits = bits_of(x); /* 20 */
    const uint32_t clip = bits_if_above(bits, largest) & ~bits_if_above(bits, infinite);
    const float log2_e = 1.44269504f, ln2_high = 0.693359375f, ln2_low = -2.12194440e-4f;
    const float round_to_integer = 12582912.0f; /* 1.5 * 2^23 */
    const float z = -of_bits((bits & ~clip) | (largest & clip));
    const float shifted = z * log2_e + round_to_integer;
    const float n = shifted - round_to_integer;
    const float r = (z - n * ln2_high) - n * ln2_low;
    float p = 1.0f / 720 + r * (1.0f / 5040);
    p = 1.0f / 120 + r * p;
    p = 1.0f / 24 + r * p;
    p = 1.0f / 6 + r * p;
    p = 0.5f + r * p;
    p = r + r * r * p;
    const float power = of_bits((bits_of(shifted) + 127) << 23);
    return power * p + (power - 1.0f);
}

static void relu(float *values, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        values[i] = values[i] < 0 ? 0 : values[i];
    }
}

static void elu(float *values, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        const uint32_t bits = bits_of(values[i]), negative = 0u - (bits >> 31);
        const uint32_t size = bits & negative & 0x7fffffffu;
        const uint32_t below = bits_of(expm1_of_minus(of_bits(size)));
        values[i] = of_bits((bits & ~negative) | (below & negative));
    }
}

/* tanh |x| = -t / (2 + t) with t = exp(-2 |x|) - 1 */
static inline float tanh_of(float x) {
    float t = expm1_of_minus(2.0f * fabsf(x));
    return copysignf(t / (2.0f + t), x);
}

SLIDE_CALLED void tanh_each(float *values, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        values[i] = tanh_of(values[i]);
    }
}

/* The form with tanh: x / 2 (1 + tanh(sqrt(2 / pi) (x + 0.044715 x^3))) */
static void gelu(float *values, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        float x = values[i];
        float inner = 0.797884561f * (x + 0.044715f * (x * x * x));
        values[i] = 0.5f * x * (1.0f + tanh_of(inner));
    }
}

static void cubic(float *values, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        values[i] = values[i] * values[i] * values[i];
    }
}

static void activate(uint32_t activation, float *values, size_t count) {
    static void (*const functions[])(float *, size_t) = {NULL, relu, elu, tanh_each, gelu, cubic};
    if (activation > 0) {
        functions[activation](values, count);
    }
}

typedef float Real;
#define WEIGHTS(at, i) (((const Lanes *)(at))[i])
#include "cell_equation.h"

const SlideKernel SLIDE_KERNEL = {
    .name = TEXT(SLIDE_KERNEL),
    .affine = affine,
    .affine_two = affine_two,
    .affine_rows = affine_rows,
    .activate = activate,
    .advance = advance,
};
