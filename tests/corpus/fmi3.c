/* The FMU of fmu.c, with its defects, in FMI 3.0: what fmi3Functions.h asks for over what fmi2Functions.h does.
 *
 * Value references are one list in FMI 3.0: Reals keep theirs, Integers have 20 more, Booleans 30, Strings 40. Beside them
 * there are an array that a structural parameter sizes, an array output, a 32-bit number, and bytes. Defects of FMI 3.0
 * alone are macros DEFECT3_<name>.
 *
 * Compile: cc -shared -fPIC -DDEFECT=<name> -o corpus.so fmi3.c -lm */
#include "fmu.c"
#include <stdbool.h>

typedef void (*LogMessage)(void *, Status, const char *, const char *);

typedef struct {
    Component two;
    LogMessage message;
    void *environment;
    bool event_used, early_allowed, event, configuring;
} Three;

/* The array parameter is a part of the state, with all the rest. */
#define ARRAY(t) (((Instance *)(t)->two)->values.A)

#define TWO(c) ((c) ? ((Three *)(c))->two : NULL)

static void log_three(void *environment, const char *name, int status, const char *category, const char *format, ...) {
    Three *t = environment;
    char text[512];
    va_list arguments;
    (void)name;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (t->message) t->message(t->environment, status, category, text);
}
static void *take(size_t count, size_t size) { return calloc(count, size); }
static const Callbacks TEMPLATE = {log_three, take, free, NULL, NULL};

static void unit(Three *t) { ARRAY(t)[0] = ARRAY(t)[3] = 1, ARRAY(t)[1] = ARRAY(t)[2] = 0; }

/* As the URI that fmu.c takes: without the separator at the end, blanks and letters beyond ASCII encoded. */
static void uri(const char *path, char *out, size_t room) {
    size_t n = (size_t)snprintf(out, room, "file://");
    size_t length = strlen(path);
    if (length && path[length - 1] == '/') length--;
    for (size_t k = 0; k < length && n + 4 < room; k++) {
        unsigned char byte = (unsigned char)path[k];
        if (byte == ' ' || byte > 126) n += (size_t)snprintf(out + n, room - n, "%%%02X", byte);
        else out[n++] = (char)byte;
    }
    out[n] = 0;
}

EXPORT const char *fmi3GetVersion(void) { return IS(VERSION) ? "3.0.1" : "3.0"; }

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                         bool logging, bool event_used, bool early_allowed, const uint32_t required[],
                                         size_t count, void *environment, LogMessage message, void *update) {
    (void)required, (void)count, (void)update;
    Three *t = calloc(1, sizeof *t);
    char place[8192];
    uri(resources ? resources : "", place, sizeof place);
    t->message = message;
    t->environment = environment;
    t->event_used = event_used;
    t->early_allowed = early_allowed;
    Callbacks callbacks = TEMPLATE;
    callbacks.environment = t;
    t->two = fmi2Instantiate(name, 1, token, place, &callbacks, visible, logging);
    if (!t->two) {
        free(t);
        return NULL;
    }
    unit(t);
    return t;
}

EXPORT void fmi3FreeInstance(void *c) {
    fmi2FreeInstance(TWO(c));
    free(c);
}

EXPORT Status fmi3SetDebugLogging(void *c, bool on, size_t count, const char *const categories[]) {
    return fmi2SetDebugLogging(TWO(c), on, count, categories);
}

EXPORT Status fmi3EnterInitializationMode(void *c, bool has_tolerance, double tolerance, double begin, bool has_stop,
                                          double stop) {
    Instance *i = TWO(c);
    if (IS(INIT_ORDER) && i && i->values.phase != INSTANTIATED) return OK;
    if (c && ((Three *)c)->configuring) return ERROR;
    Status status = fmi2SetupExperiment(i, has_tolerance, tolerance, begin, has_stop, stop);
    return status ? status : fmi2EnterInitializationMode(i);
}

EXPORT Status fmi3ExitInitializationMode(void *c) {
    Three *t = c;
    Status status = fmi2ExitInitializationMode(TWO(c));
    if (!status && t->event_used) t->event = true;
    return status;
}

