/* FMI 2.0: the functions of the table. */
#include "calls.h"
#include "derivatives_by_reference.h"
#include "fmi2.h"

#pragma GCC diagnostic ignored "-Wunused-parameter" /* not all that the standard passes is used */

#define CALL(function, arguments, call)                                                           \
    fmi2Status function arguments { return (fmi2Status)call; }
#include "fmi2_functions.h"
