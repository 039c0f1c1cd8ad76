/* Many threads, many lives, many steps: linked with a library of the runtime, or with its sources.
 *
 *   stress threads RESOURCES GUID STEP SCALE N_INPUTS N_OUTPUTS N_VALUES STEPS
 *       the same run in eight threads at once and alone, in both standards by turns: all values and
 *       derivatives must be the same, bit by bit
 *   stress lives RESOURCES GUID STEP SCALE N_INPUTS N_OUTPUTS N_VALUES COUNT
 *       instances that live for two steps; prints by how many bytes the resident memory has grown
 *       since the first tenth of them
 *   stress long RESOURCES GUID STEP SCALE N_INPUTS N_OUTPUTS N_VALUES STEPS
 *       steps of a periodic input at times that are added up as importers do; prints the time at the
 *       end, and how many values of the last period differ from those of an early one
 *
 * RESOURCES: path of the folder. STEP in s. Inputs are sines of amplitude SCALE. N_VALUES are read:
 * outputs, and error estimates where there are some. */
#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "variables.h"

#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N_THREADS = 8, MOST_VALUES = 64, PERIOD = 40 };

typedef struct {
    char uri[1024];
    const char *path, *guid;
    double step, scale;
    size_t n_inputs, n_values;
    long count;
    uint32_t references[2 * MOST_VALUES];
} Task;

/* An instance of either standard; what goes wrong leaves it failed. */
typedef struct {
    const Task *task;
    int standard;
    void *c;
    bool failed;
} Fmu;

static void expect(Fmu *fmu, int status) { fmu->failed = fmu->failed || status != fmi2OK; }

static Fmu start(const Task *task, int standard) {
    static const fmi2CallbackFunctions silent = {NULL, NULL, NULL, NULL, NULL};
    Fmu fmu = {task, standard, NULL, false};
    if (standard == 2) {
        fmu.c = fmi2Instantiate("one", fmi2CoSimulation, task->guid, task->uri, &silent, 0, 0);
        expect(&fmu, (int)fmi2SetupExperiment(fmu.c, 0, 0, 0, 0, 0));
        expect(&fmu, (int)fmi2EnterInitializationMode(fmu.c));
        expect(&fmu, (int)fmi2ExitInitializationMode(fmu.c));
    } else {
        fmu.c = fmi3InstantiateCoSimulation("one", task->guid, task->path, false, false, false,
                                            false, NULL, 0, NULL, NULL, NULL);
        expect(&fmu, (int)fmi3EnterInitializationMode(fmu.c, false, 0, 0, false, 0));
        expect(&fmu, (int)fmi3ExitInitializationMode(fmu.c));
    }
    return fmu;
}

static void end(Fmu *fmu) {
    if (fmu->standard == 2) {
        fmi2FreeInstance(fmu->c);
    } else {
        fmi3FreeInstance(fmu->c);
    }
}

static void set_inputs(Fmu *fmu, long k) {
    const Task *task = fmu->task;
    double values[MOST_VALUES];
    for (size_t i = 0; i < task->n_inputs; ++i) {
        const double part = (double)(k % PERIOD) / PERIOD + 0.25 * (double)i; /* a circle of two */
        values[i] = task->scale * sin(6.283185307179586 * part);
    }
    const uint32_t *inputs = task->references;
    const size_t n = task->n_inputs;
    expect(fmu, fmu->standard == 2 ? (int)fmi2SetReal(fmu->c, inputs, n, values)
                                   : (int)fmi3SetFloat64(fmu->c, inputs, n, values, n));
}

static void do_step(Fmu *fmu, double time, double length) {
    bool event, terminate, early;
    double last;
    expect(fmu, fmu->standard == 2 ? (int)fmi2DoStep(fmu->c, time, length, 1)
                                   : (int)fmi3DoStep(fmu->c, time, length, true, &event,
                                                     &terminate, &early, &last));
}

