/* importer LIBRARY STANDARD RESOURCES GUID STEPS N_INPUTS N_OUTPUTS: a small importer in C for every
 * platform. Runs an FMU of FMI 2 or 3 on made-up inputs, with steps of one, two and 0.6 sample
 * steps of 5 ms, and prints all outputs after each step, exactly. RESOURCES: a URI; for FMI 3 a
 * path with percent escapes, because Windows changes other arguments than plain ASCII. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#include <windows.h>
#else
#include <dlfcn.h>
#endif

enum { LARGEST_COUNT = 64 };

static void *library;

static void *open_library(const char *path) {
#if defined(_WIN32)
    return (void *)LoadLibraryA(path);
#else
    return dlopen(path, RTLD_NOW | RTLD_LOCAL);
#endif
}

/* Put a function's address into a pointer to it. */
static void find(const char *name, void *function) {
#if defined(_WIN32)
    FARPROC found = GetProcAddress((HMODULE)library, name);
#else
    void *found = dlsym(library, name);
#endif
    if (found == NULL) {
        printf("%s is missing\n", name);
        exit(1);
    }
    memcpy(function, &found, sizeof found);
}

static void complain_2(void *environment, const char *instance, int status, const char *category,
                       const char *message, ...) {
    (void)environment, (void)instance, (void)status, (void)category;
    puts(message);
}

static void complain_3(void *environment, int status, const char *category, const char *message) {
    (void)environment, (void)status, (void)category;
    puts(message);
}

/* The calls of a standard: an instance in step mode, and what is done with it. */
static void *start_2(const char *guid, const char *resources) {
    static struct {
        void (*logger)(void *, const char *, int, const char *, const char *, ...);
        void *others[4];
    } callbacks = {complain_2, {NULL, NULL, NULL, NULL}};
    void *(*instantiate)(const char *, int, const char *, const char *, const void *, int, int);
    int (*setup)(void *, int, double, double, int, double);
    int (*enter)(void *), (*leave)(void *);
    find("fmi2Instantiate", &instantiate);
    find("fmi2SetupExperiment", &setup);
    find("fmi2EnterInitializationMode", &enter);
    find("fmi2ExitInitializationMode", &leave);
    void *c = instantiate("one", 1, guid, resources, &callbacks, 0, 0);
    return c == NULL || setup(c, 0, 0, 0, 0, 0) || enter(c) || leave(c) ? NULL : c;
}

/* Replace percent escapes in place. */
static void unescape(char *text) {
    char *to = text;
    for (const char *from = text; *from != '\0'; ++to) {
        char digits[3] = {0};
        if (*from == '%') {
            memcpy(digits, from + 1, 2);
            *to = (char)strtol(digits, NULL, 16);
            from += 3;
        } else {
            *to = *from++;
        }
    }
    *to = '\0';
}

static void *start_3(const char *guid, char *resources) {
    void *(*instantiate)(const char *, const char *, const char *, _Bool, _Bool, _Bool, _Bool,
                         const unsigned *, size_t, void *,
                         void (*)(void *, int, const char *, const char *), void *);
    int (*enter)(void *, _Bool, double, double, _Bool, double), (*leave)(void *);
    find("fmi3InstantiateCoSimulation", &instantiate);
    find("fmi3EnterInitializationMode", &enter);
    find("fmi3ExitInitializationMode", &leave);
    unescape(resources);
    void *c =
        instantiate("one", guid, resources, 0, 0, 0, 0, NULL, 0, NULL, complain_3, NULL);
    return c == NULL || enter(c, 0, 0, 0, 0, 0) || leave(c) ? NULL : c;
}

static int set(int standard, void *c, const unsigned *references, size_t n, const double *values) {
    int (*set_2)(void *, const unsigned *, size_t, const double *);
    int (*set_3)(void *, const unsigned *, size_t, const double *, size_t);
    if (standard == 2) {
        find("fmi2SetReal", &set_2);
        return set_2(c, references, n, values);
    }
    find("fmi3SetFloat64", &set_3);
    return set_3(c, references, n, values, n);
}

static int get(int standard, void *c, const unsigned *references, size_t n, double *values) {
    int (*get_2)(void *, const unsigned *, size_t, double *);
    int (*get_3)(void *, const unsigned *, size_t, double *, size_t);
    if (standard == 2) {
        find("fmi2GetReal", &get_2);
        return get_2(c, references, n, values);
    }
    find("fmi3GetFloat64", &get_3);
    return get_3(c, references, n, values, n);
}

static int do_step(int standard, void *c, double time, double length) {
    int (*step_2)(void *, double, double, int);
    int (*step_3)(void *, double, double, _Bool, _Bool *, _Bool *, _Bool *, double *);
    _Bool event, terminate, early;
    double last;
    if (standard == 2) {
        find("fmi2DoStep", &step_2);
        return step_2(c, time, length, 1);
    }
    find("fmi3DoStep", &step_3);
    return step_3(c, time, length, 1, &event, &terminate, &early, &last);
}

int main(int count, char **arguments) {
    static const double lengths[] = {0.005, 0.01, 0.003};
    library = count >= 8 ? open_library(arguments[1]) : NULL;
    if (library == NULL) {
        puts("the library does not load");
        return 1;
    }
    int standard = atoi(arguments[2]), steps = atoi(arguments[5]);
    size_t n_inputs = (size_t)atoi(arguments[6]), n_outputs = (size_t)count - 7;
    if (n_inputs > LARGEST_COUNT || n_outputs > LARGEST_COUNT) {
        return 1;
    }
    void *c = standard == 2 ? start_2(arguments[4], arguments[3])
                            : start_3(arguments[4], arguments[3]);
    unsigned inputs[LARGEST_COUNT], outputs[LARGEST_COUNT];
    double values[LARGEST_COUNT], time = 0;
    for (unsigned i = 0; i < n_inputs; ++i) {
        inputs[i] = i;
    }
    for (size_t i = 0; i < n_outputs; ++i) {
        outputs[i] = (unsigned)atol(arguments[7 + i]);
    }
    for (int k = 0; c != NULL && k < steps; ++k) {
        double length = lengths[k % 3];
        for (size_t i = 0; i < n_inputs; ++i) {
            values[i] = ((k + 7 * (int)i) % 21 - 10) / 10.0;
        }
        if (set(standard, c, inputs, n_inputs, values) || do_step(standard, c, time, length) ||
            get(standard, c, outputs, n_outputs, values)) {
            return 1;
        }
        for (size_t i = 0; i < n_outputs; ++i) {
            printf("%.17g\n", values[i]);
        }
        time += length;
    }
    return c == NULL ? 1 : 0;
}