EXPORT Status fmi3EnterEventMode(void *c) {
    Three *t = c;
    Instance *i = TWO(c);
    if (!t || !t->event_used || t->event || i->values.phase != STEPPING) return ERROR;
#if DEFECT3_EVENT_MODE
    return fail(i, "no event mode");
#endif
    t->event = true;
    return OK;
}

EXPORT Status fmi3UpdateDiscreteStates(void *c, bool *again, bool *terminate, bool *nominals, bool *states, bool *next,
                                       double *time) {
    Three *t = c;
    if (!t || !t->event) return ERROR;
    *again = *terminate = *nominals = *states = *next = false;
    *time = 0;
#if DEFECT3_EVENT_ENDLESS
    *again = true;
#endif
    return OK;
}

EXPORT Status fmi3EnterStepMode(void *c) {
    Three *t = c;
    if (!t || !t->event) return ERROR;
    t->event = false;
    return OK;
}

EXPORT Status fmi3EnterConfigurationMode(void *c) {
    Three *t = c;
    Instance *i = TWO(c);
    if (!t || i->values.phase != INSTANTIATED) return ERROR;
#if DEFECT3_CONFIGURATION
    return fail(i, "no configuration mode");
#endif
    t->configuring = true;
    return OK;
}
EXPORT Status fmi3ExitConfigurationMode(void *c) {
    Three *t = c;
    if (!t || !t->configuring) return ERROR;
    t->configuring = false;
    return OK;
}
EXPORT Status fmi3EvaluateDiscreteStates(void *c) { return c && ((Three *)c)->event ? OK : ERROR; }

EXPORT Status fmi3Terminate(void *c) { return fmi2Terminate(TWO(c)); }

#if !DEFECT_SYMBOL_MISSING
EXPORT Status fmi3Reset(void *c) {
    Three *t = c;
    Status status = fmi2Reset(TWO(c));
    if (!status) {
        unit(t);
        t->event = t->configuring = false;
    }
    return status;
}
#endif

EXPORT Status fmi3DoStep(void *c, double point, double step, bool no_set_prior, bool *event, bool *terminate, bool *early,
                         double *last) {
    Three *t = c;
    if (t && t->event) return ERROR;
    double span = step, mark = 0.0525;
    bool cut = t && t->early_allowed && point < mark - 1e-9 && point + step > mark + 1e-9;
    if (cut) span = mark - point;
    Status status = fmi2DoStep(TWO(c), point, span, no_set_prior);
    *event = cut && t->event_used;
    *terminate = false;
    *early = cut;
    *last = point + span;
#if DEFECT3_EARLY_FORBIDDEN
    if (point > 0.095 && point < 0.105) *early = true;
#endif
#if DEFECT3_EARLY_STUCK
    if (cut) *last = point - 1;
#endif
#if DEFECT3_LAST_TIME
    if (!cut) *last = 0;
#endif
    return status;
}

EXPORT Status fmi3GetFloat64(void *c, const uint32_t r[], size_t count, double value[], size_t values) {
    Three *t = c;
    size_t n, at = 0;
    if (!count) return fmi2GetReal(TWO(c), r, 0, value);
    for (n = 0; n < count; n++) {
        if (r[n] == 50 || r[n] == 51) {
            static const uint32_t both[] = {1, 2};
            size_t need = r[n] == 50 ? 4 : 2;
#if !DEFECT3_ARRAY_COUNT
            if (at + need > values) return fail(TWO(c), "too few values");
#endif
            if (r[n] == 50 && t) memcpy(value + at, ARRAY(t), sizeof ARRAY(t));
            else if (fmi2GetReal(TWO(c), both, 2, value + at)) return ERROR;
            at += need;
            continue;
        }
        if (at >= values) return fail(TWO(c), "too few values");
        if (fmi2GetReal(TWO(c), r + n, 1, value + at++)) return ERROR;
    }
    return OK;
}

