"""The functions of FMI 3.0 (co-simulation) around an exported C source, as one more C source.

It is written against the standard's own headers where an importer has them in its path, and brings the few declarations
that it needs otherwise, so that the sources compile by themselves.
"""

from __future__ import annotations

from identify.export.exported_model import ExportedModel

SOURCE = """/* FMI 3.0 co-simulation of {prefix}.c. Inputs set before a step are taken to hold at its end; torque is that of
 * {what_torque}, states follow the positions from step to step. */
#include "{prefix}.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(__has_include)
#if __has_include("fmi3Functions.h")
#include "fmi3Functions.h"
#define FMI3_HEADERS
#endif
#endif

#ifndef FMI3_HEADERS
typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8, fmi3Byte;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef const fmi3Byte *fmi3Binary;
typedef enum {{ fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal }} fmi3Status;
typedef enum {{ fmi3DependencyKindFirst, fmi3DependencyKindLast = 5 }} fmi3DependencyKind;
typedef enum {{ fmi3IntervalQualifierFirst, fmi3IntervalQualifierLast = 2 }} fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);
#endif

#if defined(_WIN32)
#define SHOWN __declspec(dllexport)
#elif defined(__GNUC__)
#define SHOWN __attribute__((visibility("default")))
#else
#define SHOWN
#endif

#define JOINTS {PREFIX}_JOINTS
#define MEMORIES {PREFIX}_MEMORIES

/* value references: the time, the inputs, the payload's parameters, the outputs, the states */
enum {{
    TIME = 0,
    Q = 1,
    DQ = Q + JOINTS,
    DDQ = DQ + JOINTS,
    TEMPERATURE = DDQ + JOINTS,
    PAYLOAD = TEMPERATURE + JOINTS,
    TORQUE = PAYLOAD + 10,
    STATES = TORQUE + JOINTS,
    END = STATES + MEMORIES
}};

{state}
typedef struct {{
    State state;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
}} Instance;

static const char TOKEN[] = "{token}";

static fmi3Status failed(fmi3Instance instance, const char *message) {{
    const Instance *own = instance;
    if (own != NULL && own->log != NULL) own->log(own->environment, fmi3Error, "logStatusError", message);
    return fmi3Error;
}}

static void begin(State *state) {{
    memset(state, 0, sizeof *state);
    for (int joint = 0; joint < JOINTS; joint++) state->values[TEMPERATURE + joint] = 20.0;
}}

{follows}
SHOWN const char *fmi3GetVersion(void) {{ return "3.0"; }}

SHOWN fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
    fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3IntermediateUpdateCallback intermediateUpdate) {{
    (void)instanceName, (void)resourcePath, (void)visible, (void)loggingOn, (void)eventModeUsed, (void)earlyReturnAllowed;
    (void)requiredIntermediateVariables, (void)nRequiredIntermediateVariables, (void)intermediateUpdate;
    if (instantiationToken == NULL || strcmp(instantiationToken, TOKEN) != 0) {{
        if (logMessage != NULL)
            logMessage(instanceEnvironment, fmi3Error, "logStatusError", "the instantiation token is not this model's");
        return NULL;
    }}
    Instance *own = calloc(1, sizeof *own);
    if (own == NULL) return NULL;
    own->environment = instanceEnvironment;
    own->log = logMessage;
    begin(&own->state);
    return own;
}}

SHOWN void fmi3FreeInstance(fmi3Instance instance) {{ free(instance); }}

SHOWN fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                             fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {{
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    ((Instance *)instance)->state.time = startTime;
    return fmi3OK;
}}

SHOWN fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {{
    keep(&((Instance *)instance)->state, 0.0);
    return fmi3OK;
}}

SHOWN fmi3Status fmi3Reset(fmi3Instance instance) {{
    begin(&((Instance *)instance)->state);
    return fmi3OK;
}}

SHOWN fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                const fmi3Float64 values[], size_t nValues) {{
    State *state = &((Instance *)instance)->state;
    if (nValues != nValueReferences) return failed(instance, "one value for each value reference is wanted");
    for (size_t i = 0; i < nValues; i++) {{
        if (valueReferences[i] < Q || valueReferences[i] >= TORQUE)
            return failed(instance, "this value reference cannot be set");
        if (!isfinite(values[i])) return failed(instance, "a value is not finite");
    }}
    for (size_t i = 0; i < nValues; i++) state->values[valueReferences[i]] = values[i];
    return fmi3OK;
}}

SHOWN fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                fmi3Float64 values[], size_t nValues) {{
    const State *state = &((Instance *)instance)->state;
    double torque[JOINTS], states[MEMORIES + 1];
    int computed = 0;
    if (nValues != nValueReferences) return failed(instance, "one value for each value reference is wanted");
    for (size_t i = 0; i < nValues; i++) {{
        const fmi3ValueReference reference = valueReferences[i];
        if (reference >= END) return failed(instance, "there is no such value reference");
        if (reference >= TORQUE && !computed) {{
            torque_now(state, states, torque);
            computed = 1;
        }}
        values[i] = reference == TIME ? state->time : reference < TORQUE ? state->values[reference]
            : reference < STATES ? torque[reference - TORQUE] : states[reference - STATES];
    }}
    return fmi3OK;
}}

SHOWN fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                            fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                            fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {{
    State *state = &((Instance *)instance)->state;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!(communicationStepSize > 0.0)) return failed(instance, "a step must be longer than zero");
    state->time = currentCommunicationPoint + communicationStepSize;
    keep(state, communicationStepSize);
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = false;
    *lastSuccessfulTime = state->time;
    return fmi3OK;
}}

SHOWN fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {{
    if (*FMUState == NULL) *FMUState = malloc(sizeof(State));
    if (*FMUState == NULL) return failed(instance, "there is no memory left");
    memcpy(*FMUState, &((Instance *)instance)->state, sizeof(State));
    return fmi3OK;
}}

SHOWN fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {{
    memcpy(&((Instance *)instance)->state, FMUState, sizeof(State));
    return fmi3OK;
}}

SHOWN fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {{
    (void)instance;
    free(*FMUState);
    *FMUState = NULL;
    return fmi3OK;
}}

SHOWN fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {{
    (void)instance, (void)FMUState;
    *size = sizeof(State);
    return fmi3OK;
}}

SHOWN fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size) {{
    if (size != sizeof(State)) return failed(instance, "the serialized state has another size");
    memcpy(serializedState, FMUState, size);
    return fmi3OK;
}}

SHOWN fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                         fmi3FMUState *FMUState) {{
    if (size != sizeof(State)) return failed(instance, "the serialized state has another size");
    if (*FMUState == NULL) *FMUState = malloc(sizeof(State));
    if (*FMUState == NULL) return failed(instance, "there is no memory left");
    memcpy(*FMUState, serializedState, size);
    return fmi3OK;
}}

SHOWN fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                                     const fmi3String categories[]) {{
    (void)instance, (void)loggingOn, (void)nCategories, (void)categories;
    return fmi3OK;
}}

#define PASSED(name) \\
    SHOWN fmi3Status name(fmi3Instance instance) {{ \\
        (void)instance; \\
        return fmi3OK; \\
    }}
PASSED(fmi3EnterStepMode)
PASSED(fmi3Terminate)

/* What the standard has beyond this model; modelDescription.xml says so, and an importer does not call it. */
#define ABSENT(name, ...) \\
    SHOWN fmi3Status name(fmi3Instance instance, __VA_ARGS__) {{ return failed(instance, #name ": this model has none"); }}
#define ABSENT_MODE(name) \\
    SHOWN fmi3Status name(fmi3Instance instance) {{ return failed(instance, #name ": this model has none"); }}
#define ABSENT_TYPE(kind) \\
    ABSENT(fmi3Get##kind, const fmi3ValueReference r[], size_t n, fmi3##kind v[], size_t m) \\
    ABSENT(fmi3Set##kind, const fmi3ValueReference r[], size_t n, const fmi3##kind v[], size_t m)
#define REFERENCES const fmi3ValueReference r[], size_t n
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
ABSENT_TYPE(Float32)
ABSENT_TYPE(Int8)
ABSENT_TYPE(UInt8)
ABSENT_TYPE(Int16)
ABSENT_TYPE(UInt16)
ABSENT_TYPE(Int32)
ABSENT_TYPE(UInt32)
ABSENT_TYPE(Int64)
ABSENT_TYPE(UInt64)
ABSENT_TYPE(Boolean)
ABSENT_TYPE(String)
ABSENT(fmi3GetBinary, REFERENCES, size_t s[], fmi3Binary v[], size_t m)
ABSENT(fmi3SetBinary, REFERENCES, const size_t s[], const fmi3Binary v[], size_t m)
ABSENT(fmi3GetClock, REFERENCES, fmi3Clock v[])
ABSENT(fmi3SetClock, REFERENCES, const fmi3Clock v[])
ABSENT(fmi3GetNumberOfVariableDependencies, fmi3ValueReference r, size_t *n)
ABSENT(fmi3GetVariableDependencies, fmi3ValueReference r, size_t d[], fmi3ValueReference i[], size_t e[],
       fmi3DependencyKind k[], size_t n)
ABSENT(fmi3GetDirectionalDerivative, REFERENCES, const fmi3ValueReference k[], size_t nk, const fmi3Float64 s[], size_t ns,
       fmi3Float64 v[], size_t m)
ABSENT(fmi3GetAdjointDerivative, REFERENCES, const fmi3ValueReference k[], size_t nk, const fmi3Float64 s[], size_t ns,
       fmi3Float64 v[], size_t m)
ABSENT_MODE(fmi3EnterConfigurationMode)
ABSENT_MODE(fmi3ExitConfigurationMode)
ABSENT_MODE(fmi3EnterEventMode)
ABSENT_MODE(fmi3EvaluateDiscreteStates)
ABSENT_MODE(fmi3EnterContinuousTimeMode)
ABSENT(fmi3GetIntervalDecimal, REFERENCES, fmi3Float64 v[], fmi3IntervalQualifier q[])
ABSENT(fmi3GetIntervalFraction, REFERENCES, fmi3UInt64 c[], fmi3UInt64 v[], fmi3IntervalQualifier q[])
ABSENT(fmi3GetShiftDecimal, REFERENCES, fmi3Float64 v[])
ABSENT(fmi3GetShiftFraction, REFERENCES, fmi3UInt64 c[], fmi3UInt64 v[])
ABSENT(fmi3SetIntervalDecimal, REFERENCES, const fmi3Float64 v[])
ABSENT(fmi3SetIntervalFraction, REFERENCES, const fmi3UInt64 c[], const fmi3UInt64 v[])
ABSENT(fmi3SetShiftDecimal, REFERENCES, const fmi3Float64 v[])
ABSENT(fmi3SetShiftFraction, REFERENCES, const fmi3UInt64 c[], const fmi3UInt64 v[])
ABSENT(fmi3UpdateDiscreteStates, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *c, fmi3Boolean *d, fmi3Boolean *e, fmi3Float64 *t)
ABSENT(fmi3CompletedIntegratorStep, fmi3Boolean a, fmi3Boolean *b, fmi3Boolean *c)
ABSENT(fmi3SetTime, fmi3Float64 t)
ABSENT(fmi3SetContinuousStates, const fmi3Float64 v[], size_t n)
ABSENT(fmi3GetContinuousStateDerivatives, fmi3Float64 v[], size_t n)
ABSENT(fmi3GetEventIndicators, fmi3Float64 v[], size_t n)
ABSENT(fmi3GetContinuousStates, fmi3Float64 v[], size_t n)
ABSENT(fmi3GetNominalsOfContinuousStates, fmi3Float64 v[], size_t n)
ABSENT(fmi3GetNumberOfEventIndicators, size_t *n)
ABSENT(fmi3GetNumberOfContinuousStates, size_t *n)
ABSENT(fmi3GetOutputDerivatives, REFERENCES, const fmi3Int32 o[], fmi3Float64 v[], size_t m)
ABSENT(fmi3ActivateModelPartition, fmi3ValueReference r, fmi3Float64 t)

SHOWN fmi3Instance fmi3InstantiateModelExchange(fmi3String a, fmi3String b, fmi3String c, fmi3Boolean d, fmi3Boolean e,
                                                fmi3InstanceEnvironment f, fmi3LogMessageCallback g) {{
    return NULL;
}}

SHOWN fmi3Instance fmi3InstantiateScheduledExecution(fmi3String a, fmi3String b, fmi3String c, fmi3Boolean d, fmi3Boolean e,
                                                     fmi3InstanceEnvironment f, fmi3LogMessageCallback g,
                                                     fmi3ClockUpdateCallback h, fmi3LockPreemptionCallback i,
                                                     fmi3UnlockPreemptionCallback j) {{
    return NULL;
}}
"""

