/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Co-simulation FMU of a force law, FMI 3.0 (https://fmi-standard.org). C99.
 *
 * palpate_model.h is written by palpate export. It defines the force law and PALPATE_FMU_TOKEN.
 * The input position is held until the next step. Force, slope and energy are those of this position.
 * fmi3DoStep moves the play operator of a hysteresis to this position.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "palpate_model.h"

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#ifndef fmi3Functions_h
/* Types of the standard, so that the file compiles without its headers. */
typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean;
typedef char fmi3Char;
typedef const fmi3Char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent,
    fmi3Constant,
    fmi3Fixed,
    fmi3Tunable,
    fmi3Discrete,
    fmi3Dependent
} fmi3DependencyKind;
typedef enum {
    fmi3IntervalNotYetKnown,
    fmi3IntervalUnchanged,
    fmi3IntervalChanged
} fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3LockPreemptionCallback)();
typedef void (*fmi3UnlockPreemptionCallback)();
#endif

#if defined(_WIN32)
#define FMU_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMU_EXPORT __attribute__((visibility("default")))
#else
#define FMU_EXPORT
#endif

/* Value references, as in modelDescription.xml. */
enum { TIME, POSITION, FORCE, SLOPE, ENERGY };

typedef enum { INSTANTIATED, INITIALIZATION, STEPPING, TERMINATED } Mode;

/* Everything that fmi3GetFMUState stores. */
typedef struct {
    palpate_model_state model;
    double position;
    double time;
    int32_t mode;
} State;

typedef struct {
    State state;
    bool logging;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} Instance;

static fmi3Status fail(const Instance *fmu, const char *message) {
    if (fmu->logging && fmu->log != NULL) {
        fmu->log(fmu->environment, fmi3Error, "error", message);
    }
    return fmi3Error;
}

static fmi3Status unsupported(fmi3Instance instance) {
    return fail((const Instance *)instance, "this FMU does not support the called function");
}

static bool is_finite(double value) { return value - value == 0.0; }

static void rest(State *state, double position) {
    memset(&state->model, 0, sizeof state->model);
    palpate_model_start_at(&state->model, position);
    state->position = position;
}

static void start(Instance *fmu) {
    memset(&fmu->state, 0, sizeof fmu->state);
    rest(&fmu->state, PALPATE_FMU_START);
    fmu->state.mode = INSTANTIATED;
}

/* ------------------------------------------------------------------------------------------------ life of an instance */

FMU_EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

FMU_EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                                          const fmi3String categories[]) {
    ((Instance *)instance)->logging = loggingOn;
    return fmi3OK;
}

FMU_EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible,
    fmi3Boolean loggingOn, fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
    const fmi3ValueReference requiredIntermediateVariables[], size_t nRequiredIntermediateVariables,
    fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3IntermediateUpdateCallback intermediateUpdate) {
    Instance *fmu;
    if (instantiationToken == NULL || strcmp(instantiationToken, PALPATE_FMU_TOKEN) != 0) {
        if (logMessage != NULL) {
            logMessage(instanceEnvironment, fmi3Error, "error", "the instantiation token is that of another FMU");
        }
        return NULL;
    }
    fmu = (Instance *)calloc(1, sizeof *fmu);
    if (fmu != NULL) {
        fmu->logging = loggingOn;
        fmu->environment = instanceEnvironment;
        fmu->log = logMessage;
        start(fmu);
    }
    return fmu;
}

FMU_EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                                     fmi3String resourcePath, fmi3Boolean visible,
                                                     fmi3Boolean loggingOn,
                                                     fmi3InstanceEnvironment instanceEnvironment,
                                                     fmi3LogMessageCallback logMessage) {
    return NULL;
}

FMU_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible,
    fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption,
    fmi3UnlockPreemptionCallback unlockPreemption) {
    return NULL;
}

FMU_EXPORT void fmi3FreeInstance(fmi3Instance instance) { free(instance); }

