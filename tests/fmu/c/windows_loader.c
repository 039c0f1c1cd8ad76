/* loader.exe LIBRARY URI GUID N: outputs of N steps on the input of driver.c, one per line. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <windows.h>

typedef void *(*Instantiate)(const char *, int, const char *, const char *, const void *, int, int);
typedef int (*Setup)(void *, int, double, double, int, double);
typedef int (*Plain)(void *);
typedef int (*Set)(void *, const unsigned *, size_t, const double *);
typedef int (*Get)(void *, const unsigned *, size_t, double *);
typedef int (*DoStep)(void *, double, double, int);

static HMODULE library;

/* Put a function's address into a pointer to it. */
static void find(const char *name, void *function) {
    FARPROC found = GetProcAddress(library, name);
    if (found == NULL) {
        printf("%s is missing\n", name);
        exit(1);
    }
    memcpy(function, &found, sizeof found);
}

static void complain(void *environment, const char *instance, int status, const char *category,
                     const char *message, ...) {
    (void)environment, (void)instance, (void)status, (void)category;
    puts(message);
}

int main(int count, char **arguments) {
    struct {
        void (*logger)(void *, const char *, int, const char *, const char *, ...);
        void *others[4];
    } callbacks = {complain, {NULL, NULL, NULL, NULL}};
    library = count == 5 ? LoadLibraryA(arguments[1]) : NULL;
    if (library == NULL) {
        puts("the library does not load");
        return 1;
    }
    Instantiate instantiate;
    Setup setup;
    Plain enter, leave;
    Set set;
    Get get;
    DoStep step;
    find("fmi2Instantiate", &instantiate);
    find("fmi2SetupExperiment", &setup);
    find("fmi2EnterInitializationMode", &enter);
    find("fmi2ExitInitializationMode", &leave);
    find("fmi2SetReal", &set);
    find("fmi2GetReal", &get);
    find("fmi2DoStep", &step);
    void *c = instantiate("one", 1, arguments[3], arguments[2], &callbacks, 0, 0);
    if (c == NULL || setup(c, 0, 0, 0, 0, 0) || enter(c) || leave(c)) {
        return 1;
    }
    const unsigned input = 0, output = 1;
    for (int k = 0; k < atoi(arguments[4]); ++k) {
        double value = (k % 21 - 10) / 10.0;
        if (set(c, &input, 1, &value) || step(c, k * 0.005, 0.005, 1) ||
            get(c, &output, 1, &value)) {
            return 1;
        }
        printf("%.9g\n", value);
    }
    return 0;
}
