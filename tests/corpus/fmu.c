/* A small FMI 2.0 co-simulation FMU with switchable defects, for the tests of `eixo validate`.
 *
 * Model: a mass on a spring with an inner, hidden relaxation,
 *     x' = v,  v' = F - k x - d v - 0.2 w + 0.1 on + 0.01 mode,  w' = v - w,
 * integrated by classical Runge-Kutta in steps of at most 1 ms. y = x + 0.1 F, z = v.
 *
 * Compile: cc -shared -fPIC -DDEFECT=<name> -o corpus.so fmu.c -lm; DEFECT is one of the names below. */
#define _GNU_SOURCE
#include <errno.h>
#include <fenv.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

enum {
    NONE, UNRESOLVED, SYMBOL_MISSING, SYMBOL_OPTIONAL, PLATFORM, VERSION, REFUSES, INSTANTIATE_CRASH, INITIALISE,
    UNREADABLE, STEP_FAILS, STEP_CRASH, STEP_ABORT, STEP_EXIT, STEP_EXIT_ZERO, STEP_HANG, STEP_MEMORY, STEP_STACK,
    PENDING, STATUS_NUMBER, RANDOM, UNINITIALISED, TERMINATE, FREE_CRASH, FREE_NULL, UNLOAD, GUID_ACCEPTED, RESOURCES,
    START_VALUE, START_STRING, START_REFUSED, SET_GET, GET_EFFECT, BOOLEAN, STRING_NULL, STRING_LATIN, FIXED_DRIFTS,
    NAN_OUTPUT, RANGE, TUNABLE_REFUSED, FIXED_ACCEPTED, BAD_GET, BAD_SET, BAD_GET_CRASH, EMPTY_CALL, RESET_FORGETS,
    RESET_PARAMETER, RESET_CRASH, STATE_FORGETS, STATE_INPUT, STATE_SHARED, STATE_HANDLE, SERIALISE, SERIALISE_POINTER,
    STEP_IGNORED, CONVERGENCE, VARIABLE, NEGATIVE, ZERO, WRONG_POINT, EARLY, EARLY_CRASH, LATE, INIT_ORDER, NAN_INPUT,
    NAN_HANG, CANCEL, TIME, DERIVATIVE, INPUT_DERIVATIVE, OUTPUT_DERIVATIVE, DIRECTIONAL, DEPENDENCY, GLOBAL, THREADS,
    HANDOVER, LEAK, LEAK_LARGE, NULL_CRASH, LEAK_FILE, LEAK_THREAD, STEP_LEAK, CALLBACKS, NAME_KEPT, ALLOCATION, DEBUG_LOGGING, LOG_CATEGORY,
    DIRECTORY, ROUNDING, DENORMALS, STDOUT, SIGNALS, ENVIRONMENT, LOCALE, FILES,
    SECOND_FAILS, SECOND_CRASH, KEPT, ORDER, TERMINATED_GET, TERMINATED_RESET, RESOURCES_PATH, START_TIME, STOP_TIME,
    INPUTS_LOST, SET_WRONG, STRING_BUFFER, TUNABLE_IGNORED, REFERENCE_CUT, STATE_LEAK, STATE_LATE, STATE_PROMISE,
    RESET_SLOPE, INITIAL_KEPT, OUTPUT_BEHIND, SLOPE_IGNORED, DEPENDENCY_STEP, NOT_CONSTANT, TIME_HIDDEN, LOCALE_NUMBERS,
    ENUMERATION, DISK, LOG_FOREIGN, FORGES,
    GET_BEHIND, SET_BEHIND, REFERENCES_CHANGED, GET_INITIAL, SET_FIRST, SET_ORDER, SET_ONCE, STRING_KEPT, STRING_CUT,
    BOOLEAN_LATE, RESET_LABEL, RESET_EARLY, STATE_EFFECT, STATE_ONCE, ONE_SIZE, EXACT_POINT, EXACT_STOP, SLOPE_SIGN,
    TOLERANCE, ENDLESS, NAME_LONG, NAME_FORMAT, UMASK, SIGNALS_BLOCKED, TIMER, MAPPED,
    LOG_ALWAYS, LOG_STAYS, PARAMETERS_LOST, PARAMETERS_REFUSED, PARAMETERS_LATE, RESOURCES_URI, STRING_SHORT,
    STRING_OVERFLOW, STRING_FREED, STRING_STACK, DAEMON,
    STRING_LONG, STRING_LONG_FREED, LOG_UNFILTERED, LOG_NEEDS_CATEGORY, LOG_UNKNOWN,
    RESET_SOLVER, STATE_SOLVER, STATE_PROMISED, INITIAL_STATIC, DIRECTIONAL_SEVERAL, SLOPE_DOUBLED, SERIALISE_PARAMETER,
    SLOPE_STATE, SLOPE_AGAINST, SLOPE_FEEDTHROUGH, INTEGER_BEHIND, BOOLEAN_BEHIND, ENUMERATION_BEHIND, STATE_DROPPED,
    STATE_REDONE, STATE_FALSE_IGNORED, STEP_ALTERNATE, START_CLOCK
};
#ifndef DEFECT
#define DEFECT NONE
#endif
/* What hostile.c does in each step. */
#ifndef HOOK
#define HOOK()
#endif
#define IS(name) (DEFECT == (name))