FMU_EXPORT fmi3Status fmi3Reset(fmi3Instance instance) {
    start((Instance *)instance);
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined,
                                                  fmi3Float64 tolerance, fmi3Float64 startTime,
                                                  fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    Instance *fmu = (Instance *)instance;
    if (fmu->state.mode != INSTANTIATED) {
        return fail(fmu, "fmi3EnterInitializationMode was called twice");
    }
    fmu->state.time = startTime;
    fmu->state.mode = INITIALIZATION;
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    Instance *fmu = (Instance *)instance;
    if (fmu->state.mode != INITIALIZATION) {
        return fail(fmu, "fmi3ExitInitializationMode was called outside the initialization mode");
    }
    fmu->state.mode = STEPPING;
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3Terminate(fmi3Instance instance) {
    ((Instance *)instance)->state.mode = TERMINATED;
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                                 fmi3Float64 communicationStepSize, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                 fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                                 fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    Instance *fmu = (Instance *)instance;
    State *state = &fmu->state;
    if (state->mode != STEPPING) {
        return fail(fmu, "fmi3DoStep was called before the end of the initialization or after fmi3Terminate");
    }
    if (!(communicationStepSize >= 0.0)) {
        return fail(fmu, "the step size must be >= 0");
    }
    palpate_model_advance_at(&state->model, state->position);
    state->time = currentCommunicationPoint + communicationStepSize;
    *eventHandlingNeeded = false;
    *terminateSimulation = false;
    *earlyReturn = false;
    *lastSuccessfulTime = state->time;
    return fmi3OK;
}

/* ---------------------------------------------------------------------------------------------------------- variables */

FMU_EXPORT fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                     size_t nValueReferences, fmi3Float64 values[], size_t nValues) {
    const Instance *fmu = (const Instance *)instance;
    const State *state = &fmu->state;
    size_t k;
    double slope;
    if (nValues != nValueReferences) {
        return fail(fmu, "nValues must be nValueReferences, because all variables are scalars");
    }
    for (k = 0; k < nValueReferences; ++k) {
        switch (valueReferences[k]) {
            case TIME:
                values[k] = state->time;
                break;
            case POSITION:
                values[k] = state->position;
                break;
            case FORCE:
                values[k] = palpate_model_force_at(&state->model, state->position);
                break;
            case SLOPE:
                (void)palpate_model_force_slope_at(&state->model, state->position, &slope);
                values[k] = slope;
                break;
            case ENERGY:
                values[k] = palpate_model_energy_at(&state->model, state->position);
                break;
            default:
                return fail(fmu, "there is no Float64 variable with this value reference");
        }
    }
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                     size_t nValueReferences, const fmi3Float64 values[], size_t nValues) {
    Instance *fmu = (Instance *)instance;
    size_t k;
    for (k = 0; k < nValueReferences; ++k) {
        if (valueReferences[k] != POSITION || nValues != nValueReferences) {
            return fail(fmu, "only the input position can be set");
        }
        if (!is_finite(values[k])) {
            return fail(fmu, "position must be a finite number");
        }
        if (fmu->state.mode == STEPPING) {
            fmu->state.position = values[k];
        } else {
            rest(&fmu->state, values[k]); /* the simulation begins with the object at rest at this position */
        }
    }
    return fmi3OK;
}

static fmi3Status wrong_variable(const Instance *fmu, fmi3ValueReference only) {
    return fail(fmu, only == POSITION ? "the only known of a derivative is the input position"
                                      : "the only unknown of a derivative is the output force");
}

/* The force has one input and one output, so both derivatives multiply the sum of the seeds by the slope. Each seed
 * belongs to a variable `from`, each product to a variable `to`. */
