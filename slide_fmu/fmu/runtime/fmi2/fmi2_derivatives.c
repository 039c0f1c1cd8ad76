/* FMI 2.0: derivatives of outputs by inputs (derivative.h says of what). */
#include "derivatives_by_reference.h"
#include "fmi2.h"

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[],
                                        size_t nUnknown, const fmi2ValueReference vKnown_ref[],
                                        size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
    const SlideDerivativePair of = {vUnknown_ref, nUnknown, vKnown_ref, nKnown};
    return (fmi2Status)slide_get_directional_derivative(c, &of, dvKnown, dvUnknown, __func__);
}
