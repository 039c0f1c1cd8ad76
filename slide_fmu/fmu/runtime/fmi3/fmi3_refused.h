/* FMI 3.0: functions that this FMU exports, because importers look them up, but does not offer: a
 * table without include guard, which fmi3.h reads as declarations and fmi3_refused.c as
 * definitions. Each row has a function's name, its arguments as the standard has them, and why it is
 * refused; variables of a type that there is not are fine as long as none is asked for. */

#define OF(...) (fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr, __VA_ARGS__)
#define NOT_OF_TYPE(Type)                                                                         \
    NO_SUCH_TYPE(fmi3Get##Type, OF(fmi3##Type values[], size_t n_values))                         \
    NO_SUCH_TYPE(fmi3Set##Type, OF(const fmi3##Type values[], size_t n_values))

NOT_OF_TYPE(Float32)
NOT_OF_TYPE(Int8)
NOT_OF_TYPE(UInt8)
NOT_OF_TYPE(Int16)
NOT_OF_TYPE(UInt16)
NOT_OF_TYPE(Int32)
NOT_OF_TYPE(UInt32)
NOT_OF_TYPE(Int64)
NOT_OF_TYPE(UInt64)
NOT_OF_TYPE(String)
NO_SUCH_TYPE(fmi3GetBinary, OF(size_t sizes[], fmi3Binary values[], size_t n_values))
NO_SUCH_TYPE(fmi3SetBinary, OF(const size_t sizes[], const fmi3Binary values[], size_t n_values))
NO_SUCH_TYPE(fmi3GetClock, OF(fmi3Clock values[]))
NO_SUCH_TYPE(fmi3SetClock, OF(const fmi3Clock values[]))
NO_SUCH_TYPE(fmi3GetIntervalDecimal,
             OF(fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]))
NO_SUCH_TYPE(fmi3GetIntervalFraction, OF(fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                         fmi3IntervalQualifier qualifiers[]))
NO_SUCH_TYPE(fmi3GetShiftDecimal, OF(fmi3Float64 shifts[]))
NO_SUCH_TYPE(fmi3GetShiftFraction, OF(fmi3UInt64 counters[], fmi3UInt64 resolutions[]))
NO_SUCH_TYPE(fmi3SetIntervalDecimal, OF(const fmi3Float64 intervals[]))
NO_SUCH_TYPE(fmi3SetIntervalFraction,
             OF(const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))
NO_SUCH_TYPE(fmi3SetShiftDecimal, OF(const fmi3Float64 shifts[]))
NO_SUCH_TYPE(fmi3SetShiftFraction, OF(const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))

#define NO_EVENTS "this FMU has no event mode, as modelDescription.xml says"
REFUSED(fmi3EnterEventMode, (fmi3Instance instance), NO_EVENTS)
REFUSED(fmi3EvaluateDiscreteStates, (fmi3Instance instance), NO_EVENTS)
REFUSED(fmi3UpdateDiscreteStates,
        (fmi3Instance instance, fmi3Boolean *need_update, fmi3Boolean *terminate,
         fmi3Boolean *nominals_changed, fmi3Boolean *values_changed, fmi3Boolean *next_defined,
         fmi3Float64 *next_time),
        NO_EVENTS)
REFUSED(fmi3EnterStepMode, (fmi3Instance instance), NO_EVENTS)

#define NO_PARAMETERS "this FMU has no structural parameters"
REFUSED(fmi3EnterConfigurationMode, (fmi3Instance instance), NO_PARAMETERS)
REFUSED(fmi3ExitConfigurationMode, (fmi3Instance instance), NO_PARAMETERS)

#define NO_ELEMENTS "dependencies are those of modelDescription.xml"
REFUSED(fmi3GetNumberOfVariableDependencies,
        (fmi3Instance instance, fmi3ValueReference vr, size_t *count), NO_ELEMENTS)
REFUSED(fmi3GetVariableDependencies,
        (fmi3Instance instance, fmi3ValueReference dependent, size_t elements_of_dependent[],
         fmi3ValueReference independents[], size_t elements_of_independents[],
         fmi3DependencyKind kinds[], size_t count),
        NO_ELEMENTS)

REFUSED(fmi3GetOutputDerivatives,
        (fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr, const fmi3Int32 orders[],
         fmi3Float64 values[], size_t n_values),
        "derivatives with respect to time are not offered, as modelDescription.xml says")

#define NO_EXCHANGE "this FMU is for co-simulation, not for model exchange"
REFUSED(fmi3EnterContinuousTimeMode, (fmi3Instance instance), NO_EXCHANGE)
REFUSED(fmi3CompletedIntegratorStep,
        (fmi3Instance instance, fmi3Boolean no_set_state, fmi3Boolean *enter_event_mode,
         fmi3Boolean *terminate),
        NO_EXCHANGE)
REFUSED(fmi3SetTime, (fmi3Instance instance, fmi3Float64 time), NO_EXCHANGE)
REFUSED(fmi3SetContinuousStates, (fmi3Instance instance, const fmi3Float64 x[], size_t nx),
        NO_EXCHANGE)
REFUSED(fmi3GetContinuousStateDerivatives,
        (fmi3Instance instance, fmi3Float64 derivatives[], size_t nx), NO_EXCHANGE)
REFUSED(fmi3GetEventIndicators, (fmi3Instance instance, fmi3Float64 indicators[], size_t ni),
        NO_EXCHANGE)
REFUSED(fmi3GetContinuousStates, (fmi3Instance instance, fmi3Float64 x[], size_t nx), NO_EXCHANGE)
REFUSED(fmi3GetNominalsOfContinuousStates,
        (fmi3Instance instance, fmi3Float64 nominals[], size_t nx), NO_EXCHANGE)
REFUSED(fmi3GetNumberOfEventIndicators, (fmi3Instance instance, size_t *count), NO_EXCHANGE)
REFUSED(fmi3GetNumberOfContinuousStates, (fmi3Instance instance, size_t *count), NO_EXCHANGE)

REFUSED(fmi3ActivateModelPartition,
        (fmi3Instance instance, fmi3ValueReference clock, fmi3Float64 time),
        "this FMU is for co-simulation, not for scheduled execution")

#undef OF
#undef NOT_OF_TYPE
#undef NO_EVENTS
#undef NO_PARAMETERS
#undef NO_ELEMENTS
#undef NO_EXCHANGE
#undef NO_SUCH_TYPE
#undef REFUSED
