#include "instance.h"

#include <stdarg.h>
#include <stdio.h>

SlideStatus slide_report(const SlideInstance *instance, SlideStatus status, const char *format,
                         ...) {
    static const char *const categories[] = {"logEvents", "logStatusWarning", "logStatusDiscard",
                                             "logStatusError"};
    char text[512];
    if (instance->logger.write == NULL || (status == SLIDE_OK && !instance->debug)) {
        return status;
    }
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    instance->logger.write(&instance->logger, instance->name, status, categories[status], text);
    return status;
}

static const char *mode_name(unsigned mode) {
    switch (mode) {
    case SLIDE_INSTANTIATED:
        return "instantiated";
    case SLIDE_INITIALIZATION:
        return "initialization mode";
    case SLIDE_STEPPING:
        return "step mode";
    case SLIDE_BETWEEN:
        return "intermediate update mode";
    default:
        return "terminated";
    }
}

SlideInstance *slide_enter(void *component, unsigned modes, const char *function) {
    SlideInstance *instance = component;
    if (instance == NULL) {
        return NULL;
    }
    unsigned mode = instance->state.head->mode;
    if ((mode & modes) == 0) {
        slide_report(instance, SLIDE_ERROR,
                     "%s must not be called in state '%s'; nothing was changed", function,
                     mode_name(mode));
        return NULL;
    }
    return instance;
}

SlideStatus slide_null(const SlideInstance *instance, const char *function) {
    return slide_report(instance, SLIDE_ERROR, "%s: an argument is NULL; expected an array or a "
                                               "place for the result",
                        function);
}