static void get_values(Fmu *fmu, double *values) {
    const uint32_t *wanted = fmu->task->references + fmu->task->n_inputs;
    const size_t n = fmu->task->n_values;
    expect(fmu, fmu->standard == 2 ? (int)fmi2GetReal(fmu->c, wanted, n, values)
                                   : (int)fmi3GetFloat64(fmu->c, wanted, n, values, n));
}

static double derivative(Fmu *fmu) {
    const uint32_t *known = fmu->task->references, *unknown = known + fmu->task->n_inputs;
    const double one = 1;
    double slope = 0;
    expect(fmu, fmu->standard == 2
                    ? (int)fmi2GetDirectionalDerivative(fmu->c, unknown, 1, known, 1, &one, &slope)
                    : (int)fmi3GetDirectionalDerivative(fmu->c, unknown, 1, known, 1, &one, 1,
                                                        &slope, 1));
    return slope;
}

static void save(Fmu *fmu, void **state) {
    expect(fmu, fmu->standard == 2 ? (int)fmi2GetFMUstate(fmu->c, state)
                                   : (int)fmi3GetFMUState(fmu->c, state));
}

static void go_back(Fmu *fmu, void *state) {
    expect(fmu, fmu->standard == 2 ? (int)fmi2SetFMUstate(fmu->c, state)
                                   : (int)fmi3SetFMUState(fmu->c, state));
}

static void free_state(Fmu *fmu, void **state) {
    expect(fmu, fmu->standard == 2 ? (int)fmi2FreeFMUstate(fmu->c, state)
                                   : (int)fmi3FreeFMUState(fmu->c, state));
}

/* A number that tells these values from others (FNV-1a). */
static uint64_t mix(uint64_t digest, const void *data, size_t size) {
    for (size_t i = 0; i < size; ++i) {
        digest = (digest ^ ((const unsigned char *)data)[i]) * 0x100000001B3u;
    }
    return digest;
}

/* What a run gives: steps of several lengths, values, derivatives, and back again. 0: failed. */
static uint64_t run(const Task *task, int standard) {
    static const double parts[] = {1, 1, 0.5, 2, 0.5, 0.6, 1};
    Fmu fmu = start(task, standard);
    uint64_t digest = 0xCBF29CE484222325u;
    double values[MOST_VALUES], time = 0;
    void *state = NULL;
    for (long k = 0; !fmu.failed && k < task->count; ++k) {
        const double length = parts[k % 7] * task->step;
        set_inputs(&fmu, k);
        if (k % 10 == 3) {
            save(&fmu, &state);
            do_step(&fmu, time, 3 * length);
            go_back(&fmu, state);
        }
        do_step(&fmu, time, length);
        time += length;
        get_values(&fmu, values);
        digest = mix(digest, values, task->n_values * sizeof *values);
        if (k % 5 == 0) {
            const double slope = derivative(&fmu);
            digest = mix(digest, &slope, sizeof slope);
        }
    }
    free_state(&fmu, &state);
    end(&fmu);
    return fmu.failed ? 0 : digest;
}

typedef struct {
    const Task *task;
    int standard;
    uint64_t digest;
} Thread;

static void *run_in_thread(void *argument) {
    Thread *thread = argument;
    thread->digest = run(thread->task, thread->standard);
    return NULL;
}

static int in_threads(const Task *task) {
    pthread_t ids[N_THREADS];
    Thread threads[N_THREADS];
    const uint64_t alone = run(task, 2);
    for (int i = 0; i < N_THREADS; ++i) {
        threads[i] = (Thread){task, 2 + i % 2, 0};
        if (pthread_create(&ids[i], NULL, run_in_thread, &threads[i]) != 0) {
            return 1;
        }
    }
    bool same = alone != 0;
    for (int i = 0; i < N_THREADS; ++i) {
        pthread_join(ids[i], NULL);
        same = same && threads[i].digest == alone;
    }
    puts(same ? "same" : "different");
    return same ? 0 : 1;
}

