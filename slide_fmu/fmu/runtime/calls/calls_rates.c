/* Derivatives of inputs with respect to time (FMI 2.0.4, section 4.2.1), for the next step. */
#include "calls.h"

#include <math.h>

/* Only first derivatives are used; a master cannot know that, since FMI 2.0 has no place to say it. */
static SlideStatus check_rate(const SlideInstance *instance, uint32_t reference, int order,
                              double rate, const char *function) {
    const uint32_t n_inputs = instance->model.n_inputs;
    if (reference >= n_inputs) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: value reference %u is no input; expected 0 to %u; nothing was "
                            "changed",
                            function, reference, (unsigned)n_inputs - 1);
    }
    if (order < 1) {
        return slide_report(instance, SLIDE_ERROR,
                            "%s: derivative of order %d of value reference %u; expected order 1; "
                            "nothing was changed",
                            function, order, reference);
    }
    return isfinite(rate) ? SLIDE_OK
                          : slide_report(instance, SLIDE_DISCARD,
                                         "%s: derivative of value reference %u = %g; expected a "
                                         "finite number; the former values are kept",
                                         function, reference, rate);
}

/* Whether any input moves, and what there is to say. */
static SlideStatus set_rates(SlideInstance *instance, const uint32_t references[], size_t count,
                             const int orders[], const double rates[], const char *function) {
    SlideState *state = &instance->state;
    SlideStatus status = SLIDE_OK;
    for (size_t i = 0; i < count; ++i) {
        if (orders[i] == 1) {
            state->rates[references[i]] = rates[i];
        } else if (rates[i] != 0 && status == SLIDE_OK) {
            status = slide_report(instance, SLIDE_WARNING,
                                  "%s: derivative of order %d of value reference %u; only order 1 "
                                  "is used",
                                  function, orders[i], references[i]);
        }
    }
    state->head->moving = 0;
    for (size_t i = 0; i < instance->model.n_inputs; ++i) {
        state->head->moving |= state->rates[i] != 0;
    }
    return status;
}

SlideStatus slide_set_rates(void *component, const uint32_t references[], size_t count,
                            const int orders[], const double rates[], const char *function) {
    SlideInstance *instance = slide_enter(component, SLIDE_SETTABLE, function);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    if (count > 0 && (references == NULL || orders == NULL || rates == NULL)) {
        return slide_null(instance, function);
    }
    SlideStatus status = SLIDE_OK;
    for (size_t i = 0; status == SLIDE_OK && i < count; ++i) {
        status = check_rate(instance, references[i], orders[i], rates[i], function);
    }
    return status == SLIDE_OK ? set_rates(instance, references, count, orders, rates, function)
                              : status;
}