EXPORT Status fmi3SetFloat64(void *c, const uint32_t r[], size_t count, const double value[], size_t values) {
    Three *t = c;
    size_t n, at = 0;
    if (!c) return ERROR;
    for (n = 0; n < count; n++) {
        if (r[n] == 50) {
            Instance *i = t->two;
            if (at + 4 > values || i->values.phase == STEPPING) return fail(i, "A is fixed");
            memcpy(ARRAY(t), value + at, sizeof ARRAY(t));
            at += 4;
            continue;
        }
        if (at >= values) return fail(t->two, "too few values");
        if (fmi2SetReal(t->two, r + n, 1, value + at++)) return ERROR;
    }
    return OK;
}

EXPORT Status fmi3GetFloat32(void *c, const uint32_t r[], size_t count, float value[], size_t values) {
    static const uint32_t y = 6;
    double wide;
    size_t n;
    (void)values;
    for (n = 0; n < count; n++) {
        if (r[n] != 53) return fail(TWO(c), "unknown reference");
        if (fmi2GetReal(TWO(c), &y, 1, &wide)) return ERROR;
        value[n] = (float)wide;
    }
    return OK;
}

#define WHOLE(name, type, base, check)                                                                                   \
    EXPORT Status fmi3Get##name(void *c, const uint32_t r[], size_t count, type value[], size_t values) {                \
        size_t n;                                                                                                        \
        (void)values;                                                                                                    \
        for (n = 0; n < count; n++) {                                                                                    \
            uint32_t own = r[n] - 20;                                                                                    \
            int wide;                                                                                                    \
            if (!(check)) return fail(TWO(c), "unknown reference");                                                      \
            if (fmi2GetInteger(TWO(c), &own, 1, &wide)) return ERROR;                                                    \
            value[n] = (type)wide;                                                                                       \
        }                                                                                                                \
        return OK;                                                                                                       \
    }                                                                                                                    \
    EXPORT Status fmi3Set##name(void *c, const uint32_t r[], size_t count, const type value[], size_t values) {          \
        size_t n;                                                                                                        \
        (void)values;                                                                                                    \
        if (!c) return ERROR;                                                                                            \
        for (n = 0; n < count; n++) {                                                                                    \
            uint32_t own = r[n] - 20;                                                                                    \
            int wide = (int)value[n];                                                                                    \
            if (!(check)) return fail(TWO(c), "unknown reference");                                                      \
            if (fmi2SetInteger(TWO(c), &own, 1, &wide)) return ERROR;                                                    \
        }                                                                                                                \
        return OK;                                                                                                       \
    }
WHOLE(Int32, int32_t, 20, own < 2)
WHOLE(Int64, int64_t, 20, own == 2)

EXPORT Status fmi3GetUInt64(void *c, const uint32_t r[], size_t count, uint64_t value[], size_t values) {
    size_t n;
    (void)values;
    for (n = 0; n < count; n++) {
        if (r[n] != 60) return fail(TWO(c), "unknown reference");
        value[n] = 2;
    }
    return OK;
}
EXPORT Status fmi3SetUInt64(void *c, const uint32_t r[], size_t count, const uint64_t value[], size_t values) {
    size_t n;
    (void)values;
    for (n = 0; n < count; n++)
        if (r[n] != 60 || !((Three *)c)->configuring || value[n] != 2) return fail(TWO(c), "a structural parameter");
    return OK;
}

EXPORT Status fmi3GetBoolean(void *c, const uint32_t r[], size_t count, unsigned char value[], size_t values) {
    size_t n;
    (void)values;
    for (n = 0; n < count; n++) {
        uint32_t own = r[n] - 30;
        int wide;
        if (fmi2GetBoolean(TWO(c), &own, 1, &wide)) return ERROR;
        value[n] = (unsigned char)wide;
    }
    return OK;
}
EXPORT Status fmi3SetBoolean(void *c, const uint32_t r[], size_t count, const unsigned char value[], size_t values) {
    size_t n;
    (void)values;
    for (n = 0; n < count; n++) {
        uint32_t own = r[n] - 30;
        int wide = value[n];
        if (fmi2SetBoolean(TWO(c), &own, 1, &wide)) return ERROR;
    }
    return OK;
}