AT_ONCE = """typedef struct {{
    double time;
    double values[TORQUE]; /* by value reference; [0] is not used */
    double before[JOINTS]; /* positions where the states stand */
    double states[MEMORIES + 1];
    int begun; /* whether they do */
}} State;
"""
FOLLOWS_AT_ONCE = """/* The states of presliding for the inputs as they stand. */
static void states_now(const State *state, double states[MEMORIES + 1]) {{
    memcpy(states, state->states, sizeof state->states);
    if (state->begun)
        {prefix}_memory_after(states, state->before, state->values + Q);
    else
        {prefix}_memory_at_start(state->values + DQ, states);
}}

static void torque_now(const State *state, double states[MEMORIES + 1], double torque[JOINTS]) {{
    const double *own = state->values;
    states_now(state, states);
    {prefix}_torque(own + Q, own + DQ, own + DDQ, state->time, own + TEMPERATURE, states, own + PAYLOAD, torque);
}}

static void keep(State *state, double step) {{
    double states[MEMORIES + 1];
    (void)step;
    states_now(state, states);
    memcpy(state->states, states, sizeof states);
    memcpy(state->before, state->values + Q, sizeof state->before);
    state->begun = 1;
}}
"""
IN_CYCLES = """typedef struct {{
    double time;
    double values[TORQUE]; /* by value reference; [0] is not used */
    double step; /* that ended at `time` */
    {prefix}_cycles before, kept; /* before and after the motion at `time` */
}} State;
"""
FOLLOWS_IN_CYCLES = """/* What is kept after the motion of the inputs as they stand, and the torque that is known then. */
static void cycles_now(const State *state, {prefix}_cycles *cycles, double torque[JOINTS]) {{
    const double *own = state->values;
    *cycles = state->before;
    {prefix}_step(cycles, own + Q, own + DQ, own + DDQ, state->step, state->time, own + TEMPERATURE, own + PAYLOAD, torque);
}}

static void torque_now(const State *state, double states[MEMORIES + 1], double torque[JOINTS]) {{
    {prefix}_cycles cycles;
    cycles_now(state, &cycles, torque);
    for (int i = 0; i < MEMORIES; i++) states[i] = cycles.given[sizeof cycles.given / sizeof *cycles.given - 1].state[i];
}}

/* The motion at a new time; with the step before behind it. */
static void keep(State *state, double step) {{
    double torque[JOINTS];
    state->step = step;
    if (step > 0.0) state->before = state->kept;
    cycles_now(state, &state->kept, torque);
}}
"""


