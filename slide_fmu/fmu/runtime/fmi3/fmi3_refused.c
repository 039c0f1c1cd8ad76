/* FMI 3.0: functions that this FMU does not offer log why, and change nothing. */
#include "calls.h"
#include "fmi3.h"

#pragma GCC diagnostic ignored "-Wunused-parameter" /* who refuses looks at no argument */

#define REFUSED(function, arguments, reason)                                                      \
    fmi3Status function arguments { return (fmi3Status)slide_refuse(instance, __func__, reason); }
#define NO_SUCH_TYPE(function, arguments)                                                         \
    fmi3Status function arguments {                                                               \
        return (fmi3Status)slide_none_of_type(instance, nvr, __func__);                           \
    }
#include "fmi3_refused.h"
