/* What the functions of FMI 2.0 and FMI 3.0 do alike, once slide_enter has said that they may be
 * called. What goes wrong is logged, and changes nothing. */
#ifndef SLIDE_CALLS_H
#define SLIDE_CALLS_H

#include "instance.h"

/* Which variable: of the type that the standard has, in FMI 2.0 unsigned int, which for some
 * compilers is another type than uint32_t. Source FMUs define it. */
#if !defined(SLIDE_REFERENCE)
#define SLIDE_REFERENCE uint32_t
#endif
typedef SLIDE_REFERENCE SlideReference;

/* What an importer tells when it instantiates an FMU. */
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

/* The most memory, in bytes, of an instance, whose name has at most SLIDE_LONGEST_NAME characters,
 * and of one of its saved states, on any processor; where importers may watch, as in FMI 3.0, or
 * not; compiled with so many SLIDE_STEPS_PER_SAMPLE. */
enum { SLIDE_LONGEST_NAME = 255 };
typedef struct {
    size_t instance, saved_state;
} SlideSizes;
SlideSizes slide_measure(const SlidePayload *payload, bool watched, uint32_t steps_per_sample);

void slide_free(void *component);
SlideStatus slide_set_logging(SlideInstance *instance, bool on, size_t n_categories,
                              const char *const categories[]);
SlideStatus slide_set_start(SlideInstance *instance, double start, bool stop_defined, double stop);
SlideStatus slide_change_mode(SlideInstance *instance, SlideMode to);
SlideStatus slide_reset(SlideInstance *instance);

/* How the caller holds values: of Real variables as double, of Boolean ones as int (FMI 2.0) or
 * bool (FMI 3.0). */
typedef enum { SLIDE_DOUBLES, SLIDE_INTS, SLIDE_BOOLS } SlideForm;

/* Variables, all of one type, and how many values come with them: one for each, but of an array
 * all. */
typedef struct {
    const SlideReference *references;
    size_t n_references, n_values;
    SlideForm form;
} SlideValues;

/* Values of the variables (calls_values.c). */
SlideStatus slide_get(SlideInstance *instance, const SlideValues *of, void *values);
SlideStatus slide_set(SlideInstance *instance, const SlideValues *of, const void *values);

/* Before the first step: find the outputs for the present inputs, where they are not there. */
SlideStatus slide_settle(SlideInstance *instance);

/* Is all there that the start needs, where outputs before it are said to be known? */
SlideStatus slide_check_start(const SlideInstance *instance);

/* Variables of another type: there are none; asking for none of them is fine. */
SlideStatus slide_none_of_type(SlideInstance *instance, size_t count);

/* Derivatives of inputs with respect to time (calls_rates.c). */
SlideStatus slide_set_rates(SlideInstance *instance, const SlideReference references[],
                            size_t count, const int orders[], const double rates[]);

/* Derivatives of scalar outputs by inputs, also of those outputs that tell about others. */
typedef struct {
    const SlideReference *unknowns;
    size_t n_unknowns;
    const SlideReference *knowns;
    size_t n_knowns;
    const double *seed;
    size_t n_seed;
    double *sensitivity;
    size_t n_sensitivity;
} SlideSensitivities;

/* From seeds of the knowns to sensitivities of the unknowns, a known that is given twice counting
 * as the sum; and from seeds of the unknowns to sensitivities of the knowns (calls_slopes.c). */
SlideStatus slide_get_directional_derivative(SlideInstance *instance,
                                             const SlideSensitivities *of);
SlideStatus slide_get_adjoint_derivative(SlideInstance *instance, const SlideSensitivities *of);

/* The communication step (calls_step.c). early: where the importer may watch, whether it ended the
 * step before its end; or NULL. */
SlideStatus slide_do_step(SlideInstance *instance, double point, double length, bool *early);

/* Save, restore and serialise the state (calls_state.c); bytes of a saved one. */
size_t slide_saved_size(const SlideInstance *instance);
SlideStatus slide_save(SlideInstance *instance, void **state);
SlideStatus slide_restore(SlideInstance *instance, const void *state);
SlideStatus slide_free_state(SlideInstance *instance, void **state);
SlideStatus slide_serialized_size(SlideInstance *instance, const void *state, size_t *size);
SlideStatus slide_serialize(SlideInstance *instance, const void *state, void *bytes, size_t size);
SlideStatus slide_deserialize(SlideInstance *instance, const void *bytes, size_t size,
                              void **state);

#endif
