/* A surrogate without FMI, for programs that hold its file in memory: predictions of many windows,
 * and single parts of a step, to be timed. Exported beside the functions of FMI and used by
 * slide_fmu/fmu/native.py. A surrogate serves one thread at a time; its layers serve any number. */
#ifndef SLIDE_NATIVE_H
#define SLIDE_NATIVE_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define SLIDE_Export __declspec(dllexport)
#else
#define SLIDE_Export __attribute__((visibility("default")))
#endif

typedef struct SlideNative SlideNative;

/* Parts of a step that can be repeated. */
enum {
    SLIDE_NETWORK_ALONE = 0,  /* one evaluation of all that layers give, or both cells of a step */
    SLIDE_FEATURES_ALONE = 1, /* what the surrogate's network sees of an input */
    SLIDE_STEP = 2,           /* a communication step without FMI */
    SLIDE_STEP_AND_READ = 3,  /* the same with its error estimates read */
    SLIDE_READ_MEMORY = 4     /* each byte of the network read once, as fast as can be */
};

/* Name of the index-th kernel that this processor supports, the fastest first; NULL behind them. */
SLIDE_Export const char *slide_native_kernel(size_t index);

/* Read a surrogate file's bytes; kernel: index of that of the network. NULL, with a message, when
 * they must not be used. */
SLIDE_Export SlideNative *slide_native_open(const unsigned char *data, size_t size, size_t kernel,
                                            char *message, size_t message_size);
SLIDE_Export void slide_native_close(SlideNative *native);

/* Bytes that SLIDE_READ_MEMORY reads. */
SLIDE_Export size_t slide_native_memory(const SlideNative *native);

/* Windows of layers: rows of features, by pointers; all values of the network. 0 on success. */
SLIDE_Export int slide_native_layers(const SlideNative *native, const float *const *rows,
                                     size_t count, float *values);

/* Windows of cells: scaled samples, by pointers. 0 on success. */
SLIDE_Export int slide_native_cells(SlideNative *native, const double *const *windows,
                                    size_t count, float *values);

/* Repeat a part of a step. 0 on success. */
SLIDE_Export int slide_native_repeat(SlideNative *native, int part, int times);

#endif
