#include "steps.h"

#include <stdbool.h>

/* A status up to this one lets a simulation go on (fmi2Status, fmi3Status). */
#define WARNING 1

typedef int (*Access2)(void *component, const uint32_t *references, size_t count, void *values);
typedef int (*Access3)(void *component, const uint32_t *references, size_t count, void *values,
                       size_t n_values);
typedef int (*DoStep2)(void *component, double begin, double length, int final);
typedef int (*DoStep3)(void *component, double begin, double length, bool final, bool *event,
                       bool *terminate, bool *early, double *reached);

/* Set or read all variables at a step; the status of the first call that failed. */
static int access_all(SlideSteps *steps, const SlideVariables *some, size_t n_some, size_t step) {
    for (size_t i = 0; i < n_some; i++) {
        const SlideVariables *one = &some[i];
        void *values = one->values + step * one->row;
        const int status =
            steps->fmi == 2
                ? ((Access2)one->call)(steps->component, one->references, one->count, values)
                : ((Access3)one->call)(steps->component, one->references, one->count, values,
                                       one->count);
        if (status > WARNING) {
            return status;
        }
        steps->place++;
    }
    return 0;
}

static int do_step(SlideSteps *steps, size_t step) {
    const double begin = steps->begins[step], length = steps->lengths[step];
    if (steps->fmi == 2) {
        return ((DoStep2)steps->do_step)(steps->component, begin, length, 1);
    }
    bool event = false, terminate = false, early = false;
    const int status = ((DoStep3)steps->do_step)(steps->component, begin, length, true, &event,
                                                 &terminate, &early, &steps->reached);
    steps->terminate = terminate;
    steps->early = early;
    return status;
}

int slide_native_steps(SlideSteps *steps) {
    for (steps->done = 0; steps->done < steps->count; steps->done++) {
        steps->place = 0;
        int status = access_all(steps, steps->set, steps->n_set, steps->done);
        if (status == 0) {
            status = do_step(steps, steps->done);
            status = status > WARNING ? status : 0;
        }
        if (status != 0 || steps->terminate != 0 || steps->early != 0) {
            return status;
        }
        steps->place++;
        status = access_all(steps, steps->get, steps->n_get, steps->done);
        if (status != 0) {
            return status;
        }
    }
    return 0;
}
