/* FMI 2.0: functions that this FMU does not offer log why, and change nothing. */
#include "calls.h"
#include "fmi2.h"

#pragma GCC diagnostic ignored "-Wunused-parameter" /* who refuses looks at no argument */

#define REFUSED(function, arguments, reason)                                                      \
    fmi2Status function arguments { return (fmi2Status)slide_refuse(c, __func__, reason); }
#define NO_SUCH_TYPE(function, arguments)                                                         \
    fmi2Status function arguments {                                                               \
        return (fmi2Status)slide_none_of_type(c, nvr, __func__);                                  \
    }
#include "fmi2_refused.h"