typedef void *Component;
typedef void *State;
typedef int Status;
enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING_STATUS };
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*free)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

typedef enum { INSTANTIATED = 1, INITIALIZING = 2, STEPPING = 4, TERMINATED = 8 } Phase;

typedef struct {
    double x, v, w, F, k, d, g, time, last_step, noise, slope, stop, elapsed, shown, offset, spare, first_k;
    int mode, on, calls, sets;
    /* Integer, Boolean and Enumeration output at the beginning of the step. */
    int before[3];
    Phase phase;
    char label[1024];
    /* Of FMI 3.0 alone. */
    double A[4];
} Values;

typedef struct {
    Values values;
    Callbacks callbacks;
    const Callbacks *kept;
    char name[64];
    const char *kept_name;
    int logging;
    pthread_t thread;
    void *leaks;
    Values *pointer;
    double first_x;
    int initialised;
    const char *kept_label;
    char *small;
    /* What a solver remembers, and whether it was promised that no state is set. */
    double warm;
    int promised;
    /* Steps after which no state before them is set, and the beginning of the last step. */
    int promises;
    double begun;
} Instance;

static double global_w;
static volatile double scratch;
static Values shared_state;
static int made, alive;
static double kept_k = 10;
static __thread char buffer[1024];

#define W(i) (*(IS(GLOBAL) ? &global_w : &(i)->values.w))

static void start(Values *s) {
    double w = s->w, k = s->k;
    memset(s, 0, sizeof *s);
    s->x = 1;
    s->k = s->first_k = IS(START_VALUE) ? 11 : 10;
    s->stop = INFINITY;
    s->d = 0.5;
    s->g = 9.81;
    strcpy(s->label, IS(START_STRING) ? "another" : "mass");
    s->phase = INSTANTIATED;
    (void)w;
    (void)k;
}

static void log_text(Instance *i, int status, const char *category, const char *text, double value) {
    const char *name = IS(NAME_KEPT) ? i->kept_name : i->name;
    const Callbacks *callbacks = IS(CALLBACKS) ? i->kept : &i->callbacks;
    if ((i->logging || status > WARNING || IS(LOG_ALWAYS)) && callbacks->logger)
        callbacks->logger(callbacks->environment, name, status, category, "%s, %g", text, value);
}

static Status fail(Instance *i, const char *text) {
    log_text(i, ERROR, "logStatusError", text, i->values.time);
    return ERROR;
}

#ifdef __GNUC__
#define EXPORT __attribute__((visibility("default")))
#endif

EXPORT const char *fmi2GetTypesPlatform(void) { return IS(PLATFORM) ? "standard32" : "default"; }
EXPORT const char *fmi2GetVersion(void) { return IS(VERSION) ? "2.0.1" : "2.0"; }

#if DEFECT_UNRESOLVED
extern void eixo_corpus_no_such_function(void);
EXPORT void eixo_corpus_reference(void) { eixo_corpus_no_such_function(); }
#endif
#if DEFECT_UNLOAD
__attribute__((destructor)) static void unload(void) { abort(); }
#endif

/* The path of a URI file:/path or file:///path, as it is written there. */
static const char *path_of(const char *uri) {
    uri += strncmp(uri, "file:", 5) ? 0 : 5;
    return strncmp(uri, "//", 2) ? uri : uri + 2;
}

