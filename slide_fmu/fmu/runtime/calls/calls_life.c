/* From instantiation to the end. */
#include "calls.h"
#include "memory.h"
#include "resource.h"

#include <math.h>
#include <string.h>

static void place_watcher(SlideWatcher *watcher, const SlideInstance *instance,
                          SlideArena *arena) {
    if (watcher->show != NULL) {
        watcher->undo = slide_place(arena, instance->state.size, 1);
        watcher->set = slide_place(arena, instance->model.n_inputs, sizeof(bool));
        watcher->from = slide_place(arena, instance->model.n_inputs, sizeof(double));
        watcher->to = slide_place(arena, instance->model.n_inputs, sizeof(double));
    }
}

/* Place all that an instance needs; the same code measures and fills. */
static void place_parts(SlideInstance *instance, const SlidePayload *payload,
                        const SlideRequest *request, uint32_t steps_per_sample,
                        SlideArena *arena) {
    instance->name = slide_place(arena, strlen(request->name) + 1, 1);
    if (instance->name != NULL) {
        strcpy(instance->name, request->name);
    }
    instance->logger = request->logger;
    instance->watcher = request->watcher;
    instance->debug = request->debug;
    instance->has_more = request->has_more;
    slide_model_place(&instance->model, payload, steps_per_sample, arena);
    slide_state_place(&instance->state, &instance->model, arena);
    slide_derivative_place(&instance->derivative, &instance->model, arena);
    slide_parameter_slopes_place(&instance->parameter_slopes, &instance->model, arena);
    place_watcher(&instance->watcher, instance, arena);
}

/* Bytes of the block that begins with an instance. */
static size_t measure(const SlidePayload *payload, const SlideRequest *request,
                      uint32_t steps_per_sample, SlideInstance *measured) {
    SlideArena arena = {NULL, 0};
    slide_place(&arena, 1, sizeof *measured);
    place_parts(measured, payload, request, steps_per_sample, &arena);
    return arena.used + SLIDE_ALIGNMENT;
}

static bool never_ends(const SlideWatcher *watcher, double time, bool last, double *until) {
    (void)watcher;
    (void)time;
    (void)last;
    (void)until;
    return false;
}

SlideSizes slide_measure(const SlidePayload *payload, bool watched, uint32_t steps_per_sample) {
    char name[SLIDE_LONGEST_NAME + 1] = "";
    memset(name, 'n', SLIDE_LONGEST_NAME);
    const SlideRequest request = {.name = name, .watcher = {.show = watched ? never_ends : NULL}};
    SlideInstance measured = {0};
    const size_t instance = measure(payload, &request, steps_per_sample, &measured);
    return (SlideSizes){instance, slide_saved_size(&measured)};
}

static SlideInstance *build_instance(const SlidePayload *payload, const SlideRequest *request,
                                     SlideMessage *message) {
    SlideInstance measured = {0};
    const size_t size = measure(payload, request, SLIDE_STEPS_PER_SAMPLE, &measured);
    unsigned char *block = slide_memory_take(SLIDE_INSTANCE_MEMORY, size, message);
    if (block == NULL) {
        return NULL;
    }
    size_t misaligned = (size_t)((uintptr_t)block % SLIDE_ALIGNMENT);
    SlideArena arena = {block + (SLIDE_ALIGNMENT - misaligned), 0};
    SlideInstance *instance = slide_place(&arena, 1, sizeof *instance);
    place_parts(instance, payload, request, SLIDE_STEPS_PER_SAMPLE, &arena);
    instance->block = block;
    instance->stop = INFINITY;
    slide_state_reset(&instance->model, &instance->state);
    instance->state.head->mode = SLIDE_INSTANTIATED;
    return instance;
}

