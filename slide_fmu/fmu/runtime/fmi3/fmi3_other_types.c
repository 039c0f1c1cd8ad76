/* FMI 3.0: variables of other types than Float64, and clocks. There are none; asking for none of
 * them is fine. */
#include "calls.h"
#include "fmi3.h"

#define GET_AND_SET(Type)                                                                         \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,    \
                             fmi3##Type values[], size_t n_values) {                              \
        (void)vr, (void)values, (void)n_values;                                                   \
        return (fmi3Status)slide_only_real(instance, nvr, __func__);                              \
    }                                                                                             \
    fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,    \
                             const fmi3##Type values[], size_t n_values) {                        \
        (void)vr, (void)values, (void)n_values;                                                   \
        return (fmi3Status)slide_only_real(instance, nvr, __func__);                              \
    }

GET_AND_SET(Float32)
GET_AND_SET(Int8)
GET_AND_SET(UInt8)
GET_AND_SET(Int16)
GET_AND_SET(UInt16)
GET_AND_SET(Int32)
GET_AND_SET(UInt32)
GET_AND_SET(Int64)
GET_AND_SET(UInt64)
GET_AND_SET(Boolean)
GET_AND_SET(String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                         size_t sizes[], fmi3Binary values[], size_t n_values) {
    (void)vr, (void)sizes, (void)values, (void)n_values;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                         const size_t sizes[], const fmi3Binary values[], size_t n_values) {
    (void)vr, (void)sizes, (void)values, (void)n_values;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                        fmi3Clock values[]) {
    (void)vr, (void)values;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                        const fmi3Clock values[]) {
    (void)vr, (void)values;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                  fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]) {
    (void)vr, (void)intervals, (void)qualifiers;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference vr[],
                                   size_t nvr, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[]) {
    (void)vr, (void)counters, (void)resolutions, (void)qualifiers;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                               fmi3Float64 shifts[]) {
    (void)vr, (void)shifts;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
    (void)vr, (void)counters, (void)resolutions;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                  const fmi3Float64 intervals[]) {
    (void)vr, (void)intervals;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference vr[],
                                   size_t nvr, const fmi3UInt64 counters[],
                                   const fmi3UInt64 resolutions[]) {
    (void)vr, (void)counters, (void)resolutions;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                               const fmi3Float64 shifts[]) {
    (void)vr, (void)shifts;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr,
                                const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
    (void)vr, (void)counters, (void)resolutions;
    return (fmi3Status)slide_only_real(instance, nvr, __func__);
}