EXPORT Component fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                                 const Callbacks *callbacks, int visible, int logging) {
    (void)visible;
    if (!name || !*name || type != 1 || !callbacks) return NULL;
    if (IS(REFUSES)) {
        callbacks->logger(callbacks->environment, name, ERROR, "logStatusError", "no licence for %s", name);
        return NULL;
    }
    if (IS(INSTANTIATE_CRASH)) *(volatile int *)8 = 1;
    if (!IS(GUID_ACCEPTED) && (!guid || strcmp(guid, "{7d6b4f0e-3a52-4c7e-9d0e-c0a3b1f2e4d5}"))) return NULL;
    if (IS(RESOURCES)) {
        struct stat info;
        char path[4096];
        snprintf(path, sizeof path, "%s", path_of(resources));
        if (stat(path, &info) && !strchr(path, '%')) *(volatile int *)8 = 1;
    }
    Instance *i = callbacks->allocate(1, sizeof(Instance));
    if (!i && !IS(ALLOCATION)) return NULL;
    i->callbacks = *callbacks;
    i->kept = callbacks;
    i->kept_name = name;
    snprintf(i->name, sizeof i->name, "%s", name);
    i->logging = logging;
    i->thread = pthread_self();
    i->pointer = &i->values;
    start(&i->values);
    if (IS(UNINITIALISED)) {
        double *noise = malloc(1000);
        i->values.noise = ((unsigned char *)noise)[500];
        free(noise);
    }
    if (IS(SECOND_FAILS) && made) return NULL;
    if (IS(SECOND_CRASH) && made) *(volatile int *)8 = 1;
    made++;
    if (IS(KEPT)) i->values.k = kept_k;
    if (IS(ORDER)) i->values.offset = 1e-3 * alive;
    alive++;
    if (IS(RESOURCES_PATH)) {
        char path[4096];
        snprintf(path, sizeof path, "%s/data.txt", path_of(resources));
        if (access(path, R_OK)) return NULL;
    }
    if (IS(RESOURCES_URI) && strncmp(resources, "file://", 7)) return NULL;
    if (IS(LOCALE_NUMBERS)) i->values.d = strtod("0.5", NULL);
    if (IS(LEAK)) i->leaks = malloc(1000);
    if (IS(LEAK_LARGE)) i->leaks = malloc(100000);
    if (IS(LEAK_FILE)) i->leaks = fopen("/dev/null", "r");
    if (IS(LEAK_THREAD)) {
        pthread_t thread;
        pthread_attr_t attributes;
        pthread_attr_init(&attributes);
        pthread_attr_setstacksize(&attributes, 65536);
        /* Code of the C library, which stays: a thread that first runs after the unloading would crash in ours. */
        pthread_create(&thread, &attributes, (void *(*)(void *))(void (*)(void))pause, NULL);
        pthread_attr_destroy(&attributes);
    }
    if (IS(DAEMON) && fork() == 0) {
        setsid();
        if (fork() == 0) sleep(300);
        _exit(0);
    }
    if (IS(DIRECTORY) && chdir("/")) return NULL;
    if (IS(ROUNDING)) fesetround(FE_UPWARD);
    if (IS(DENORMALS)) {
        unsigned int mxcsr;
        __asm__ volatile("stmxcsr %0" : "=m"(mxcsr));
        mxcsr |= 0x8040;
        __asm__ volatile("ldmxcsr %0" : : "m"(mxcsr));
    }
    if (IS(SIGNALS)) signal(SIGINT, SIG_IGN);
    if (IS(ENVIRONMENT)) setenv("EIXO_CORPUS", "1", 1);
    if (IS(NAME_LONG)) strcpy(i->small = malloc(32), name);
    if (IS(STRING_OVERFLOW)) i->small = malloc(32);
    if (IS(NAME_FORMAT)) {
        char text[4096];
        snprintf(text, sizeof text, name);
    }
    if (IS(UMASK)) umask(0);
    if (IS(SIGNALS_BLOCKED)) {
        sigset_t some;
        sigemptyset(&some);
        sigaddset(&some, SIGINT);
        pthread_sigmask(SIG_BLOCK, &some, NULL);
    }
    if (IS(TIMER)) {
        struct itimerval hour = {{0, 0}, {3600, 0}};
        setitimer(ITIMER_REAL, &hour, NULL);
    }
    if (IS(LOCALE) && !setlocale(LC_NUMERIC, "C.UTF-8")) return NULL;
    return i;
}

EXPORT void fmi2FreeInstance(Component c) {
    Instance *i = c;
    if (!i && !IS(FREE_NULL)) return;
    alive--;
    if (IS(FREE_CRASH) && i->values.phase == TERMINATED) abort();
    if (IS(STEP_LEAK))
        while (i->leaks) {
            void *next = *(void **)i->leaks;
            free(i->leaks);
            i->leaks = next;
        }
    free(i->small);
    i->callbacks.free(i);
}

EXPORT Status fmi2SetDebugLogging(Component c, int on, size_t count, const char *const categories[]) {
    Instance *i = c;
    size_t n;
    int events = on && (!count && !IS(LOG_NEEDS_CATEGORY) || IS(LOG_UNFILTERED));
    if (IS(DEBUG_LOGGING) && count) return fail(i, "no such category");
    for (n = 0; n < count; n++) {
        /* Index of a category. */
        static const char *const known[] = {"logEvents", "logStatusError", NULL};
        int k = 0;
        while (IS(LOG_UNKNOWN) ? strcmp(known[k], categories[n]) : known[k] && strcmp(known[k], categories[n])) k++;
        if (!known[k]) return fail(i, "no such category");
        events |= on && k == 0;
    }
    /* Errors are logged in any case, all else is of one category. */
    if (!IS(LOG_STAYS) || on) i->logging = events;
    return OK;
}

static int count_of(const Values *s) { return (int)floor(s->time * 10 + 1e-6); }
/* Faster than 1 m/s, which begins and ends within the second of the default experiment. */
static int moving(const Values *s) { return fabs(s->v) > 1; }
static int level(const Values *s) { return s->x > 0.5 ? 3 : s->x > 0 ? 2 : 1; }

static void remember(Values *s) {
    s->before[0] = count_of(s);
    s->before[1] = moving(s);
    s->before[2] = level(s);
}

static Status in(Instance *i, int phases, const char *call) {
    if (!i && !IS(NULL_CRASH)) return ERROR;
    return i->values.phase & phases ? OK : fail(i, call);
}

EXPORT Status fmi2SetupExperiment(Component c, int has_tolerance, double tolerance, double begin, int has_stop,
                                  double stop) {
    Instance *i = c;
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    if (!i) return ERROR;
    if (!IS(INIT_ORDER) && in(i, INSTANTIATED, "fmi2SetupExperiment")) return ERROR;
    if (IS(TOLERANCE) && has_tolerance) return fail(i, "no tolerance is used");
    if (IS(ENDLESS) && !has_stop) return fail(i, "a stop time is needed");
    if (!IS(START_TIME)) i->values.time = begin;
    if (has_stop && !IS(STOP_TIME)) i->values.stop = stop;
    return OK;
}

