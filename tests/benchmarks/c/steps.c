/* Communication steps of any FMU of FMI 2.0, one after the other, for tests/benchmarks/
 * scalar_sources.py and step_cost.py: inputs are set and outputs are read in each. */
#define _POSIX_C_SOURCE 200809L
#include <stddef.h>
#include <time.h>

typedef struct {
    int (*set)(void *, const unsigned *, size_t, const double *);
    int (*step)(void *, double, double, int);
    int (*get)(void *, const unsigned *, size_t, double *);
    int (*get_booleans)(void *, const unsigned *, size_t, int *);
} Functions;

typedef struct {
    const unsigned *inputs_at, *outputs_at, *booleans_at; /* value references */
    size_t n_inputs, n_outputs, n_booleans, n_steps;
    const double *times, *lengths; /* s, [n_steps]: begin and length of each step */
    const double *inputs;          /* [n_steps][n_inputs] */
    double *outputs;               /* [n_steps][n_outputs] */
    int *booleans;                 /* [n_booleans], of the last step */
    double *seconds;               /* processor time of this thread, of all steps */
} Steps;

int steps_run(const Functions *call, void *instance, const Steps *of);

static double now(void) {
    struct timespec at;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &at);
    return (double)at.tv_sec + 1e-9 * (double)at.tv_nsec;
}

/* 0 where all is well. */
int steps_run(const Functions *call, void *instance, const Steps *of) {
    int status = 0;
    const double begin = now();
    for (size_t k = 0; k < of->n_steps && status == 0; ++k) {
        status = call->set(instance, of->inputs_at, of->n_inputs, of->inputs + k * of->n_inputs);
        status |= call->step(instance, of->times[k], of->lengths[k], 1);
        status |= call->get(instance, of->outputs_at, of->n_outputs,
                            of->outputs + k * of->n_outputs);
        if (of->n_booleans > 0) {
            status |= call->get_booleans(instance, of->booleans_at, of->n_booleans, of->booleans);
        }
    }
    *of->seconds = now() - begin;
    return status;
}
