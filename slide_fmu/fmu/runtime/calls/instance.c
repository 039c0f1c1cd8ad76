#include "instance.h"

#include <stdio.h>

SlideStatus slide_log(const SlideInstance *instance, SlideStatus status, const char *text) {
    static const char *const categories[] = {"logEvents", "logStatusWarning", "logStatusDiscard",
                                             "logStatusError"};
    if (instance->logger.callback != NULL && (status != SLIDE_OK || instance->debug)) {
        instance->logger.write(&instance->logger, instance->name, status, categories[status],
                               text);
    }
    return status;
}

SlideStatus slide_report(const SlideInstance *instance, SlideStatus status, const char *format,
                         ...) {
    char text[512] = "";
    int begin = 0;
    if (instance->function != NULL) {
        begin = snprintf(text, sizeof text, "%s: ", instance->function);
    }
    va_list arguments;
    va_start(arguments, format);
    slide_format(text + begin, sizeof text - (size_t)begin, format, arguments);
    va_end(arguments);
    return slide_log(instance, status, text);
}

SlideInstance *slide_enter(void *component, unsigned modes, const char *function) {
    static const char *const names[] = {
        [SLIDE_INSTANTIATED] = "instantiated", [SLIDE_INITIALIZATION] = "initialization mode",
        [SLIDE_STEPPING] = "step mode",        [SLIDE_TERMINATED] = "terminated",
        [SLIDE_BETWEEN] = "intermediate update mode",
    };
    SlideInstance *instance = component;
    if (instance == NULL) {
        return NULL;
    }
    const unsigned mode = instance->state.head->mode;
    if ((mode & modes) == 0) {
        instance->function = NULL;
        slide_report(instance, SLIDE_ERROR,
                     "%s must not be called in state '%s'; nothing was changed", function,
                     names[mode]);
        return NULL;
    }
    instance->function = function;
    return instance;
}

SlideStatus slide_null(const SlideInstance *instance) {
    return slide_report(instance, SLIDE_ERROR,
                        "an argument is NULL; expected an array or a place for the result");
}

SlideStatus slide_refuse(const SlideInstance *instance, const char *reason) {
    return slide_report(instance, SLIDE_ERROR, "%s; nothing was changed", reason);
}
