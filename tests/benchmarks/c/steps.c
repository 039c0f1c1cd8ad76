/* Communication steps of any FMU of FMI 2.0, one after the other, for tests/benchmarks/
 * scalar_sources.py: inputs are set and outputs are read in each. */
#include <stddef.h>

typedef struct {
    int (*set)(void *, const unsigned *, size_t, const double *);
    int (*step)(void *, double, double, int);
    int (*get)(void *, const unsigned *, size_t, double *);
} Functions;

typedef struct {
    const unsigned *inputs_at, *outputs_at; /* value references */
    size_t n_inputs, n_outputs, n_steps;
    double length;        /* s, of a step */
    const double *inputs; /* [n_steps][n_inputs] */
    double *outputs;      /* [n_steps][n_outputs] */
} Steps;

int steps_run(const Functions *call, void *instance, const Steps *of);

/* 0 where all is well. */
int steps_run(const Functions *call, void *instance, const Steps *of) {
    int status = 0;
    for (size_t k = 0; k < of->n_steps && status == 0; ++k) {
        status = call->set(instance, of->inputs_at, of->n_inputs, of->inputs + k * of->n_inputs);
        status |= call->step(instance, (double)k * of->length, of->length, 1);
        status |= call->get(instance, of->outputs_at, of->n_outputs,
                            of->outputs + k * of->n_outputs);
    }
    return status;
}