EXPORT Status fmi2EnterInitializationMode(Component c) {
    Instance *i = c;
    if (in(i, INSTANTIATED, "fmi2EnterInitializationMode")) return ERROR;
    if (IS(GLOBAL)) global_w = 0;
    if (IS(INITIAL_KEPT) && i->initialised) i->values.x = i->first_x;
    if (IS(KEPT)) kept_k = i->values.k;
    i->values.first_k = i->values.k;
    i->values.phase = INITIALIZING;
    return OK;
}

EXPORT Status fmi2ExitInitializationMode(Component c) {
    Instance *i = c;
    if (in(i, INITIALIZING, "fmi2ExitInitializationMode")) return ERROR;
    if (IS(INITIALISE)) return fail(i, "no solution");
    if (IS(INPUTS_LOST)) i->values.F = 0;
    if (IS(PARAMETERS_LOST)) i->values.k = i->values.first_k;
    if (IS(INITIAL_STATIC)) {
        static double first;
        static int there;
        if (!there++) first = i->values.x;
        i->values.x = first;
    }
    i->first_x = i->values.x;
    i->initialised = 1;
    i->values.shown = i->values.v;
    remember(&i->values);
    log_text(i, OK, IS(LOG_CATEGORY) ? "logChatter" : "logEvents", "initialised", i->values.x);
    i->values.phase = STEPPING;
    return OK;
}

EXPORT Status fmi2Terminate(Component c) {
    Instance *i = c;
    if (IS(TERMINATE) && i) return fail(i, "cannot end");
    if (in(i, STEPPING, "fmi2Terminate")) return ERROR;
    log_text(i, OK, "logEvents", "terminated", i->values.time);
    i->values.phase = TERMINATED;
    return OK;
}

#if !DEFECT_SYMBOL_MISSING
EXPORT Status fmi2Reset(Component c) {
    Instance *i = c;
    if (!i) return ERROR;
    double w = i->values.w, k = i->values.k, slope = i->values.slope;
    char label[sizeof i->values.label];
    memcpy(label, i->values.label, sizeof label);
    if (IS(RESET_EARLY) && i->values.phase == INITIALIZING) return fail(i, "not initialised yet");
    if (IS(RESET_CRASH)) *(volatile int *)8 = 1;
    if (IS(TERMINATED_RESET) && i->values.phase == TERMINATED) return fail(i, "already ended");
    if (IS(RESET_SOLVER)) i->warm = i->values.v;
    start(&i->values);
    i->kept_label = NULL;
    if (IS(RESET_LABEL)) memcpy(i->values.label, label, sizeof label);
    if (IS(RESET_SLOPE)) i->values.slope = slope;
    if (IS(RESET_FORGETS)) i->values.w = w;
    if (IS(RESET_PARAMETER)) i->values.k = k;
    return OK;
}
#endif

static double acceleration(const Instance *i, double x, double v, double w) {
    const Values *s = &i->values;
    double late = IS(STATE_LATE) && s->elapsed > 0.8 ? 0.5 : 0;
    return s->F - (IS(PARAMETERS_LATE) ? s->first_k : s->k) * x - s->d * v - 0.2 * w + 0.1 * s->on + 0.01 * s->mode + late;
}

static void rate(const Instance *i, const double s[3], double after, double d[3]) {
    d[0] = s[1];
    d[1] = acceleration(i, s[0], s[1], s[2]) + (IS(SLOPE_STATE) ? 2 : IS(SLOPE_AGAINST) ? -1 : 1) * i->values.slope * after;
    d[2] = s[1] - s[2];
}

static void integrate(Instance *i, double span) {
    Values *s = &i->values;
    int count = (int)ceil(span / 1e-3 - 1e-9), n, j;
    double h = span / (count > 0 ? count : 1);
    for (n = 0; n < count; n++) {
        double a[3] = {s->x, s->v, W(i)}, b[3], k1[3], k2[3], k3[3], k4[3];
        rate(i, a, n * h, k1);
        for (j = 0; j < 3; j++) b[j] = a[j] + 0.5 * h * k1[j];
        rate(i, b, (n + 0.5) * h, k2);
        for (j = 0; j < 3; j++) b[j] = a[j] + 0.5 * h * k2[j];
        rate(i, b, (n + 0.5) * h, k3);
        for (j = 0; j < 3; j++) b[j] = a[j] + h * k3[j];
        rate(i, b, (n + 1) * h, k4);
        for (j = 0; j < 3; j++) a[j] += h / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j]);
        s->x = a[0], s->v = a[1], W(i) = a[2];
    }
}

static int overflow(int depth) {
    volatile char page[4096];
    page[0] = (char)depth;
    return overflow(depth + 1) + page[0];
}