static SlideInstance *load_instance(const SlideRequest *request, SlideMessage *message) {
    size_t size = 0;
    const unsigned char *data =
        slide_surrogate_open(request->location, request->location_is_uri, &size, message);
    SlidePayload payload;
    SlideInstance *instance = NULL;
    if (data != NULL && slide_payload_read(&payload, data, size, message)) {
        const char *guid = request->guid;
        if (guid != NULL && strcmp(guid, payload.guid) == 0) {
            instance = build_instance(&payload, request, message);
        } else {
            slide_say(message,
                      "GUID %s; expected %s: modelDescription.xml and resources/surrogate.slide "
                      "do not belong together, export the FMU again",
                      guid == NULL ? "is NULL" : guid, payload.guid);
        }
    }
    slide_surrogate_close(data);
    return instance;
}

SlideInstance *slide_instantiate(const SlideRequest *request) {
    char unnamed[] = "unnamed";
    SlideMessage message = {""};
    SlideInstance *instance = NULL;
    if (request->name == NULL || request->name[0] == '\0') {
        slide_say(&message, "the instance name is empty; expected a name");
    } else if (request->fault != NULL) {
        slide_say(&message, "%s", request->fault);
    } else {
        instance = load_instance(request, &message);
    }
    if (instance == NULL) {
        const SlideInstance nobody = {
            .name = unnamed, .logger = request->logger, .function = request->function};
        slide_report(&nobody, SLIDE_ERROR, "%s", message.text);
        return NULL;
    }
    slide_report(instance, SLIDE_OK, "instantiated, window of %u samples, kernel %s",
                 (unsigned)instance->model.predictor.n_samples, instance->model.kernel->name);
    return instance;
}

void slide_free(void *component) {
    if (component != NULL) {
        slide_memory_give_back(((SlideInstance *)component)->block);
    }
}

SlideStatus slide_set_logging(SlideInstance *instance, bool on, size_t n_categories,
                              const char *const categories[]) {
    if (n_categories > 0 && categories == NULL) {
        return slide_null(instance);
    }
    bool events = n_categories == 0;
    for (size_t i = 0; i < n_categories; ++i) {
        const char *category = categories[i] == NULL ? "" : categories[i];
        bool event = strcmp(category, "logEvents") == 0 || strcmp(category, "logAll") == 0;
        if (!event && strcmp(category, "logStatusError") != 0 &&
            strcmp(category, "logStatusDiscard") != 0 &&
            strcmp(category, "logStatusWarning") != 0) {
            return slide_report(instance, SLIDE_ERROR,
                                "category '%s'; expected logAll, logEvents, logStatusWarning, "
                                "logStatusDiscard or logStatusError",
                                category);
        }
        events = events || event;
    }
    if (events) {
        instance->debug = on;
    }
    return SLIDE_OK;
}

SlideStatus slide_set_start(SlideInstance *instance, double start, bool stop_defined,
                            double stop) {
    const double step = instance->model.step, farthest = slide_clock_farthest(step);
    if (!isfinite(start) || (stop_defined && !(stop >= start))) {
        return slide_report(instance, SLIDE_ERROR,
                            "start time %g s, stop time %g s; expected a finite start and no "
                            "earlier stop",
                            start, stop);
    }
    if (fabs(start) > farthest) {
        return slide_report(instance, SLIDE_ERROR,
                            "start time %.15g s; expected at most %.3g s from 0, where steps "
                            "of %.9g s can be told apart: start nearer to 0; nothing was changed",
                            start, farthest, step);
    }
    instance->state.head->clock.anchor = start;
    instance->stop = stop_defined ? stop : INFINITY;
    return SLIDE_OK;
}

SlideStatus slide_change_mode(SlideInstance *instance, SlideMode to) {
    instance->state.head->mode = to;
    return slide_log(instance, SLIDE_OK, instance->function);
}

SlideStatus slide_reset(SlideInstance *instance) {
    instance->stop = INFINITY;
    slide_state_reset(&instance->model, &instance->state);
    return slide_change_mode(instance, SLIDE_INSTANTIATED);
}