/* Of this process, in pages; 0 where the system does not tell. */
static long resident_pages(void) {
    long size = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file != NULL) {
        resident = fscanf(file, "%ld %ld", &size, &resident) == 2 ? resident : 0;
        fclose(file);
    }
    return resident;
}

static int in_many_lives(const Task *task) {
    long before = 0;
    bool failed = false;
    for (long k = 0; k < task->count && !failed; ++k) {
        Fmu fmu = start(task, 2 + (int)(k % 2));
        double values[MOST_VALUES];
        void *state = NULL;
        before = k == task->count / 10 ? resident_pages() : before;
        set_inputs(&fmu, k);
        do_step(&fmu, 0, task->step);
        save(&fmu, &state);
        do_step(&fmu, task->step, 1.5 * task->step);
        get_values(&fmu, values);
        go_back(&fmu, state);
        free_state(&fmu, &state);
        end(&fmu);
        failed = fmu.failed;
    }
    printf("%ld\n", 4096 * (resident_pages() - before));
    return failed ? 1 : 0;
}

static int for_long(const Task *task) {
    static double early[PERIOD][MOST_VALUES], late[PERIOD][MOST_VALUES];
    /* what forecasts changed is a mean that forgets its start to the last bit by then */
    const long first = 100 * PERIOD, last = task->count - PERIOD;
    long differing = 0;
    double time = 0;
    Fmu fmu = start(task, 2);
    for (long k = 0; !fmu.failed && k < task->count; ++k) {
        set_inputs(&fmu, k);
        do_step(&fmu, time, task->step);
        time += task->step;
        if (k >= first && k < first + PERIOD) {
            get_values(&fmu, early[k % PERIOD]);
        } else if (k >= last) {
            get_values(&fmu, late[k % PERIOD]);
        }
    }
    for (int k = 0; k < PERIOD; ++k) {
        for (size_t i = 0; i < task->n_values; ++i) {
            differing += !isfinite(late[k][i]) || late[k][i] != early[k][i];
        }
    }
    double reached = -1;
    expect(&fmu, (int)fmi2GetRealStatus(fmu.c, fmi2LastSuccessfulTime, &reached));
    end(&fmu);
    printf("%.17g %ld\n", reached, differing);
    return fmu.failed ? 1 : 0;
}

int main(int count, char **arguments) {
    Task task = {.count = 0};
    if (count != 10) {
        fputs("stress threads|lives|long RESOURCES GUID STEP SCALE N_INPUTS N_OUTPUTS N_VALUES COUNT\n",
              stderr);
        return 2;
    }
    task.path = arguments[2];
    task.guid = arguments[3];
    task.step = atof(arguments[4]);
    task.scale = atof(arguments[5]);
    task.n_inputs = (size_t)atoi(arguments[6]);
    const size_t n_outputs = (size_t)atoi(arguments[7]);
    task.n_values = (size_t)atoi(arguments[8]);
    task.count = atol(arguments[9]);
    if (n_outputs < 1 || task.n_inputs > MOST_VALUES || task.n_values > MOST_VALUES) {
        return 2;
    }
    snprintf(task.uri, sizeof task.uri, "file://%s", task.path);
    for (uint32_t i = 0; i < 2 * MOST_VALUES; ++i) {
        const uint32_t behind = i - (uint32_t)task.n_inputs;
        const uint32_t kind = behind < n_outputs ? SLIDE_OUTPUT : SLIDE_ERROR_ESTIMATE;
        task.references[i] = i < task.n_inputs ? i
                                               : kind * SLIDE_REFERENCES_PER_KIND +
                                                     behind % (uint32_t)n_outputs;
    }
    if (strcmp(arguments[1], "threads") == 0) {
        return in_threads(&task);
    }
    return strcmp(arguments[1], "lives") == 0 ? in_many_lives(&task) : for_long(&task);
}