EXPORT Status fmi3GetString(void *c, const uint32_t r[], size_t count, const char *value[], size_t values) {
    uint32_t own[64];
    size_t n;
    (void)values;
    for (n = 0; n < count && n < 64; n++) own[n] = r[n] - 40;
    return fmi2GetString(TWO(c), own, count, value);
}
EXPORT Status fmi3SetString(void *c, const uint32_t r[], size_t count, const char *const value[], size_t values) {
    uint32_t own[64];
    size_t n;
    (void)values;
    for (n = 0; n < count && n < 64; n++) own[n] = r[n] - 40;
    return fmi2SetString(TWO(c), own, count, value);
}

EXPORT Status fmi3GetBinary(void *c, const uint32_t r[], size_t count, size_t sizes[], const uint8_t *value[],
                            size_t values) {
    static const uint8_t bytes[] = {0xE1, 0x00, 0x0F};
    size_t n;
    (void)values;
    for (n = 0; n < count; n++) {
        if (r[n] != 54) return fail(TWO(c), "unknown reference");
        sizes[n] = sizeof bytes;
        value[n] = bytes;
#if DEFECT3_BINARY_FREED
        uint8_t *copy = malloc(sizeof bytes);
        value[n] = memcpy(copy, bytes, sizeof bytes);
        free(copy);
#endif
#if DEFECT3_BINARY_STACK
        value[n] = (const uint8_t *)on_the_stack("moving");
#endif
#if DEFECT3_BINARY_NULL
        value[n] = NULL;
#endif
#if DEFECT3_BINARY_SIZE
        sizes[n] = (size_t)-1;
#endif
    }
    return OK;
}

/* Types and functions of which there is nothing. */
#define NOTHING(name, ...)                                                                                               \
    EXPORT Status name(void *c, const uint32_t r[], size_t count, __VA_ARGS__) {                                         \
        (void)r;                                                                                                         \
        return count ? c ? fail(TWO(c), "unknown reference") : ERROR : OK;                                               \
    }
NOTHING(fmi3SetFloat32, const float value[], size_t values)
NOTHING(fmi3GetInt8, int8_t value[], size_t values)
NOTHING(fmi3SetInt8, const int8_t value[], size_t values)
NOTHING(fmi3GetUInt8, uint8_t value[], size_t values)
NOTHING(fmi3SetUInt8, const uint8_t value[], size_t values)
NOTHING(fmi3GetInt16, int16_t value[], size_t values)
NOTHING(fmi3SetInt16, const int16_t value[], size_t values)
NOTHING(fmi3GetUInt16, uint16_t value[], size_t values)
NOTHING(fmi3SetUInt16, const uint16_t value[], size_t values)
NOTHING(fmi3GetUInt32, uint32_t value[], size_t values)
NOTHING(fmi3SetUInt32, const uint32_t value[], size_t values)
NOTHING(fmi3SetBinary, const size_t sizes[], const uint8_t *const value[], size_t values)
#if !DEFECT_SYMBOL_OPTIONAL
NOTHING(fmi3GetClock, bool value[])
#endif
NOTHING(fmi3SetClock, const bool value[])
NOTHING(fmi3GetIntervalDecimal, double intervals[], int qualifiers[])
NOTHING(fmi3GetIntervalFraction, uint64_t counters[], uint64_t resolutions[], int qualifiers[])
NOTHING(fmi3GetShiftDecimal, double shifts[])
NOTHING(fmi3GetShiftFraction, uint64_t counters[], uint64_t resolutions[])
NOTHING(fmi3SetIntervalDecimal, const double intervals[])
NOTHING(fmi3SetIntervalFraction, const uint64_t counters[], const uint64_t resolutions[])
NOTHING(fmi3SetShiftDecimal, const double shifts[])
NOTHING(fmi3SetShiftFraction, const uint64_t counters[], const uint64_t resolutions[])