def fmi_source(prefix: str, token: str, latency: int = 0) -> str:
    """The text of the source.

    prefix : of the functions of the exported C source, and its file name without ending
    token  : the instantiation token of modelDescription.xml
    latency : steps by which the torque stands behind the inputs
    """
    state, follows = (IN_CYCLES, FOLLOWS_IN_CYCLES) if latency else (AT_ONCE, FOLLOWS_AT_ONCE)
    return SOURCE.format(
        prefix=prefix,
        PREFIX=prefix.upper(),
        token=token,
        what_torque=f"the motion {latency} steps before" if latency else "the inputs as they stand",
        state=state.format(prefix=prefix),
        follows=follows.format(prefix=prefix),
    )


class ValueReferences:
    """The value references of a model's variables, as the source above counts them."""

    def __init__(self, model: ExportedModel):
        n = model.joints
        self.q = range(1, 1 + n)
        self.dq = range(self.q.stop, self.q.stop + n)
        self.ddq = range(self.dq.stop, self.dq.stop + n)
        self.temperature = range(self.ddq.stop, self.ddq.stop + n)
        self.payload = range(self.temperature.stop, self.temperature.stop + 10)
        self.torque = range(self.payload.stop, self.payload.stop + n)
        self.states = range(self.torque.stop, self.torque.stop + len(model.memories))

    @property
    def inputs(self) -> range:
        """Of q, dq, ddq and temperature, one behind the other."""
        return range(self.q.start, self.temperature.stop)
