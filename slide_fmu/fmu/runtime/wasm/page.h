/* A surrogate in a page or in any other program that runs WebAssembly: the calls of FMI, without
 * FMI's types. The module needs nothing of its host: it has no imports. Used by
 * slide_fmu/apps/page/web/machine.js. */
#ifndef SLIDE_PAGE_H
#define SLIDE_PAGE_H

#include <stddef.h>
#include <stdint.h>

#define SLIDE_Page __attribute__((visibility("default")))

typedef struct SlidePage SlidePage;

/* Room for the host to write to; free it with slide_page_give_back. NULL: out of memory. */
SLIDE_Page void *slide_page_room(size_t size);
SLIDE_Page void slide_page_give_back(void *room);

/* Read a surrogate file's bytes, which are needed no longer than the call. NULL: out of memory. A
 * page whose message is not empty was refused: close it. */
SLIDE_Page SlidePage *slide_page_open(const unsigned char *data, size_t size);
SLIDE_Page void slide_page_close(SlidePage *page);

/* Why the last call failed, as text that ends with 0. */
SLIDE_Page const char *slide_page_message(const SlidePage *page);

/* All of these give a status of FMI: 0 is success, and 2 and 3 are failures with a message.
 * reset: before the start, where parameters may be set. start: time 0 s is reached. */
SLIDE_Page int slide_page_reset(SlidePage *page);
SLIDE_Page int slide_page_start(SlidePage *page);
/* The communication step, of so many seconds, from where the last one ended. */
SLIDE_Page int slide_page_step(SlidePage *page, double length);
/* Variables by their value references; Booleans are 0 or 1. */
SLIDE_Page int slide_page_set(SlidePage *page, const uint32_t *references, size_t count,
                              const double *values);
SLIDE_Page int slide_page_get(SlidePage *page, const uint32_t *references, size_t count,
                              double *values);

#endif
