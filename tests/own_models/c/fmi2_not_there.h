/* What an FMU 2.0 of these tests has not: functions that the standard asks for, and that fail. */
#define NOT_THERE(name, ...) fmi2Status name(__VA_ARGS__) { return fmi2Error; }
NOT_THERE(fmi2GetInteger, fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Integer v[])
NOT_THERE(fmi2GetBoolean, fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Boolean v[])
NOT_THERE(fmi2GetString, fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String v[])
NOT_THERE(fmi2SetInteger, fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer v[])
NOT_THERE(fmi2SetBoolean, fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Boolean v[])
NOT_THERE(fmi2SetString, fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String v[])
#ifndef STATES
NOT_THERE(fmi2GetFMUstate, fmi2Component c, fmi2FMUstate *s)
NOT_THERE(fmi2SetFMUstate, fmi2Component c, fmi2FMUstate s)
NOT_THERE(fmi2FreeFMUstate, fmi2Component c, fmi2FMUstate *s)
#endif
NOT_THERE(fmi2SerializedFMUstateSize, fmi2Component c, fmi2FMUstate s, size_t *n)
NOT_THERE(fmi2SerializeFMUstate, fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n)
NOT_THERE(fmi2DeSerializeFMUstate, fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
NOT_THERE(fmi2GetRealOutputDerivatives, fmi2Component c, const fmi2ValueReference r[], size_t n,
          const fmi2Integer o[], fmi2Real v[])
NOT_THERE(fmi2CancelStep, fmi2Component c)
NOT_THERE(fmi2GetStatus, fmi2Component c, const fmi2StatusKind k, fmi2Status *v)
NOT_THERE(fmi2GetRealStatus, fmi2Component c, const fmi2StatusKind k, fmi2Real *v)
NOT_THERE(fmi2GetIntegerStatus, fmi2Component c, const fmi2StatusKind k, fmi2Integer *v)
NOT_THERE(fmi2GetBooleanStatus, fmi2Component c, const fmi2StatusKind k, fmi2Boolean *v)
NOT_THERE(fmi2GetStringStatus, fmi2Component c, const fmi2StatusKind k, fmi2String *v)
