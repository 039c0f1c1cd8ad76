#include "instance.h"

#include <stdarg.h>
#include <stdio.h>

/* The logger takes a printf format in which # marks variables: both characters are doubled. */
static void escape(const char *text, char *escaped, size_t size) {
    size_t at = 0;
    for (; *text != '\0' && at + 3 < size; ++text) {
        if (*text == '%' || *text == '#') {
            escaped[at++] = *text;
        }
        escaped[at++] = *text;
    }
    escaped[at] = '\0';
}

fmi2Status slide_report(const SlideInstance *instance, fmi2Status status, const char *format,
                        ...) {
    const char *category = status == fmi2OK        ? "logEvents"
                           : status == fmi2Discard ? "logStatusDiscard"
                                                   : "logStatusError";
    char text[512], escaped[2 * sizeof text];
    if (instance->callbacks.logger == NULL || (status == fmi2OK && !instance->debug)) {
        return status;
    }
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    escape(text, escaped, sizeof escaped);
    instance->callbacks.logger(instance->callbacks.componentEnvironment, instance->name, status,
                               category, escaped);
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
    default:
        return "terminated";
    }
}

SlideInstance *slide_enter(fmi2Component component, unsigned modes, const char *function) {
    SlideInstance *instance = component;
    if (instance == NULL) {
        return NULL;
    }
    unsigned mode = instance->state.head->mode;
    if ((mode & modes) == 0) {
        slide_report(instance, fmi2Error,
                     "%s must not be called in state '%s'; nothing was changed", function,
                     mode_name(mode));
        return NULL;
    }
    return instance;
}

fmi2Status slide_null(const SlideInstance *instance, const char *function) {
    return slide_report(instance, fmi2Error, "%s: an argument is NULL; expected an array or a "
                                             "place for the result",
                        function);
}
