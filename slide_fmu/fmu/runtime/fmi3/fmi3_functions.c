/* FMI 3.0: the functions of the table. */
#include "calls.h"
#include "derivatives_by_reference.h"
#include "fmi3.h"

#pragma GCC diagnostic ignored "-Wunused-parameter" /* not all that the standard passes is used */

#define CALL(function, arguments, call)                                                           \
    fmi3Status function arguments { return (fmi3Status)call; }
#include "fmi3_functions.h"
