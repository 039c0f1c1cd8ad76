/* Derivatives of inputs with respect to time (FMI 2.0.4, section 4.2.1), for the next step. */
#include "calls.h"

#include <math.h>

/* Only first derivatives are used; an importer cannot know that, since FMI 2.0 has no place to say
 * it. */
static SlideStatus check_rate(const SlideInstance *instance, unsigned reference, int order,
                              double rate) {
    const uint32_t n_inputs = instance->model.n_inputs;
    if (reference >= n_inputs) {
        return slide_report(instance, SLIDE_ERROR,
                            "value reference %u is no input; expected 0 to %u; nothing was "
                            "changed",
                            reference, (unsigned)n_inputs - 1);
    }
    if (order < 1) {
        return slide_report(instance, SLIDE_ERROR,
                            "derivative of order %d of value reference %u; expected order 1; "
                            "nothing was changed",
                            order, reference);
    }
    return isfinite(rate) ? SLIDE_OK
                          : slide_report(instance, SLIDE_DISCARD,
                                         "derivative of value reference %u = %g; expected a "
                                         "finite number; the former values are kept",
                                         reference, rate);
}

SlideStatus slide_set_rates(SlideInstance *instance, const SlideReference references[],
                            size_t count, const int orders[], const double rates[]) {
    SlideState *state = &instance->state;
    const bool forecasts = slide_stream_forecasts(&instance->model, state);
    SlideStatus status = SLIDE_OK;
    if (count > 0 && (references == NULL || orders == NULL || rates == NULL)) {
        return slide_null(instance);
    }
    for (size_t i = 0; status == SLIDE_OK && i < count; ++i) {
        status = check_rate(instance, references[i], orders[i], rates[i]);
    }
    if (status != SLIDE_OK) {
        return status;
    }
    for (size_t i = 0; i < count; ++i) {
        if (orders[i] == 1) {
            state->rates[references[i]] = rates[i];
            state->told[references[i]] = forecasts || rates[i] != 0;
        } else if (rates[i] != 0 && status == SLIDE_OK) {
            status = slide_report(instance, SLIDE_WARNING,
                                  "derivative of order %d of value reference %u; only order 1 "
                                  "is used",
                                  orders[i], (unsigned)references[i]);
        }
    }
    state->head->moving = 0;
    for (size_t i = 0; i < instance->model.n_inputs; ++i) {
        state->head->moving |= state->rates[i] != 0 || state->told[i];
    }
    return status;
}
