/* What the functions of FMI 2.0 and FMI 3.0 do alike. In all of them, component is an instance, or
 * NULL, which is an error; function is the name that messages give. What goes wrong is logged, and
 * changes nothing. */
#ifndef SLIDE_CALLS_H
#define SLIDE_CALLS_H

#include "instance.h"

/* What a master tells when it instantiates an FMU. */
typedef struct {
    const char *function, *name, *guid;
    const char *location; /* of the resources: a URI in FMI 2.0, a path in FMI 3.0 */
    bool location_is_uri;
    const char *fault; /* why the standard's function refuses, or NULL */
    SlideLogger logger;
    bool debug;
    bool has_more; /* as in SlideInstance */
    SlideWatcher watcher;
} SlideRequest;

/* From instantiation to the end (calls_life.c). slide_instantiate: NULL when refused. */
SlideInstance *slide_instantiate(const SlideRequest *request);
void slide_free(void *component);
SlideStatus slide_set_logging(void *component, bool on, size_t n_categories,
                              const char *const categories[], const char *function);
SlideStatus slide_set_start(void *component, double start, bool stop_defined, double stop,
                            const char *function);
SlideStatus slide_change_mode(void *component, SlideMode from, SlideMode to, const char *function);
SlideStatus slide_reset(void *component, const char *function);

/* How the caller holds values: of Real variables as double, of Boolean ones as int (FMI 2.0) or
 * bool (FMI 3.0). */
typedef enum { SLIDE_DOUBLES, SLIDE_INTS, SLIDE_BOOLS } SlideForm;

/* Variables, all of one type, and how many values come with them: one for each, but of an array
 * all. */
typedef struct {
    const uint32_t *references;
    size_t n_references, n_values;
    SlideForm form;
} SlideValues;

/* Values of the variables (calls_values.c). */
SlideStatus slide_get(void *component, const SlideValues *of, void *values, const char *function);
SlideStatus slide_set(void *component, const SlideValues *of, const void *values,
                      const char *function);

/* Variables of another type: there are none; asking for none of them is fine. */
SlideStatus slide_none_of_type(void *component, size_t count, const char *function);

/* Derivatives of inputs with respect to time (calls_rates.c). */
SlideStatus slide_set_rates(void *component, const uint32_t references[], size_t count,
                            const int orders[], const double rates[], const char *function);

/* The communication step (calls_step.c). early: where the master may watch, whether it ended the
 * step before its end; or NULL. */
SlideStatus slide_do_step(void *component, double point, double length, bool *early,
                          const char *function);

/* Save, restore and serialise the state (calls_state.c). */
SlideStatus slide_save(void *component, void **state, const char *function);
SlideStatus slide_restore(void *component, const void *state, const char *function);
SlideStatus slide_free_state(void *component, void **state, const char *function);
SlideStatus slide_serialized_size(void *component, const void *state, size_t *size,
                                  const char *function);
SlideStatus slide_serialize(void *component, const void *state, void *bytes, size_t size,
                            const char *function);
SlideStatus slide_deserialize(void *component, const void *bytes, size_t size, void **state,
                              const char *function);

/* A function that is exported, because masters look it up, but not offered. */
SlideStatus slide_refuse(void *component, const char *function, const char *reason);

#endif