EXPORT Status fmi2DoStep(Component c, double point, double step, int no_set_prior) {
    Instance *i = c;
    Values *s = &i->values;
    if (IS(EARLY_CRASH) && i && s->phase == INSTANTIATED) *(volatile int *)8 = 1;
    int phases = STEPPING | (IS(EARLY) ? INSTANTIATED | INITIALIZING : 0) | (IS(LATE) ? TERMINATED : 0);
    if (in(i, phases, "fmi2DoStep")) return ERROR;
    if (step < 0 && !IS(NEGATIVE)) return fail(i, "negative step");
    if (!IS(WRONG_POINT) && !(step < 0) && fabs(point - s->time) > 1e-9 * fmax(1, fabs(point)))
        return fail(i, "wrong communication point");
    if (IS(EXACT_POINT) && fabs(point - s->time) > 3e-16) return fail(i, "another communication point");
    if (IS(EXACT_STOP) && point + step > s->stop) return fail(i, "past the stop time");
    if (IS(ONE_SIZE) && s->last_step > 0 && step > 0 && fabs(step - s->last_step) > 0.1 * s->last_step)
        return fail(i, "another step size");
    if (point + step > s->stop + 1e-9 * fmax(1, s->stop)) return fail(i, "past the stop time");
    if (IS(STEP_FAILS) && point > 0.5) return fail(i, "no convergence");
    HOOK();
    if (IS(STEP_CRASH)) *(volatile int *)8 = 1;
    if (IS(STEP_ABORT)) abort();
    if (IS(STEP_EXIT)) exit(3);
    if (IS(STEP_EXIT_ZERO)) exit(0);
    if (IS(STEP_HANG)) for (;;) sleep(1);
    if (IS(STEP_MEMORY)) for (;;) *(volatile char *)malloc(100 << 20) = 1;
    if (IS(STEP_STACK)) return overflow(0);
    if (IS(PENDING)) return PENDING_STATUS;
    if (IS(STATUS_NUMBER)) return 42;
    if (IS(NAN_INPUT) && !isfinite(s->F)) abort();
    if (IS(NAN_HANG)) while (!(fabs(s->F) < 1e9)) sleep(1);
    if (IS(ZERO)) s->v += 0 * (1 / step);
    if (IS(MAPPED)) mmap(NULL, 1 << 16, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (IS(STEP_LEAK)) {
        void **block = malloc(100);
        *block = i->leaks;
        i->leaks = block;
    }
    if (IS(THREADS)) {
        int n;
        scratch = s->v;
        for (n = 0; n < 3; n++) sched_yield();
        s->v = scratch;
    }
    if (IS(STDOUT)) printf("step to %g\n", point + step);
    if (IS(FILES)) {
        FILE *file = fopen("trace.log", "a");
        if (file) fclose(file);
    }
    if (IS(FIXED_DRIFTS)) s->k += 0.1 * step;
    if (IS(STATE_PROMISE) && !no_set_prior) s->spare = 1;
    if (IS(DISK)) {
        static char block[1 << 20];
        int n;
        for (n = 0; n < 1000; n++) {
            char name[64];
            snprintf(name, sizeof name, "fill%d", n);
            FILE *file = fopen(name, "w");
            if (file) fwrite(block, 1, sizeof block, file), fclose(file);
        }
    }
    if (IS(LOG_FOREIGN)) i->callbacks.logger(&i->values, i->name, OK, "logEvents", "step to %g", point + step);
    if (IS(FORGES)) {
        int fd;
        for (fd = 3; fd < 100; fd++) {
            if (write(fd, "{\"findings\":[]}", 15) < 0) continue;
        }
    }
    if (no_set_prior) i->promised = 1;
    if (no_set_prior) i->promises++;
    i->begun = point;
    remember(s);
    /* Within the tolerance: what a solver does otherwise that goes on with an old derivative. */
    s->v += 1e-7 * i->warm;
    i->warm = 0;
    s->shown = s->v;
    s->elapsed += step;
    double span = step;
    if (IS(STEP_IGNORED)) span = 0.01;
    if (IS(STEP_ALTERNATE)) span = s->calls % 2 ? 0 : 2 * step;
    if (IS(VARIABLE) && s->last_step > 0 && step > 0.1 * s->last_step) span = s->last_step;
    s->last_step = step;
    if (!IS(HANDOVER) || pthread_equal(i->thread, pthread_self())) integrate(i, span);
    if (!IS(OUTPUT_BEHIND)) s->shown = s->v;
    if (IS(DEPENDENCY_STEP)) s->shown = s->v + 0.05 * s->F;
    s->F += (IS(SLOPE_FEEDTHROUGH) ? 2 : 1) * s->slope * step;
    s->slope = 0;
    s->calls++;
    s->sets = 0;
    if (IS(RANDOM)) {
        struct timespec now;
        clock_gettime(CLOCK_MONOTONIC, &now);
        s->noise = 1e-9 * (double)now.tv_nsec;
    }
    s->time = point + step;
    return OK;
}

static double der_v(const Instance *i) { return acceleration(i, i->values.x, i->values.v, W(i)); }

EXPORT Status fmi2GetReal(Component c, const uint32_t r[], size_t count, double value[]) {
    Instance *i = c;
    Values *s = &i->values;
    size_t n;
    if (in(i, INITIALIZING | STEPPING | (IS(TERMINATED_GET) ? 0 : TERMINATED), "fmi2GetReal")) return ERROR;
    if (IS(GET_INITIAL) && s->phase == INITIALIZING) return fail(i, "not initialised yet");
    if (IS(EMPTY_CALL) && !value) return fail(i, "null pointer");
    if (IS(GET_BEHIND) && count) value[count] = 0;
    if (IS(REFERENCES_CHANGED) && count > 1) ((uint32_t *)r)[0] = r[1];
    for (n = 0; n < count; n++) {
        switch (IS(REFERENCE_CUT) ? (uint16_t)r[n] : r[n]) {
        case 0: value[n] = s->time - (IS(TIME) ? s->last_step : 0); break;
        case 1: value[n] = s->x; break;
        case 2:
            if (IS(UNREADABLE)) return fail(i, "unknown reference");
            value[n] = s->v;
            break;
        case 3: value[n] = (IS(DERIVATIVE) ? 2 : 1) * s->v; break;
        case 4: value[n] = der_v(i); break;
        case 5: value[n] = s->F; break;
        case 6: value[n] = s->x + 0.1 * s->F + s->noise + s->offset + (IS(NOT_CONSTANT) ? 0.5 * s->F * s->F : 0); break;
        case 7:
            value[n] = s->v;
            if ((IS(OUTPUT_BEHIND) || IS(DEPENDENCY_STEP)) && s->phase != INITIALIZING) value[n] = s->shown;
            if (IS(TIME_HIDDEN)) value[n] += sin(s->time);
            if (IS(START_CLOCK)) value[n] += sin(s->elapsed);
            if (IS(CONVERGENCE)) value[n] += 1e-2 * s->calls;
            if (IS(DEPENDENCY)) value[n] += 0.05 * s->F;
            if (IS(NAN_OUTPUT) && s->time > 0.05) value[n] = NAN;
            if (IS(GET_EFFECT)) s->x += 1e-6;
            break;
        case 8: value[n] = s->k; break;
        case 9: value[n] = s->d; break;
        case 10: value[n] = s->g; break;
        default:
            if (IS(BAD_GET_CRASH)) value[n] = ((volatile double *)s)[r[n]];
            if (!IS(BAD_GET)) return fail(i, "unknown reference");
        }
    }
    return OK;
}

EXPORT Status fmi2GetInteger(Component c, const uint32_t r[], size_t count, int value[]) {
    Instance *i = c;
    Values *s = &i->values;
    size_t n;
    if (in(i, INITIALIZING | STEPPING | TERMINATED, "fmi2GetInteger")) return ERROR;
    for (n = 0; n < count; n++) {
        switch (r[n]) {
        case 0: value[n] = IS(INTEGER_BEHIND) && s->phase != INITIALIZING ? s->before[0] : count_of(s); break;
        case 1: value[n] = s->mode; break;
        case 2:
            value[n] = IS(ENUMERATION_BEHIND) && s->phase != INITIALIZING ? s->before[2] : level(s);
            if (IS(RANGE) || IS(ENUMERATION) && s->F > 0.01) value[n] = 7;
            break;
        default: return fail(i, "unknown reference");
        }
    }
    return OK;
}

EXPORT Status fmi2GetBoolean(Component c, const uint32_t r[], size_t count, int value[]) {
    Instance *i = c;
    Values *s = &i->values;
    size_t n;
    if (in(i, INITIALIZING | STEPPING | TERMINATED, "fmi2GetBoolean")) return ERROR;
    for (n = 0; n < count; n++) {
        switch (r[n]) {
        case 0: value[n] = s->on; break;
        case 1:
            value[n] = IS(BOOLEAN_BEHIND) && s->phase != INITIALIZING ? s->before[1] : moving(s);
            if (value[n] && (IS(BOOLEAN) || IS(BOOLEAN_LATE) && s->time > 0.5)) value[n] = -1;
            break;
        default: return fail(i, "unknown reference");
        }
    }
    return OK;
}

static const char *text_of(const Values *s) { return moving(s) ? "moving" : "at rest"; }

/* A text that is longer than a host makes room for ahead. */
static const char *long_text(const Values *s) {
    static const int length = 100000;
    char *text = malloc(length + 1);
    memset(text, text_of(s)[0], length);
    text[length] = 0;
    return text;
}

/* A text in memory that the next call takes. */
static const char *on_the_stack(const char *text) {
    char copy[64];
    char *volatile gone = copy;
    snprintf(copy, sizeof copy, "%s", text);
    return gone;
}

EXPORT Status fmi2GetString(Component c, const uint32_t r[], size_t count, const char *value[]) {
    Instance *i = c;
    Values *s = &i->values;
    size_t n;
    if (in(i, INITIALIZING | STEPPING | TERMINATED, "fmi2GetString")) return ERROR;
    for (n = 0; n < count; n++) {
        if (IS(STRING_BUFFER) && r[n] < 2) {
            snprintf(buffer, sizeof buffer, "%s", r[n] ? text_of(s) : s->label);
            value[n] = buffer;
            continue;
        }
        if ((IS(STRING_FREED) || IS(STRING_STACK)) && r[n] < 2) {
            const char *text = r[n] ? text_of(s) : s->label;
            if (IS(STRING_STACK)) {
                value[n] = on_the_stack(text);
                continue;
            }
            char *copy = strdup(text);
            free(copy);
            value[n] = copy;
            continue;
        }
        if ((IS(STRING_LONG) || IS(STRING_LONG_FREED)) && r[n] == 1) {
            free(i->small);
            value[n] = i->small = (char *)long_text(s);
            if (IS(STRING_LONG_FREED)) free(i->small), i->small = NULL;
            continue;
        }
        switch (r[n]) {
        case 0: value[n] = IS(STRING_KEPT) && i->kept_label ? i->kept_label : s->label; break;
        case 1: value[n] = IS(STRING_NULL) ? NULL : IS(STRING_LATIN) ? "bewegt \xe4" : text_of(s); break;
        default: return fail(i, "unknown reference");
        }
    }
    return OK;
}

EXPORT Status fmi2SetReal(Component c, const uint32_t r[], size_t count, const double value[]) {
    Instance *i = c;
    if (!i) return ERROR;
    Values *s = &i->values;
    size_t n;
    if (IS(SET_BEHIND) && count) scratch = value[count];
    for (n = 0; n < count; n++) {
        int before = s->phase == INSTANTIATED || s->phase == INITIALIZING;
        switch (r[n]) {
        case 1:
            if (!before || IS(START_REFUSED)) return fail(i, "x is not to be set now");
            s->x = value[n];
            break;
        case 2:
            if (!before) return fail(i, "v is not to be set now");
            s->v = value[n];
            break;
        case 5:
            if (IS(SET_ONCE) && s->sets++) break;
            s->F = IS(SET_GET) ? (double)(float)value[n] : value[n];
            break;
        case 8:
            if (!before && !IS(FIXED_ACCEPTED)) return fail(i, "k is fixed");
            if (IS(PARAMETERS_REFUSED) && s->phase == INITIALIZING) return fail(i, "k is fixed now");
            s->k = value[n] + (IS(SET_WRONG) ? 0.1 : 0);
            if (IS(SET_ORDER)) s->d = 0.06 * s->k;
            break;
        case 9:
            if (!before && IS(TUNABLE_REFUSED)) return fail(i, "d is not to be set now");
            if (!IS(TUNABLE_IGNORED) || before) s->d = value[IS(SET_FIRST) ? 0 : n];
            break;
        case 10: return fail(i, "g is constant");
        default:
            if (!IS(BAD_SET)) return fail(i, "unknown reference");
        }
    }
    return OK;
}

EXPORT Status fmi2SetInteger(Component c, const uint32_t r[], size_t count, const int value[]) {
    Instance *i = c;
    size_t n;
    for (n = 0; n < count; n++) {
        if (r[n] != 1) return fail(i, "unknown reference");
        i->values.mode = value[n];
    }
    return OK;
}

EXPORT Status fmi2SetBoolean(Component c, const uint32_t r[], size_t count, const int value[]) {
    Instance *i = c;
    size_t n;
    for (n = 0; n < count; n++) {
        if (r[n] != 0) return fail(i, "unknown reference");
        i->values.on = value[n] != 0;
    }
    return OK;
}

EXPORT Status fmi2SetString(Component c, const uint32_t r[], size_t count, const char *const value[]) {
    Instance *i = c;
    size_t n;
    for (n = 0; n < count; n++) {
        if (r[n] != 0) return fail(i, "unknown reference");
        if (i->values.phase == STEPPING) return fail(i, "label is fixed");
        if (!IS(STRING_SHORT) && strlen(value[n]) >= sizeof i->values.label) return fail(i, "too long a label");
        if (IS(STRING_KEPT)) i->kept_label = value[n];
        snprintf(i->values.label, IS(STRING_CUT) ? 6 : IS(STRING_SHORT) ? 32 : sizeof i->values.label, "%s", value[n]);
        if (IS(STRING_OVERFLOW)) strcpy(i->small, value[n]);
    }
    return OK;
}

typedef struct {
    Values values;
    double w;
    int promises, restored;
} Saved;

EXPORT Status fmi2GetFMUstate(Component c, State *state) {
    Instance *i = c;
    if (IS(STATE_LEAK) && !malloc(1000)) return ERROR;
    if (!*state) *state = IS(STATE_SHARED) ? (void *)&shared_state : calloc(1, sizeof(Saved));
    Saved *saved = *state;
    if (IS(STATE_EFFECT)) i->values.v *= 0.9;
    saved->values = i->values;
    if (!IS(STATE_SHARED)) saved->promises = i->promises, saved->restored = 0;
    if (!IS(STATE_SHARED)) saved->w = W(i);
    return OK;
}

EXPORT Status fmi2SetFMUstate(Component c, State state) {
    Instance *i = c;
    Saved *saved = state;
    double w = i->values.w, F = i->values.F, elapsed = i->values.elapsed, spare = i->values.spare;
    if (!saved) return fail(i, "null state");
    if (IS(STATE_SOLVER)) i->warm = i->values.v;
    i->values = saved->values;
    if (IS(STATE_PROMISED) && i->promised) i->values.w = w;
    if (IS(STATE_DROPPED) && i->promises > saved->promises) i->values.w = w;
    if (IS(STATE_REDONE) && i->promises > saved->promises && saved->restored++) i->values.w = w;
    if (IS(STATE_FALSE_IGNORED) && saved->values.time < i->begun) i->values.w = w;
    if (IS(STATE_LATE)) i->values.elapsed = elapsed;
    if (IS(STATE_PROMISE) && spare) i->values.w = w;
    if (IS(STATE_ONCE)) saved->values.v = 0;
    if (IS(GLOBAL)) global_w = saved->w;
    if (IS(STATE_FORGETS)) i->values.w = w;
    if (IS(STATE_INPUT)) i->values.F = F;
    return OK;
}

EXPORT Status fmi2FreeFMUstate(Component c, State *state) {
    (void)c;
    if (!state || !*state) return OK;
    if (*state != (State)&shared_state) free(*state);
    *state = IS(STATE_HANDLE) ? (State)8 : NULL;
    return OK;
}

EXPORT Status fmi2SerializedFMUstateSize(Component c, State state, size_t *size) {
    (void)c, (void)state;
    *size = IS(SERIALISE_POINTER) ? sizeof(State) + sizeof(Saved) : sizeof(Saved);
    return OK;
}

EXPORT Status fmi2SerializeFMUstate(Component c, State state, char bytes[], size_t size) {
    Instance *i = c;
    if (size < sizeof(Saved)) return fail(i, "too small");
    memcpy(bytes, state, sizeof(Saved));
    if (IS(SERIALISE)) ((Saved *)bytes)->values.w = 0;
    if (IS(SERIALISE_PARAMETER)) ((Saved *)bytes)->values.k = 10;
    if (IS(SERIALISE_POINTER)) memcpy(bytes + sizeof(Saved), &i, sizeof i);
    return OK;
}

EXPORT Status fmi2DeSerializeFMUstate(Component c, const char bytes[], size_t size, State *state) {
    Instance *i = c;
    if (size < sizeof(Saved)) return fail(i, "too small");
    if (!*state) *state = malloc(sizeof(Saved));
    memcpy(*state, bytes, sizeof(Saved));
    if (IS(SERIALISE_POINTER)) {
        Instance *other;
        memcpy(&other, bytes + sizeof(Saved), sizeof other);
        if (other != i) ((Saved *)*state)->values = other->values;
    }
    return OK;
}

static double partial(const Instance *i, uint32_t unknown, uint32_t known) {
    const Values *s = &i->values;
    switch (unknown * 100 + known) {
    case 302: return IS(DERIVATIVE) ? 2 : 1;
    case 401: return IS(DIRECTIONAL) ? s->k : -s->k;
    case 402: return -s->d;
    case 405: return 1;
    case 601: return 1;
    case 605: return 0.1 + (IS(NOT_CONSTANT) ? s->F : 0);
    case 702: return 1;
    case 705: return IS(DEPENDENCY) ? 0.05 : 0;
    default: return 0;
    }
}

EXPORT Status fmi2GetDirectionalDerivative(Component c, const uint32_t unknown[], size_t unknowns, const uint32_t known[],
                                           size_t knowns, const double seed[], double value[]) {
    size_t n, m;
    for (n = 0; n < unknowns; n++)
        for (value[n] = 0, m = 0; m < knowns; m++) value[n] = (IS(DIRECTIONAL_SEVERAL) ? 0 : value[n]) + partial(c, unknown[n], known[m]) * seed[m];
    return OK;
}

EXPORT Status fmi2SetRealInputDerivatives(Component c, const uint32_t r[], size_t count, const int order[],
                                          const double value[]) {
    Instance *i = c;
    size_t n;
    if (IS(INPUT_DERIVATIVE)) return fail(c, "not implemented");
    for (n = 0; n < count; n++) {
        if (r[n] != 5 || order[n] != 1) return fail(i, "no such derivative");
        if (!IS(SLOPE_IGNORED)) i->values.slope = (IS(SLOPE_DOUBLED) ? 2 : 1) * value[n];
    }
    return OK;
}

EXPORT Status fmi2GetRealOutputDerivatives(Component c, const uint32_t r[], size_t count, const int order[],
                                           double value[]) {
    Instance *i = c;
    size_t n;
    for (n = 0; n < count; n++) {
        if (order[n] != 1) return fail(i, "order");
        value[n] = IS(OUTPUT_DERIVATIVE) ? NAN : (IS(SLOPE_SIGN) ? -1 : 1) * (r[n] == 6 ? i->values.v : der_v(i));
    }
    return OK;
}

EXPORT Status fmi2CancelStep(Component c) {
    if (IS(CANCEL)) *(volatile int *)8 = 1;
    return fail(c, "no step to cancel");
}
EXPORT Status fmi2GetStatus(Component c, int kind, Status *value) { (void)c, (void)kind, (void)value; return DISCARD; }
EXPORT Status fmi2GetRealStatus(Component c, int kind, double *value) {
    if (kind != 2) return DISCARD;
    *value = ((Instance *)c)->values.time;
    return OK;
}
EXPORT Status fmi2GetIntegerStatus(Component c, int kind, int *value) { (void)c, (void)kind, (void)value; return DISCARD; }
EXPORT Status fmi2GetBooleanStatus(Component c, int kind, int *value) {
    (void)c;
    if (kind != 3) return DISCARD;
    *value = 0;
    return OK;
}
#if !DEFECT_SYMBOL_OPTIONAL
EXPORT Status fmi2GetStringStatus(Component c, int kind, const char **value) { (void)c, (void)kind, (void)value; return DISCARD; }
#endif
