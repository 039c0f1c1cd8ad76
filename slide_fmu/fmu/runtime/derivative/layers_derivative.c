#include "layers_derivative.h"

#include "activation_slope.h"

#include <string.h>

void slide_layers_derivative_place(SlideLayersDerivative *derivative, const SlideLayers *layers,
                                   SlideArena *arena) {
    size_t count = layers->seen.count, widest = layers->stack.widest;
    derivative->window = slide_place(arena, layers->n_samples * count, sizeof(float));
    derivative->picked = slide_place(arena, layers->n_ages * count, sizeof(float));
    derivative->slopes = slide_place(arena, count, sizeof(double));
    for (size_t i = 0; i < 2; ++i) {
        derivative->values[i] = slide_place(arena, widest, SLIDE_PANEL * sizeof(float));
    }
    derivative->zeros = slide_place(arena, widest, SLIDE_PANEL * sizeof(float));
}

void slide_layers_derivative_start(const SlideLayers *layers,
                                   const SlideLayersDerivative *derivative) {
    memset(derivative->window, 0, layers->n_samples * layers->seen.count * sizeof(float));
}

void slide_layers_derivative_see(const SlideLayers *layers,
                                 const SlideLayersDerivative *derivative, uint64_t age,
                                 const double *input, const double *d_input) {
    size_t count = layers->seen.count;
    if (age >= layers->n_samples) {
        return;
    }
    float *row = derivative->window + (layers->n_samples - 1 - (size_t)age) * count;
    slide_features_differentiate(&layers->seen, input, d_input, derivative->slopes);
    for (size_t i = 0; i < count; ++i) {
        row[i] = (float)derivative->slopes[i];
    }
}

static void multiply_by_slopes(uint32_t activation, const float *values, float *slopes,
                               size_t count) {
    for (size_t i = 0; i < count; ++i) {
        slopes[i] *= (float)slide_activation_slope(activation, values[i]);
    }
}

/* The layers once more, and beside each the product of its weights with the slopes. */
static const float *differentiate(const SlideFeedForward *stack, const SlideKernel *kernel,
                                  const SlideLayersDerivative *derivative, const float *window,
                                  const float *d_window) {
    const float *x = window, *dx = d_window;
    float *dy = NULL;
    for (uint32_t i = 0; i < stack->n_layers; ++i) {
        const SlideLayer *layer = &stack->layers[i];
        const size_t count = layer->n_panels * SLIDE_PANEL;
        float *y = stack->scratch[i % 2];
        dy = derivative->values[i % 2];
        slide_layer_affine(layer, kernel, layer->bias, x, y);
        slide_layer_affine(layer, kernel, derivative->zeros, dx, dy);
        multiply_by_slopes(layer->activation, y, dy, count);
        kernel->activate(layer->activation, y, count);
        x = y, dx = dy;
    }
    slide_layer_affine(&stack->skip, kernel, dy, d_window, dy);
    return dy;
}

const float *slide_layers_derivative_evaluate(const SlideLayers *layers,
                                              const SlideLayersDerivative *derivative,
                                              const SlideKernel *kernel,
                                              const SlideLayersState *state, uint64_t sample) {
    const float *window = slide_layers_window(layers, state, sample);
    const float *slopes = slide_layers_pick(layers, derivative->window, derivative->picked);
    return differentiate(&layers->stack, kernel, derivative, window, slopes);
}
