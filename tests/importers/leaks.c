/* leaks LIBRARY GUID CYCLES: instantiates, runs and frees the FMU that many times, as an importer in C does; for valgrind.
 * Calls every function of the interface, good and bad, and leaves one state unfreed each time. Exit code 0 when every call
 * returned what it should. Declarations as in fmi2FunctionTypes.h. */

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef void *Component;
typedef void *State;
typedef unsigned int Reference;
typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

static int messages;
static void logger(void *environment, const char *name, int status, const char *category, const char *message, ...) {
    (void)environment; (void)status;
    messages += strlen(name) > 0 && strlen(category) > 0 && strcmp(message, "%s") == 0;
}

#define FIND(result, name, ...) result (*name)(__VA_ARGS__); *(void **)(&name) = dlsym(library, "fmi2" #name); \
    if (!name) { fprintf(stderr, "no fmi2" #name "\n"); return 1; }
#define EXPECT(status, call) do { int got = (call); \
    if (got != (status)) { fprintf(stderr, "%s returned %d\n", #call, got); return 1; } } while (0)

int main(int argc, char **argv) {
    if (argc != 4) return 2;
    void *library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) { fprintf(stderr, "%s\n", dlerror()); return 2; }
    FIND(Component, Instantiate, const char *, int, const char *, const char *, const Callbacks *, int, int)
    FIND(void, FreeInstance, Component)
    FIND(int, SetupExperiment, Component, int, double, double, int, double)
    FIND(int, EnterInitializationMode, Component)
    FIND(int, ExitInitializationMode, Component)
    FIND(int, Terminate, Component)
    FIND(int, Reset, Component)
    FIND(int, SetReal, Component, const Reference *, size_t, const double *)
    FIND(int, GetReal, Component, const Reference *, size_t, double *)
    FIND(int, DoStep, Component, double, double, int)
    FIND(int, GetFMUstate, Component, State *)
    FIND(int, SetFMUstate, Component, State)
    FIND(int, FreeFMUstate, Component, State *)
    FIND(int, SerializedFMUstateSize, Component, State, size_t *)
    FIND(int, SerializeFMUstate, Component, State, char *, size_t)
    FIND(int, DeSerializeFMUstate, Component, const char *, size_t, State *)
    FIND(int, GetDirectionalDerivative, Component, const Reference *, size_t, const Reference *, size_t, const double *,
         double *)
    FIND(int, SetRealInputDerivatives, Component, const Reference *, size_t, const int *, const double *)
    FIND(int, GetRealOutputDerivatives, Component, const Reference *, size_t, const int *, double *)
    /* What an importer must not do: refused with a status, never a bad access. */
    Callbacks sound = {logger, calloc, free, NULL, NULL}, silent = {NULL, NULL, NULL, NULL, NULL};
    for (int cycle = 0; cycle < atoi(argv[3]) / 10; ++cycle) {
        const Reference known = 0;
        double value = 0.0;
        State state = NULL;
        size_t size = 0;
        char garbage[512];
        memset(garbage, 0x5a, sizeof garbage);
        if (Instantiate(NULL, 1, argv[2], NULL, &sound, 0, 1) || Instantiate("axis", 1, NULL, NULL, &sound, 0, 1)
            || Instantiate("axis", 1, "{not this one}", NULL, &sound, 0, 1) || Instantiate("axis", 1, argv[2], NULL, NULL, 0, 1)
            || Instantiate("axis", 0, argv[2], NULL, &sound, 0, 1)) return 1;
        FreeInstance(NULL);
        EXPECT(3, DoStep(NULL, 0.0, 1e-3, 1));
        EXPECT(3, GetReal(NULL, &known, 1, &value));
        EXPECT(3, SetupExperiment(NULL, 0, 0.0, 0.0, 0, 0.0));
        EXPECT(3, GetFMUstate(NULL, &state));
        EXPECT(3, Terminate(NULL));
        EXPECT(3, Reset(NULL));
        /* An importer without callbacks of its own is served, silently. */
        Component c = Instantiate("axis", 1, argv[2], NULL, cycle % 2 ? &sound : &silent, 0, 1);
        if (!c) return 1;
        EXPECT(3, GetReal(c, NULL, 1, &value));
        EXPECT(3, GetReal(c, &known, 1, NULL));
        EXPECT(3, ExitInitializationMode(c));
        EXPECT(3, Terminate(c));
        EXPECT(3, SetFMUstate(c, NULL));
        EXPECT(3, GetFMUstate(c, NULL));
        EXPECT(3, SerializedFMUstateSize(c, NULL, &size));
        EXPECT(3, DeSerializeFMUstate(c, garbage, sizeof garbage, &state));
        EXPECT(3, DeSerializeFMUstate(c, garbage, 0, &state));
        EXPECT(3, DeSerializeFMUstate(c, NULL, sizeof garbage, &state));
        EXPECT(0, SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0));
        EXPECT(0, EnterInitializationMode(c));
        EXPECT(0, GetReal(c, NULL, 0, NULL));
        EXPECT(0, ExitInitializationMode(c));
        EXPECT(0, GetFMUstate(c, &state));
        EXPECT(0, SerializedFMUstateSize(c, state, &size));
        char *bytes = malloc(size);
        EXPECT(3, SerializeFMUstate(c, state, bytes, size - 1));
        EXPECT(3, SerializeFMUstate(c, state, NULL, size));
        EXPECT(0, SerializeFMUstate(c, state, bytes, size));
        State cut = NULL;
        EXPECT(3, DeSerializeFMUstate(c, bytes, size - 1, &cut));
        for (size_t k = 0; k < size; k += 97) {
            /* A byte of it changed: refused, or a state that can be gone back to and stepped. */
            bytes[k] ^= 0x41;
            if (DeSerializeFMUstate(c, bytes, size, &cut) == 0) {
                SetFMUstate(c, cut);
                DoStep(c, 0.0, 1e-3, 1);
                EXPECT(0, FreeFMUstate(c, &cut));
                EXPECT(0, SetFMUstate(c, state));
            }
            bytes[k] ^= 0x41;
        }
        free(bytes);
        EXPECT(3, DoStep(c, 0.0, -1e-3, 1));
        EXPECT(0, Terminate(c));
        EXPECT(3, DoStep(c, 0.0, 1e-3, 1));
        EXPECT(0, FreeFMUstate(c, &state));
        EXPECT(0, FreeFMUstate(c, &state));
        FreeInstance(c);
    }
    messages = 0;
    const double step = 1e-3, torque = 0.01, one = 1.0;
    const Reference input = 0, outputs[] = {1, 2, 3, 4, 5, 6, 7}, wrong = 4000000000u;
    const int orders[] = {1, 1, 1, 1, 1, 1, 1};
    for (int cycle = 0; cycle < atoi(argv[3]); ++cycle) {
        /* Callbacks and texts on the heap and gone at once: the FMU must have copied them. */
        Callbacks *callbacks = malloc(sizeof *callbacks);
        char *name = strdup("axis"), *guid = strdup(argv[2]);
        *callbacks = (Callbacks){logger, calloc, free, NULL, NULL};
        Component c = Instantiate(name, 1, guid, NULL, callbacks, 0, 1);
        memset(callbacks, 0xee, sizeof *callbacks);
        free(callbacks);
        free(name);
        free(guid);
        if (!c) return 1;
        double values[7];
        EXPECT(3, DoStep(c, 0.0, step, 1));
        EXPECT(0, SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0));
        EXPECT(0, EnterInitializationMode(c));
        EXPECT(0, GetDirectionalDerivative(c, outputs, 7, &input, 1, &one, values));
        EXPECT(0, ExitInitializationMode(c));
        State state = NULL, copy = NULL, left = NULL;
        EXPECT(0, GetFMUstate(c, &state));
        EXPECT(0, GetFMUstate(c, &left));
        for (int k = 0; k < 5; ++k) {
            EXPECT(0, SetReal(c, &input, 1, &torque));
            EXPECT(0, SetRealInputDerivatives(c, &input, 1, orders, &one));
            EXPECT(0, DoStep(c, k * step, step, 1));
        }
        EXPECT(0, GetReal(c, outputs, 7, values));
        EXPECT(0, GetRealOutputDerivatives(c, outputs, 7, orders, values));
        EXPECT(3, GetReal(c, &wrong, 1, values));
        EXPECT(3, SetReal(c, &input, 1, NULL));
        size_t size = 0;
        EXPECT(0, SerializedFMUstateSize(c, state, &size));
        char *bytes = malloc(size);
        EXPECT(0, SerializeFMUstate(c, state, bytes, size));
        EXPECT(0, DeSerializeFMUstate(c, bytes, size, &copy));
        free(bytes);
        EXPECT(0, SetFMUstate(c, copy));
        EXPECT(0, FreeFMUstate(c, &copy));
        EXPECT(0, FreeFMUstate(c, &state));
        EXPECT(0, DoStep(c, 0.0, step, 1));
        EXPECT(0, Terminate(c));
        EXPECT(0, Reset(c));
        FreeInstance(c);
    }
    dlclose(library);
    return messages == 3 * atoi(argv[3]) ? 0 : 1;
}
