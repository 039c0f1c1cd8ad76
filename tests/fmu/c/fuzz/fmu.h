/* An FMU of either standard under one set of functions. Each checks that a call that is not fine
 * comes with a logged message; it gives the status, 0 when all is fine. */
#ifndef FUZZ_FMU_H
#define FUZZ_FMU_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    int standard; /* 2 or 3 */
    void *component;
    bool tampered; /* its state was not made by the runtime alone */
} FuzzFmu;

/* NULL where it is refused, which must come with a message. */
void *fuzz_instantiate(int standard, const char *name, const char *guid, const char *location,
                       bool debug, bool watches);

/* Whose intermediate states are looked at and changed in FMI 3.0, where it shows them; NULL: of
 * none. */
void fuzz_watch(const FuzzFmu *fmu);
void fuzz_free(FuzzFmu *fmu);

int fuzz_set_logging(FuzzFmu *fmu, bool on, size_t count, const char *const categories[]);
int fuzz_set_up(FuzzFmu *fmu, double start, bool stops, double stop);
int fuzz_enter_initialization(FuzzFmu *fmu, double start);
int fuzz_exit_initialization(FuzzFmu *fmu);
int fuzz_terminate(FuzzFmu *fmu);
int fuzz_reset(FuzzFmu *fmu);

/* Where it does not know how many values there are, FMI 2.0 reads or writes one for each reference;
 * there must be as many. */
int fuzz_set(FuzzFmu *fmu, const uint32_t *references, size_t count, const double *values,
             size_t n_values);
int fuzz_get(FuzzFmu *fmu, const uint32_t *references, size_t count, double *values,
             size_t n_values);

/* A single Boolean: 0 or 1. */
int fuzz_get_boolean(FuzzFmu *fmu, const uint32_t *reference, int *truth);

double fuzz_time(const FuzzFmu *fmu);
int fuzz_do_step(FuzzFmu *fmu, double time, double length);

int fuzz_save(FuzzFmu *fmu, void **state);
int fuzz_restore(FuzzFmu *fmu, void *state);
int fuzz_free_state(FuzzFmu *fmu, void **state);
int fuzz_serialized_size(FuzzFmu *fmu, void *state, size_t *size);
int fuzz_serialize(FuzzFmu *fmu, void *state, unsigned char *bytes, size_t size);
int fuzz_deserialize(FuzzFmu *fmu, const unsigned char *bytes, size_t size, void **state);

/* Directional; in FMI 3.0 also adjoint. */
int fuzz_derivative(FuzzFmu *fmu, bool adjoint, const uint32_t *unknowns, size_t n_unknowns,
                    const uint32_t *knowns, size_t n_knowns, const double *seed,
                    double *sensitivity);

/* Derivatives of inputs (FMI 2.0) and outputs by time, with orders. */
int fuzz_time_derivatives(FuzzFmu *fmu, bool of_inputs, const uint32_t *references, size_t count,
                          const int32_t *orders, double *values);

/* One of the functions that only ask, or are never offered; without any room for answers. */
int fuzz_ask(FuzzFmu *fmu, unsigned which, size_t count);

#endif