static fmi3Status times_slope(const Instance *fmu, const fmi3ValueReference from[], size_t n_from,
                              fmi3ValueReference only_from, const fmi3ValueReference to[], size_t n_to,
                              const fmi3Float64 seed[], fmi3Float64 product[]) {
    const fmi3ValueReference only_to = only_from == POSITION ? FORCE : POSITION;
    double change = 0.0;
    double slope;
    size_t k;
    for (k = 0; k < n_from; ++k) {
        if (from[k] != only_from) {
            return wrong_variable(fmu, only_from);
        }
        change += seed[k];
    }
    (void)palpate_model_force_slope_at(&fmu->state.model, fmu->state.position, &slope);
    for (k = 0; k < n_to; ++k) {
        if (to[k] != only_to) {
            return wrong_variable(fmu, only_to);
        }
        product[k] = slope * change;
    }
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                                   size_t nUnknowns, const fmi3ValueReference knowns[],
                                                   size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
                                                   fmi3Float64 sensitivity[], size_t nSensitivity) {
    const Instance *fmu = (const Instance *)instance;
    if (nSeed != nKnowns || nSensitivity != nUnknowns) {
        return fail(fmu, "there must be one seed for each known and one sensitivity for each unknown");
    }
    return times_slope(fmu, knowns, nKnowns, POSITION, unknowns, nUnknowns, seed, sensitivity);
}

FMU_EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                               size_t nUnknowns, const fmi3ValueReference knowns[],
                                               size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
                                               fmi3Float64 sensitivity[], size_t nSensitivity) {
    const Instance *fmu = (const Instance *)instance;
    if (nSeed != nUnknowns || nSensitivity != nKnowns) {
        return fail(fmu, "there must be one seed for each unknown and one sensitivity for each known");
    }
    return times_slope(fmu, unknowns, nUnknowns, FORCE, knowns, nKnowns, seed, sensitivity);
}

/* ------------------------------------------------------------------------------------------------------------- states */

FMU_EXPORT fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    if (*FMUState == NULL) {
        *FMUState = calloc(1, sizeof(State));
        if (*FMUState == NULL) {
            return fail((const Instance *)instance, "there is no memory for the state");
        }
    }
    memcpy(*FMUState, &((const Instance *)instance)->state, sizeof(State));
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    memcpy(&((Instance *)instance)->state, FMUState, sizeof(State));
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    free(*FMUState);
    *FMUState = NULL;
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    *size = sizeof(State);
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState,
                                            fmi3Byte serializedState[], size_t size) {
    if (size < sizeof(State)) {
        return fail((const Instance *)instance, "the memory for the serialized state is too small");
    }
    memcpy(serializedState, FMUState, sizeof(State));
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                              fmi3FMUState *FMUState) {
    if (size != sizeof(State)) {
        return fail((const Instance *)instance, "the serialized state has another size than the states of this FMU");
    }
    if (*FMUState == NULL) {
        *FMUState = calloc(1, sizeof(State));
        if (*FMUState == NULL) {
            return fail((const Instance *)instance, "there is no memory for the state");
        }
    }
    memcpy(*FMUState, serializedState, sizeof(State));
    return fmi3OK;
}

/* ---------------------------------------------------------------------- functions that the FMU does not support */

#define NO_VARIABLES(type)                                                                                     \
    FMU_EXPORT fmi3Status fmi3Get##type(fmi3Instance instance, const fmi3ValueReference valueReferences[],     \
                                        size_t nValueReferences, fmi3##type values[], size_t nValues) {        \
        return nValueReferences == 0 ? fmi3OK : unsupported(instance);                                         \
    }                                                                                                          \
    FMU_EXPORT fmi3Status fmi3Set##type(fmi3Instance instance, const fmi3ValueReference valueReferences[],     \
                                        size_t nValueReferences, const fmi3##type values[], size_t nValues) {  \
        return nValueReferences == 0 ? fmi3OK : unsupported(instance);                                         \
    }

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

#define NOT_SUPPORTED(name, ...) \
    FMU_EXPORT fmi3Status name(fmi3Instance instance, __VA_ARGS__) { return unsupported(instance); }
