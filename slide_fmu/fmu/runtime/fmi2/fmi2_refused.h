/* FMI 2.0: functions that this FMU exports, because importers look them up, but does not offer: a
 * table without include guard, which fmi2.h reads as declarations and fmi2_refused.c as
 * definitions. Each row has a function's name, its arguments as the standard has them, and why it is
 * refused; variables of a type that there is not are fine as long as none is asked for. */

#define NO_DERIVATIVES                                                                            \
    "derivatives of outputs with respect to time are not offered, as modelDescription.xml says"
#define NEVER_PENDING "steps end before fmi2DoStep returns; nothing is pending"
#define NO_EXCHANGE "this FMU is for co-simulation, not for model exchange"

NO_SUCH_TYPE(fmi2GetInteger, (fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                              fmi2Integer value[]))
NO_SUCH_TYPE(fmi2SetInteger, (fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                              const fmi2Integer value[]))
NO_SUCH_TYPE(fmi2GetString, (fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                             fmi2String value[]))
NO_SUCH_TYPE(fmi2SetString, (fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                             const fmi2String value[]))

REFUSED(fmi2GetRealOutputDerivatives,
        (fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
         fmi2Real value[]),
        NO_DERIVATIVES)
REFUSED(fmi2CancelStep, (fmi2Component c), NEVER_PENDING)
REFUSED(fmi2GetStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Status *value),
        NEVER_PENDING)
REFUSED(fmi2GetStringStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2String *value),
        NEVER_PENDING)
REFUSED(fmi2GetIntegerStatus, (fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value),
        "FMI 2.0 defines no status of type Integer")

REFUSED(fmi2EnterEventMode, (fmi2Component c), NO_EXCHANGE)
REFUSED(fmi2NewDiscreteStates, (fmi2Component c, fmi2EventInfo *info), NO_EXCHANGE)
REFUSED(fmi2EnterContinuousTimeMode, (fmi2Component c), NO_EXCHANGE)
REFUSED(fmi2CompletedIntegratorStep,
        (fmi2Component c, fmi2Boolean no_set_state, fmi2Boolean *enter_event_mode,
         fmi2Boolean *terminate),
        NO_EXCHANGE)
REFUSED(fmi2SetTime, (fmi2Component c, fmi2Real time), NO_EXCHANGE)
REFUSED(fmi2SetContinuousStates, (fmi2Component c, const fmi2Real x[], size_t nx), NO_EXCHANGE)
REFUSED(fmi2GetDerivatives, (fmi2Component c, fmi2Real derivatives[], size_t nx), NO_EXCHANGE)
REFUSED(fmi2GetEventIndicators, (fmi2Component c, fmi2Real indicators[], size_t ni), NO_EXCHANGE)
REFUSED(fmi2GetContinuousStates, (fmi2Component c, fmi2Real x[], size_t nx), NO_EXCHANGE)
REFUSED(fmi2GetNominalsOfContinuousStates, (fmi2Component c, fmi2Real nominals[], size_t nx),
        NO_EXCHANGE)

#undef NO_DERIVATIVES
#undef NEVER_PENDING
#undef NO_EXCHANGE
#undef NO_SUCH_TYPE
#undef REFUSED
