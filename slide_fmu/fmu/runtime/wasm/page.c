/* The calls of a page, over calls.h. */
#include "page.h"

#include "calls.h"
#include "host_bytes.h"
#include "payload.h"
#include "variables.h"

#include <stdio.h>
#include <stdlib.h>

struct SlidePage {
    SlideInstance *instance;
    SlideMessage message; /* of the last call that failed, or "" */
};

void *slide_page_room(size_t size) { return malloc(size); }

void slide_page_give_back(void *room) { free(room); }

static void write_log(const SlideLogger *logger, const char *instance, SlideStatus status,
                      const char *category, const char *text) {
    SlidePage *page = logger->environment;
    (void)instance;
    (void)category;
    if (status != SLIDE_OK) {
        snprintf(page->message.text, sizeof page->message.text, "%s", text);
    }
}

static void nobody(void) {} /* stands for the importer's function, which write_log does not call */

SlidePage *slide_page_open(const unsigned char *data, size_t size) {
    SlidePage *page = calloc(1, sizeof *page);
    SlidePayload payload;
    if (page == NULL || !slide_payload_read(&payload, data, size, &page->message)) {
        return page;
    }
    const SlideHostBytes given = {data, size};
    const SlideRequest request = {
        .function = __func__,
        .name = "page",
        .guid = payload.guid,
        .location = (const char *)&given,
        .logger = {write_log, nobody, page},
    };
    page->instance = slide_instantiate(&request);
    return page;
}

void slide_page_close(SlidePage *page) {
    if (page != NULL) {
        slide_free(page->instance);
        free(page);
    }
}

const char *slide_page_message(const SlidePage *page) { return page->message.text; }

int slide_page_reset(SlidePage *page) {
    SlideInstance *instance = slide_enter(page->instance, SLIDE_ANY_MODE, __func__);
    return instance == NULL ? SLIDE_ERROR : slide_reset(instance);
}

int slide_page_start(SlidePage *page) {
    SlideInstance *instance = slide_enter(page->instance, SLIDE_INSTANTIATED, __func__);
    return instance == NULL ? SLIDE_ERROR : slide_change_mode(instance, SLIDE_STEPPING);
}

int slide_page_step(SlidePage *page, double length) {
    SlideInstance *instance = slide_enter(page->instance, SLIDE_STEPPING, __func__);
    if (instance == NULL) {
        return SLIDE_ERROR;
    }
    return slide_do_step(instance, slide_clock_time(&instance->state.head->clock), length, NULL);
}

int slide_page_set(SlidePage *page, const uint32_t *references, size_t count,
                   const double *values) {
    SlideInstance *instance = slide_enter(page->instance, SLIDE_SETTABLE, __func__);
    const SlideValues of = {references, count, count, SLIDE_DOUBLES};
    return instance == NULL ? SLIDE_ERROR : slide_set(instance, &of, values);
}

/* How many of the variables, from the first on, are Real. */
static size_t count_reals(const SlideInstance *instance, const uint32_t *references,
                          size_t count) {
    size_t n_reals = 0;
    while (n_reals < count && slide_variable(instance, references[n_reals]).type == SLIDE_REAL) {
        ++n_reals;
    }
    return n_reals;
}

static SlideStatus get_truth(SlideInstance *instance, const uint32_t *reference, double *value) {
    int truth = 0;
    SlideStatus status = slide_get(instance, &(SlideValues){reference, 1, 1, SLIDE_INTS}, &truth);
    *value = truth;
    return status;
}

int slide_page_get(SlidePage *page, const uint32_t *references, size_t count, double *values) {
    SlideInstance *instance = slide_enter(page->instance, SLIDE_READABLE, __func__);
    SlideStatus status = instance == NULL ? SLIDE_ERROR : SLIDE_OK;
    for (size_t i = 0; i < count && status == SLIDE_OK; ++i) {
        const size_t n = count_reals(instance, references + i, count - i);
        const SlideValues reals = {references + i, n, n, SLIDE_DOUBLES};
        status = n > 0 ? slide_get(instance, &reals, values + i) : SLIDE_OK;
        i += n;
        if (status == SLIDE_OK && i < count) {
            status = get_truth(instance, references + i, values + i);
        }
    }
    return status;
}
