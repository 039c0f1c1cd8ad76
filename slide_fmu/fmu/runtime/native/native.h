/* A surrogate without FMI, for programs that hold its file in memory: predictions of many windows,
 * and of whole records. Exported beside the functions of FMI and used by
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

/* Name of the index-th kernel that this processor supports, the fastest first; NULL behind them. */
SLIDE_Export const char *slide_native_kernel(size_t index);

/* Read a surrogate file's bytes; kernel: index of that of the network. NULL, with a message, when
 * they must not be used. */
SLIDE_Export SlideNative *slide_native_open(const unsigned char *data, size_t size, size_t kernel,
                                            char *message, size_t message_size);
SLIDE_Export void slide_native_close(SlideNative *native);

/* Windows of layers: rows of features, by pointers; all values of the network. 0 on success. */
SLIDE_Export int slide_native_layers(const SlideNative *native, const float *const *rows,
                                     size_t count, float *values);

/* Windows of cells: scaled samples, by pointers. 0 on success. */
SLIDE_Export int slide_native_cells(SlideNative *native, const double *const *windows,
                                    size_t count, float *values);

/* Records of cells: physical inputs [count][length][n_inputs] to physical outputs
 * [count][length][n_outputs], one state for each record (records.h). 0 on success. */
SLIDE_Export int slide_native_records(SlideNative *native, const double *inputs, size_t count,
                                      size_t length, double *outputs);

/* From these inputs and weights of these outputs to the gradient of the weighted sum by the inputs,
 * [count][length][n_inputs]. The first call takes the memory for it. 0 on success. */
SLIDE_Export int slide_native_slopes(SlideNative *native, const double *inputs,
                                     const double *weights, size_t count, size_t length,
                                     double *gradient);

#endif