EXPORT Status fmi3GetNumberOfVariableDependencies(void *c, uint32_t r, size_t *count) {
    (void)c, (void)r, (void)count;
    return ERROR;
}
EXPORT Status fmi3GetVariableDependencies(void *c, uint32_t r, size_t own[], uint32_t of[], size_t theirs[], int kinds[],
                                          size_t count) {
    (void)c, (void)r, (void)own, (void)of, (void)theirs, (void)kinds, (void)count;
    return ERROR;
}
EXPORT Status fmi3GetAdjointDerivative(void *c) { (void)c; return ERROR; }

/* Of other interfaces. */
#define OTHER(name) EXPORT Status name(void *c) { (void)c; return ERROR; }
EXPORT void *fmi3InstantiateModelExchange(void) { return NULL; }
EXPORT void *fmi3InstantiateScheduledExecution(void) { return NULL; }
OTHER(fmi3EnterContinuousTimeMode)
OTHER(fmi3CompletedIntegratorStep)
OTHER(fmi3SetTime)
OTHER(fmi3SetContinuousStates)
OTHER(fmi3GetContinuousStateDerivatives)
OTHER(fmi3GetEventIndicators)
OTHER(fmi3GetContinuousStates)
OTHER(fmi3GetNominalsOfContinuousStates)
OTHER(fmi3GetNumberOfEventIndicators)
OTHER(fmi3GetNumberOfContinuousStates)
OTHER(fmi3ActivateModelPartition)

EXPORT Status fmi3GetFMUState(void *c, State *state) { return fmi2GetFMUstate(TWO(c), state); }
EXPORT Status fmi3SetFMUState(void *c, State state) { return fmi2SetFMUstate(TWO(c), state); }
EXPORT Status fmi3FreeFMUState(void *c, State *state) { return fmi2FreeFMUstate(TWO(c), state); }
EXPORT Status fmi3SerializedFMUStateSize(void *c, State state, size_t *size) {
    return fmi2SerializedFMUstateSize(TWO(c), state, size);
}
EXPORT Status fmi3SerializeFMUState(void *c, State state, uint8_t bytes[], size_t size) {
    return fmi2SerializeFMUstate(TWO(c), state, (char *)bytes, size);
}
EXPORT Status fmi3DeserializeFMUState(void *c, const uint8_t bytes[], size_t size, State *state) {
    return fmi2DeSerializeFMUstate(TWO(c), (const char *)bytes, size, state);
}

EXPORT Status fmi3GetDirectionalDerivative(void *c, const uint32_t unknown[], size_t unknowns, const uint32_t known[],
                                           size_t knowns, const double seed[], size_t seeds, double value[],
                                           size_t values) {
    size_t n, m, at = 0;
    (void)seeds;
    for (n = 0; n < unknowns; n++) {
        /* The array output is x and v. */
        uint32_t first = unknown[n] == 51 ? 1 : unknown[n], last = unknown[n] == 51 ? 2 : first;
        for (; first <= last && at < values; first++, at++)
            for (value[at] = 0, m = 0; m < knowns; m++) {
                double slope = unknown[n] == 51 ? first == known[m] : partial(TWO(c), unknown[n] == 53 ? 6 : first, known[m]);
                value[at] = (IS(DIRECTIONAL_SEVERAL) ? 0 : value[at]) + slope * seed[m];
            }
    }
    return OK;
}

EXPORT Status fmi3GetOutputDerivatives(void *c, const uint32_t r[], size_t count, const int32_t order[], double value[],
                                       size_t values) {
    size_t n, at = 0;
    for (n = 0; n < count; n++) {
        if (order[n] != 1) return fail(TWO(c), "order");
        if (r[n] == 51 && at + 2 <= values) {
            value[at++] = ((Instance *)TWO(c))->values.v;
            value[at++] = der_v(TWO(c));
            continue;
        }
        uint32_t own = r[n] == 53 ? 6 : r[n];
        int32_t first = 1;
        if (at >= values || fmi2GetRealOutputDerivatives(TWO(c), &own, 1, &first, value + at++)) return ERROR;
    }
    return OK;
}