#define NOT_SUPPORTED_WITHOUT_ARGUMENTS(name) \
    FMU_EXPORT fmi3Status name(fmi3Instance instance) { return unsupported(instance); }
#define REFERENCES const fmi3ValueReference valueReferences[], size_t nValueReferences

NOT_SUPPORTED(fmi3GetBinary, REFERENCES, size_t valueSizes[], fmi3Binary values[], size_t nValues)
NOT_SUPPORTED(fmi3SetBinary, REFERENCES, const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
NOT_SUPPORTED(fmi3GetClock, REFERENCES, fmi3Clock values[])
NOT_SUPPORTED(fmi3SetClock, REFERENCES, const fmi3Clock values[])
NOT_SUPPORTED(fmi3GetNumberOfVariableDependencies, fmi3ValueReference valueReference, size_t *nDependencies)
NOT_SUPPORTED(fmi3GetVariableDependencies, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
              fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
              fmi3DependencyKind dependencyKinds[], size_t nDependencies)
NOT_SUPPORTED(fmi3GetIntervalDecimal, REFERENCES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
NOT_SUPPORTED(fmi3GetIntervalFraction, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
              fmi3IntervalQualifier qualifiers[])
NOT_SUPPORTED(fmi3GetShiftDecimal, REFERENCES, fmi3Float64 shifts[])
NOT_SUPPORTED(fmi3GetShiftFraction, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
NOT_SUPPORTED(fmi3SetIntervalDecimal, REFERENCES, const fmi3Float64 intervals[])
NOT_SUPPORTED(fmi3SetIntervalFraction, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
NOT_SUPPORTED(fmi3SetShiftDecimal, REFERENCES, const fmi3Float64 shifts[])
NOT_SUPPORTED(fmi3SetShiftFraction, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
NOT_SUPPORTED(fmi3UpdateDiscreteStates, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
              fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
              fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime)
NOT_SUPPORTED(fmi3CompletedIntegratorStep, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
              fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
NOT_SUPPORTED(fmi3SetTime, fmi3Float64 time)
NOT_SUPPORTED(fmi3SetContinuousStates, const fmi3Float64 continuousStates[], size_t nContinuousStates)
NOT_SUPPORTED(fmi3GetContinuousStateDerivatives, fmi3Float64 derivatives[], size_t nContinuousStates)
NOT_SUPPORTED(fmi3GetEventIndicators, fmi3Float64 eventIndicators[], size_t nEventIndicators)
NOT_SUPPORTED(fmi3GetContinuousStates, fmi3Float64 continuousStates[], size_t nContinuousStates)
NOT_SUPPORTED(fmi3GetNominalsOfContinuousStates, fmi3Float64 nominals[], size_t nContinuousStates)
NOT_SUPPORTED(fmi3GetNumberOfEventIndicators, size_t *nEventIndicators)
NOT_SUPPORTED(fmi3GetNumberOfContinuousStates, size_t *nContinuousStates)
NOT_SUPPORTED(fmi3GetOutputDerivatives, REFERENCES, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
NOT_SUPPORTED(fmi3ActivateModelPartition, fmi3ValueReference clockReference, fmi3Float64 activationTime)
NOT_SUPPORTED_WITHOUT_ARGUMENTS(fmi3EnterEventMode)
NOT_SUPPORTED_WITHOUT_ARGUMENTS(fmi3EnterConfigurationMode)
NOT_SUPPORTED_WITHOUT_ARGUMENTS(fmi3ExitConfigurationMode)
NOT_SUPPORTED_WITHOUT_ARGUMENTS(fmi3EvaluateDiscreteStates)
NOT_SUPPORTED_WITHOUT_ARGUMENTS(fmi3EnterContinuousTimeMode)
NOT_SUPPORTED_WITHOUT_ARGUMENTS(fmi3EnterStepMode)
