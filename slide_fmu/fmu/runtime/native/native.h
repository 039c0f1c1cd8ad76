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

/* The most memory, in bytes, that an instance of an FMU of standard 2 or 3 with this surrogate needs,
 * and that one of its saved states needs (slide_measure of calls.h): to sizes [2]. 0 on success;
 * else a message. */
SLIDE_Export int slide_native_sizes(const unsigned char *data, size_t size, uint32_t fmi,
                                    uint32_t steps_per_sample, size_t *sizes, char *message,
                                    size_t message_size);

/* Windows of layers: rows of features, by pointers; all values of the network. 0 on success. */
SLIDE_Export int slide_native_layers(const SlideNative *native, const float *const *rows,
                                     size_t count, float *values);

/* Records of cells [length][n_inputs] in physical units, stride samples after each other; windows
 * of a record may overlap. Each has one state, which first sees the first input n_held times. To
 * the last n_given outputs of each, [count][n_given][n_outputs]; 1 <= n_given <= length. 0 on
 * success. */
SLIDE_Export int slide_native_records(SlideNative *native, const double *inputs, size_t count,
                                      size_t length, size_t stride, size_t n_held,
                                      size_t n_given, double *outputs);

/* From weights of all outputs [count][length][n_outputs], with the first inputs held as long as the
 * window is, but for one sample, to the gradient of their weighted sum by the inputs
 * [count][length][n_inputs]. The first call takes the memory for it. 0 on success. */
SLIDE_Export int slide_native_slopes(SlideNative *native, const double *inputs,
                                     const double *weights, size_t count, size_t length,
                                     double *gradient);

#endif
