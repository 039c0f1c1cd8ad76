/* FMI 3.0: the functions that one call answers, and those that this FMU exports, because importers
 * look them up, but does not offer. A table without include guard, which fmi3.h reads as
 * declarations and fmi3_functions.c as definitions: CALL(name, arguments as the standard has them,
 * what is called). */

#define REFUSED(function, arguments, reason)                                                      \
    CALL(function, arguments, slide_refuse(instance, __func__, reason))
/* There are none of this type; asking for none of them is fine. */
#define NO_SUCH_TYPE(function, arguments)                                                         \
    CALL(function, arguments, slide_none_of_type(instance, nvr, __func__))

CALL(fmi3SetDebugLogging,
     (fmi3Instance instance, fmi3Boolean on, size_t n_categories, const fmi3String categories[]),
     slide_set_logging(instance, on, n_categories, categories, __func__))
CALL(fmi3ExitInitializationMode, (fmi3Instance instance),
     slide_change_mode(instance, SLIDE_INITIALIZATION, SLIDE_STEPPING, __func__))
CALL(fmi3Terminate, (fmi3Instance instance),
     slide_change_mode(instance, SLIDE_STEPPING, SLIDE_TERMINATED, __func__))
CALL(fmi3Reset, (fmi3Instance instance), slide_reset(instance, __func__))

#define VARIABLES fmi3Instance instance, const fmi3ValueReference vr[], size_t nvr
CALL(fmi3GetFloat64, (VARIABLES, fmi3Float64 values[], size_t n_values),
     slide_get(instance, &(SlideValues){vr, nvr, n_values, SLIDE_DOUBLES}, values, __func__))
CALL(fmi3SetFloat64, (VARIABLES, const fmi3Float64 values[], size_t n_values),
     slide_set(instance, &(SlideValues){vr, nvr, n_values, SLIDE_DOUBLES}, values, __func__))
CALL(fmi3GetBoolean, (VARIABLES, fmi3Boolean values[], size_t n_values),
     slide_get(instance, &(SlideValues){vr, nvr, n_values, SLIDE_BOOLS}, values, __func__))
CALL(fmi3SetBoolean, (VARIABLES, const fmi3Boolean values[], size_t n_values),
     slide_set(instance, &(SlideValues){vr, nvr, n_values, SLIDE_BOOLS}, values, __func__))

CALL(fmi3GetFMUState, (fmi3Instance instance, fmi3FMUState *state),
     slide_save(instance, state, __func__))
CALL(fmi3SetFMUState, (fmi3Instance instance, fmi3FMUState state),
     slide_restore(instance, state, __func__))
CALL(fmi3FreeFMUState, (fmi3Instance instance, fmi3FMUState *state),
     slide_free_state(instance, state, __func__))
CALL(fmi3SerializedFMUStateSize, (fmi3Instance instance, fmi3FMUState state, size_t *size),
     slide_serialized_size(instance, state, size, __func__))
CALL(fmi3SerializeFMUState,
     (fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size),
     slide_serialize(instance, state, bytes, size, __func__))
CALL(fmi3DeserializeFMUState,
     (fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state),
     slide_deserialize(instance, bytes, size, state, __func__))

#define NOT_OF_TYPE(Type)                                                                         \
    NO_SUCH_TYPE(fmi3Get##Type, (VARIABLES, fmi3##Type values[], size_t n_values))                \
    NO_SUCH_TYPE(fmi3Set##Type, (VARIABLES, const fmi3##Type values[], size_t n_values))

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
NO_SUCH_TYPE(fmi3GetBinary, (VARIABLES, size_t sizes[], fmi3Binary values[], size_t n_values))
NO_SUCH_TYPE(fmi3SetBinary,
             (VARIABLES, const size_t sizes[], const fmi3Binary values[], size_t n_values))
NO_SUCH_TYPE(fmi3GetClock, (VARIABLES, fmi3Clock values[]))
NO_SUCH_TYPE(fmi3SetClock, (VARIABLES, const fmi3Clock values[]))
NO_SUCH_TYPE(fmi3GetIntervalDecimal,
             (VARIABLES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]))
NO_SUCH_TYPE(fmi3GetIntervalFraction, (VARIABLES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                         fmi3IntervalQualifier qualifiers[]))
NO_SUCH_TYPE(fmi3GetShiftDecimal, (VARIABLES, fmi3Float64 shifts[]))
NO_SUCH_TYPE(fmi3GetShiftFraction, (VARIABLES, fmi3UInt64 counters[], fmi3UInt64 resolutions[]))
NO_SUCH_TYPE(fmi3SetIntervalDecimal, (VARIABLES, const fmi3Float64 intervals[]))
NO_SUCH_TYPE(fmi3SetIntervalFraction,
             (VARIABLES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))
NO_SUCH_TYPE(fmi3SetShiftDecimal, (VARIABLES, const fmi3Float64 shifts[]))
NO_SUCH_TYPE(fmi3SetShiftFraction,
             (VARIABLES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))

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
        (VARIABLES, const fmi3Int32 orders[], fmi3Float64 values[], size_t n_values),
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

#undef REFUSED
#undef NO_SUCH_TYPE
#undef VARIABLES
#undef NOT_OF_TYPE
#undef NO_EVENTS
#undef NO_PARAMETERS
#undef NO_ELEMENTS
#undef NO_EXCHANGE
#undef CALL
