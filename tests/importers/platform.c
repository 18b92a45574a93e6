/* platform LIBRARY GUID STEP [REFERENCE=VALUE ...] < torques: runs the FMU's library as an importer in C does, on Linux or
 * Windows, one line of outputs a step. At half the steps it keeps a state as bytes, and after the end runs on from there
 * once more: exit code 1 unless that gives the same numbers to the bit. Declarations as in fmi2FunctionTypes.h. */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#define OPEN(path) (void *)LoadLibraryA(path)
#define FIND_IN(library, name) (void *)GetProcAddress((HMODULE)library, name)
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND_IN(library, name) dlsym(library, name)
#endif

typedef void *Component;
typedef void *State;
typedef unsigned int Reference;
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

static void logger(void *environment, const char *name, int status, const char *category, const char *message, ...) {
    (void)environment; (void)message;
    fprintf(stderr, "%s: status %d, %s\n", name, status, category);
}

#define FIND(result, name, ...) result (*name)(__VA_ARGS__); *(void **)(&name) = FIND_IN(library, "fmi2" #name); \
    if (!name) { fprintf(stderr, "no fmi2" #name "\n"); return 1; }
#define DO(call) do { int got = (call); if (got != 0) { fprintf(stderr, "%s returned %d\n", #call, got); return 1; } } while (0)
enum { MOST = 1 << 20, OUTPUTS = 7 };

int main(int argc, char **argv) {
    if (argc < 4) return 2;
    void *library = OPEN(argv[1]);
    if (!library) { fprintf(stderr, "%s cannot be loaded\n", argv[1]); return 2; }
    FIND(Component, Instantiate, const char *, int, const char *, const char *, const Callbacks *, int, int)
    FIND(void, FreeInstance, Component)
    FIND(int, SetupExperiment, Component, int, double, double, int, double)
    FIND(int, EnterInitializationMode, Component)
    FIND(int, ExitInitializationMode, Component)
    FIND(int, Terminate, Component)
    FIND(int, SetReal, Component, const Reference *, size_t, const double *)
    FIND(int, GetReal, Component, const Reference *, size_t, double *)
    FIND(int, DoStep, Component, double, double, int)
    FIND(int, GetFMUstate, Component, State *)
    FIND(int, SetFMUstate, Component, State)
    FIND(int, FreeFMUstate, Component, State *)
    FIND(int, SerializedFMUstateSize, Component, State, size_t *)
    FIND(int, SerializeFMUstate, Component, State, char *, size_t)
    FIND(int, DeSerializeFMUstate, Component, const char *, size_t, State *)

    static double torque[MOST], first[MOST][OUTPUTS];
    size_t steps = 0, size = 0;
    while (steps < MOST && scanf("%lf", &torque[steps]) == 1) ++steps;
    const double step = atof(argv[3]);
    const Reference input = 0, outputs[OUTPUTS] = {1, 2, 3, 4, 5, 6, 7};
    const Callbacks callbacks = {logger, calloc, free, NULL, NULL};
    Component c = Instantiate("axis", 1, argv[2], "", &callbacks, 0, 0);
    if (!c) return 1;
    for (int i = 4; i < argc; ++i) {
        const char *value = strchr(argv[i], '=');
        if (!value) return 2;
        const Reference reference = (Reference)strtoul(argv[i], NULL, 10);
        const double number = atof(value + 1);
        DO(SetReal(c, &reference, 1, &number));
    }
    DO(SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0));
    DO(EnterInitializationMode(c));
    DO(ExitInitializationMode(c));
    char *bytes = NULL;
    State state = NULL;
    for (size_t k = 0; k < steps; ++k) {
        if (k == steps / 2) {
            DO(GetFMUstate(c, &state));
            DO(SerializedFMUstateSize(c, state, &size));
            bytes = malloc(size);
            DO(SerializeFMUstate(c, state, bytes, size));
            DO(FreeFMUstate(c, &state));
        }
        DO(SetReal(c, &input, 1, &torque[k]));
        DO(DoStep(c, (double)k * step, step, 1));
        DO(GetReal(c, outputs, OUTPUTS, first[k]));
        for (int i = 0; i < OUTPUTS; ++i) printf("%.17g%c", first[k][i], i + 1 < OUTPUTS ? ' ' : '\n');
    }
    DO(DeSerializeFMUstate(c, bytes, size, &state));
    DO(SetFMUstate(c, state));
    DO(FreeFMUstate(c, &state));
    for (size_t k = steps / 2; k < steps; ++k) {
        double again[OUTPUTS];
        DO(SetReal(c, &input, 1, &torque[k]));
        DO(DoStep(c, (double)k * step, step, 1));
        DO(GetReal(c, outputs, OUTPUTS, again));
        if (memcmp(again, first[k], sizeof again) != 0) { fprintf(stderr, "step %zu differs after a rollback\n", k); return 1; }
    }
    DO(Terminate(c));
    FreeInstance(c);
    free(bytes);
    return 0;
}
