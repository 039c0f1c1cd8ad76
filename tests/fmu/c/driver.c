/* Test driver, built together with the runtime's sources under sanitizers.
 *
 *   driver read FILE...       one line per file: "ok", or why the payload is refused; an accepted
 *                             payload is also placed and stepped once
 *   driver kernels            largest errors of the kernels against double precision
 *   driver calls URI GUID     a life of two instances with good and bad calls
 *   driver run URI GUID N     outputs of N steps on a made-up input, for comparison of platforms
 *   driver three FILE N       a state-space network: exact window, recursive and ping-pong
 *   driver first FILE DATA N  the state that the outputs of N samples show
 *   driver damage URI GUID    steps from states with damaged content
 *   driver adjoint URI GUID N N_INPUTS N_OUTPUTS   after each of N steps, the largest difference
 *                             between adjoint and directional derivatives, and the largest of them
 */
#include "calls.h"
#include "cell_driver.h"
#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "instance.h"
#include "resource.h"
#include "variables.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const size_t LARGEST_BLOCK = (size_t)1 << 26;

/* The first bytes of a state have lengths and places; behind them, each STRIDE-th is damaged. */
enum { EVERY_UNTIL = 1024, STRIDE = 13 };

static void step_once(const SlidePayload *payload) {
    SlideModel model;
    SlideState state;
    SlideArena arena = {NULL, 0};
    slide_model_place(&model, payload, SLIDE_STEPS_PER_SAMPLE, &arena);
    slide_state_place(&state, &model, &arena);
    unsigned char *block = arena.used > LARGEST_BLOCK ? NULL : calloc(arena.used + 1, 1);
    if (block != NULL) {
        arena = (SlideArena){block, 0};
        slide_model_place(&model, payload, SLIDE_STEPS_PER_SAMPLE, &arena);
        slide_state_place(&state, &model, &arena);
        slide_state_reset(&model, &state);
        for (int i = 0; i < 3; ++i) {
            slide_stream_step(&model, &state, model.step);
            slide_stream_step(&model, &state, 0.6 * model.step);
            slide_stream_step(&model, &state, 2 * model.step);
            if (model.estimator.positions > 0) {
                slide_stream_estimate(&model, &state);
            }
            if (model.bound.memory_length > 0) {
                slide_stream_bound(&model, &state);
            }
        }
        free(block);
    }
}

static int read_files(int count, char **paths) {
    for (int i = 0; i < count; ++i) {
        SlideMessage message;
        SlidePayload payload;
        size_t size;
        unsigned char *data = slide_read_file(paths[i], &size, &message);
        if (data == NULL) {
            return 1;
        }
        bool good = slide_payload_read(&payload, data, size, &message);
        puts(good ? "ok" : message.text);
        if (good) {
            step_once(&payload);
        }
        free(data);
    }
    return 0;
}

static double larger(double a, double b) { return a > b ? a : b; }

static double exact_activation(uint32_t activation, double x) {
    switch (activation) {
    case 2:
        return x > 0 ? x : expm1(x);
    case 3:
        return tanh(x);
    case 5:
        return x * x * x;
    default:
        return x / 2 * (1 + tanh(0.79788456080286536 * (x + 0.044715 * x * x * x)));
    }
}

static void report_activation(const SlideKernel *kernel, uint32_t activation, const char *name) {
    enum { COUNT = 1 << 16 };
    static float values[COUNT];
    double worst = 0, worst_relative = 0;
    for (int i = 0; i < COUNT; ++i) {
        values[i] = (float)(i - COUNT / 2) / 1500.0f;
    }
    kernel->activate(activation, values, COUNT);
    for (int i = 0; i < COUNT; ++i) {
        double x = (float)(i - COUNT / 2) / 1500.0f;
        double exact = exact_activation(activation, x);
        double error = fabs(values[i] - exact);
        worst = larger(worst, error / larger(1, fabs(exact)));
        worst_relative = larger(worst_relative, error == 0 ? 0 : error / fabs(exact));
    }
    float special[SLIDE_PANEL] = {NAN, 1e30f, -1e30f, 1e-30f};
    kernel->activate(activation, special, SLIDE_PANEL);
    float far = activation == 5 ? -INFINITY : activation == 4 ? 0.0f : -1.0f;
    float near = activation == 5 ? 0.0f : activation == 4 ? 5e-31f : 1e-30f;
    bool kept = isnan(special[0]) && special[2] == far && special[3] == near;
    printf("%s %s %.3g %.3g %d\n", kernel->name, name, worst, worst_relative, kept);
}

/* One row, and as the last row of a batch, of an odd number of inputs. */
static void report_affine(const SlideKernel *kernel) {
    enum { N_IN = 51, N_PANELS = 3, N_OUT = N_PANELS * SLIDE_PANEL };
    static float weights[N_PANELS][N_IN][SLIDE_PANEL], start[N_OUT], x[N_IN], y[N_OUT];
    static float batch[SLIDE_ROWS][N_OUT];
    const float *rows[SLIDE_ROWS];
    double worst = 0;
    for (int i = 0; i < N_IN; ++i) {
        x[i] = (float)sin(i);
        for (int row = 0; row < N_OUT; ++row) {
            weights[row / SLIDE_PANEL][i][row % SLIDE_PANEL] = (float)cos(row + 7 * i);
            start[row] = (float)row;
        }
    }
    for (int row = 0; row < SLIDE_ROWS; ++row) {
        rows[row] = x;
    }
    const SlideRows all = {SLIDE_ROWS, rows, start, 0, &batch[0][0]};
    kernel->affine(&weights[0][0][0], start, x, N_IN, N_PANELS, y);
    kernel->affine_rows(&weights[0][0][0], N_IN, N_PANELS, &all);
    for (int row = 0; row < N_OUT; ++row) {
        double sum = start[row];
        for (int i = 0; i < N_IN; ++i) {
            sum += (double)x[i] * weights[row / SLIDE_PANEL][i][row % SLIDE_PANEL];
        }
        worst = larger(worst, fabs(y[row] - sum) / N_OUT);
        worst = larger(worst, fabs(batch[SLIDE_ROWS - 1][row] - sum) / N_OUT);
    }
    x[3] = NAN;
    kernel->affine(&weights[0][0][0], start, x, N_IN, N_PANELS, y);
    kernel->affine_rows(&weights[0][0][0], N_IN, N_PANELS, &all);
    printf("%s affine %.3g %.3g %d\n", kernel->name, worst, worst,
           isnan(y[0]) && isnan(batch[0][N_OUT - 1]));
}

static int report_kernels(void) {
    const SlideKernel *kernel;
    for (size_t i = 0; (kernel = slide_kernel(i)) != NULL; ++i) {
        report_activation(kernel, 2, "elu");
        report_activation(kernel, 3, "tanh");
        report_activation(kernel, 4, "gelu");
        report_activation(kernel, 5, "cubic");
        report_affine(kernel);
        report_cells(kernel);
    }
    return 0;
}

static void log_to_nowhere(fmi2ComponentEnvironment environment, fmi2String instance,
                           fmi2Status status, fmi2String category, fmi2String message, ...) {
    (void)environment, (void)instance, (void)status, (void)category, (void)message;
}

static fmi2Component start(const char *uri, const char *guid) {
    static const fmi2CallbackFunctions callbacks = {log_to_nowhere, NULL, NULL, NULL, NULL};
    fmi2Component c = fmi2Instantiate("driver", fmi2CoSimulation, guid, uri, &callbacks, 0, 1);
    if (c != NULL) {
        fmi2SetupExperiment(c, fmi2False, 0, 0, fmi2False, 0);
        fmi2EnterInitializationMode(c);
        fmi2ExitInitializationMode(c);
    }
    return c;
}

static void bad_calls(fmi2Component c) {
    fmi2ValueReference references[2] = {0, 4000000000u};
    int truths[2];
    double values[2] = {NAN, 1e300};
    fmi2SetReal(c, references, 2, values);
    fmi2SetReal(c, references, 1, values);
    fmi2GetReal(c, references, 2, values);
    fmi2GetReal(c, NULL, 2, NULL);
    fmi2GetBoolean(c, references, 2, truths);
    fmi2DoStep(c, NAN, NAN, 0);
    fmi2DoStep(c, 0, INFINITY, 0);
    fmi2SetFMUstate(c, NULL);
    fmi2DeSerializeFMUstate(c, "", 0, NULL);
    fmi2GetDerivatives(c, NULL, 3);
    fmi2GetDirectionalDerivative(c, references, 2, references, 2, values, values);
    fmi2GetDirectionalDerivative(c, NULL, 2, NULL, 1, NULL, NULL);
    fmi2GetDirectionalDerivative(c, NULL, 0, NULL, 0, NULL, NULL);
    fmi2CancelStep(c);
}

static int roll_back(fmi2Component from, fmi2Component to) {
    fmi2FMUstate state = NULL, copy = NULL;
    size_t size = 0;
    fmi2GetFMUstate(from, &state);
    fmi2GetFMUstate(from, &state);
    fmi2SerializedFMUstateSize(from, state, &size);
    char *bytes = malloc(size + 1);
    fmi2Status status = fmi2SerializeFMUstate(from, state, bytes + 1, size);
    if (status == fmi2OK) { /* not aligned, on purpose */
        status = fmi2DeSerializeFMUstate(to, bytes + 1, size, &copy);
    }
    if (status == fmi2OK) {
        status = fmi2SetFMUstate(to, copy);
    }
    for (size_t i = 0; i < size; i += i < EVERY_UNTIL ? 1 : STRIDE) {
        fmi2FMUstate damaged = NULL;
        bytes[1 + i] ^= 0x10;
        fmi2DeSerializeFMUstate(to, bytes + 1, size, &damaged);
        fmi2FreeFMUstate(to, &damaged);
        bytes[1 + i] ^= 0x10;
    }
    free(bytes);
    fmi2FreeFMUstate(from, &state);
    fmi2FreeFMUstate(to, &copy);
    return status == fmi2OK ? 0 : 1;
}

/* Bad calls of FMI 3.0 and a step; the path of the resources is the URI after file://. */
static int make_calls_3(const char *uri, const char *guid) {
    fmi3Boolean event, terminate, early;
    fmi3Float64 last = -1, values[2] = {NAN, 1e300};
    fmi3ValueReference references[2] = {0, 4000000000u};
    fmi3Instance c = fmi3InstantiateCoSimulation("three", guid, uri + strlen("file://"), false,
                                                 true, false, false, NULL, 0, NULL, NULL, NULL);
    if (c == NULL || fmi3InstantiateModelExchange("three", guid, uri, 0, 0, NULL, NULL) != NULL) {
        return 1;
    }
    fmi3GetFloat64(c, references, 1, values, 1);
    fmi3EnterInitializationMode(c, false, 0, 0, false, 0);
    fmi3SetFloat64(c, references, 2, values, 1);
    fmi3SetFloat64(c, references, 2, values, 2);
    fmi3GetFloat64(c, references, 2, values, 2);
    fmi3GetFloat64(c, NULL, 2, NULL, 2);
    fmi3ExitInitializationMode(c);
    fmi3DoStep(c, 0, 0.005, true, NULL, NULL, NULL, NULL);
    fmi3DeserializeFMUState(c, NULL, 0, NULL);
    fmi3GetBinary(c, NULL, 1, NULL, NULL, 1);
    fmi3Status status = fmi3DoStep(c, 0, 0.005, true, &event, &terminate, &early, &last);
    fmi3FreeInstance(c);
    return status == fmi3OK && last == 0.005 ? 0 : 1;
}

static int make_calls(const char *uri, const char *guid) {
    fmi2Component one = start(uri, guid), two = start(uri, guid);
    if (one == NULL || two == NULL || start(uri, "other") != NULL ||
        start("file:///nowhere", guid) != NULL) {
        return 1;
    }
    bad_calls(one);
    int failed = make_calls_3(uri, guid) | roll_back(one, two);
    fmi2Reset(one);
    bad_calls(one);
    fmi2Terminate(two);
    bad_calls(two);
    fmi2FreeInstance(one);
    fmi2FreeInstance(two);
    fmi2FreeInstance(NULL);
    return failed;
}

/* Some steps of several lengths from whatever state there is; each may be refused. */
static void step_anyhow(fmi2Component c) {
    static const double lengths[] = {0.005, 0.01, 0.003, 0.005, 0.0001, 0.2, 0.005};
    for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; ++i) {
        double time = 0, value;
        fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &time);
        fmi2DoStep(c, time, lengths[i], fmi2True);
        for (fmi2ValueReference kind = 0; i % 2 == 0 && kind < SLIDE_KINDS; ++kind) {
            const fmi2ValueReference reference = kind * SLIDE_REFERENCES_PER_KIND;
            fmi2GetReal(c, &reference, 1, &value);
        }
        for (fmi2ValueReference output = 0; output < 3; ++output) {
            const fmi2ValueReference reference =
                SLIDE_OUTPUT * SLIDE_REFERENCES_PER_KIND + output;
            fmi2ValueReference input = 0;
            double seed = 1;
            fmi2GetDirectionalDerivative(c, &reference, 1, &input, 1, &seed, &value);
        }
    }
}

/* A saved state carries no checksum: whatever an importer does to it, no step may leave its arrays.
 * The mode stays: with another one every call would be refused. Each word takes a pattern, those at
 * the begin, where lengths and places stand, all of them. */
static int damage(const char *uri, const char *guid) {
    static const unsigned char patterns[] = {0xFF, 0x7F, 0x80, 0x01};
    fmi2Component c = start(uri, guid);
    fmi2FMUstate good = NULL, bad = NULL;
    size_t size = 0;
    if (c == NULL) {
        return 1;
    }
    step_anyhow(c);
    fmi2GetFMUstate(c, &good);
    fmi2GetFMUstate(c, &bad);
    fmi2SerializedFMUstateSize(c, good, &size);
    const size_t header = 72, mode = header + offsetof(SlideHead, mode);
    for (size_t place = header; place + 8 <= size; place += 8) {
        for (size_t i = 0; place != mode && i < sizeof patterns; ++i) {
            if (place >= EVERY_UNTIL && place / 8 % sizeof patterns != i) {
                continue;
            }
            memset((char *)bad + place, patterns[i], 8);
            fmi2SetFMUstate(c, bad);
            step_anyhow(c);
            memcpy(bad, good, size);
        }
    }
    fmi2Status status = fmi2SetFMUstate(c, good);
    fmi2FreeFMUstate(c, &good);
    fmi2FreeFMUstate(c, &bad);
    fmi2FreeInstance(c);
    return status == fmi2OK ? 0 : 1;
}

enum { MOST_VARIABLES = 8 };

/* Seeds of the outputs against seeds of the inputs: both products with the same matrix. */
static fmi2Status compare_adjoint(fmi2Component c, size_t n_inputs, size_t n_outputs) {
    fmi2ValueReference inputs[MOST_VARIABLES], outputs[MOST_VARIABLES];
    double seed[MOST_VARIABLES], column[MOST_VARIABLES], gradient[MOST_VARIABLES];
    double worst = 0, largest = 0;
    for (size_t i = 0; i < MOST_VARIABLES; ++i) {
        inputs[i] = (fmi2ValueReference)i;
        outputs[i] = (fmi2ValueReference)(SLIDE_OUTPUT * SLIDE_REFERENCES_PER_KIND + i);
        seed[i] = cos((double)i);
    }
    const SlideSensitivities all = {outputs, n_outputs, inputs,   n_inputs,
                                    seed,    n_outputs, gradient, n_inputs};
    fmi2Status status = (fmi2Status)slide_get_adjoint_derivative(c, &all);
    for (size_t i = 0; status == fmi2OK && i < n_inputs; ++i) {
        const double one = 1;
        double sum = 0;
        status = fmi2GetDirectionalDerivative(c, outputs, n_outputs, inputs + i, 1, &one, column);
        for (size_t j = 0; j < n_outputs; ++j) {
            sum += seed[j] * column[j];
        }
        worst = fmax(worst, fabs(sum - gradient[i]));
        largest = fmax(largest, fabs(sum));
    }
    printf("%.3g %.3g\n", worst, largest);
    return status;
}

static int adjoint(const char *uri, const char *guid, int steps, size_t n_inputs,
                   size_t n_outputs) {
    fmi2Component c = start(uri, guid);
    fmi2Status status = c == NULL || n_inputs > MOST_VARIABLES || n_outputs > MOST_VARIABLES
                            ? fmi2Error
                            : compare_adjoint(c, n_inputs, n_outputs);
    for (int k = 0; status == fmi2OK && k < steps; ++k) {
        double value = 0.5 + 0.01 * k;
        fmi2ValueReference input = 0;
        fmi2SetReal(c, &input, 1, &value);
        status = fmi2DoStep(c, k * 0.005, 0.005, fmi2True);
        status = status == fmi2OK ? compare_adjoint(c, n_inputs, n_outputs) : status;
    }
    fmi2FreeInstance(c);
    return status == fmi2OK ? 0 : 1;
}

/* Input 0 follows a triangle; the step is 5 ms, as in samples.py. */
static int run(const char *uri, const char *guid, int steps) {
    fmi2Component c = start(uri, guid);
    fmi2ValueReference input = 0, output = SLIDE_OUTPUT * SLIDE_REFERENCES_PER_KIND;
    for (int k = 0; c != NULL && k < steps; ++k) {
        double value = (k % 21 - 10) / 10.0;
        if (fmi2SetReal(c, &input, 1, &value) != fmi2OK ||
            fmi2DoStep(c, k * 0.005, 0.005, fmi2True) != fmi2OK ||
            fmi2GetReal(c, &output, 1, &value) != fmi2OK) {
            return 1;
        }
        printf("%.9g\n", value);
    }
    fmi2FreeInstance(c);
    return c == NULL ? 1 : 0;
}

int main(int count, char **arguments) {
    const char *verb = count > 1 ? arguments[1] : "";
    if (strcmp(verb, "read") == 0) {
        return read_files(count - 2, arguments + 2);
    }
    if (strcmp(verb, "kernels") == 0) {
        return report_kernels();
    }
    if (strcmp(verb, "calls") == 0 && count == 4) {
        return make_calls(arguments[2], arguments[3]);
    }
    if (strcmp(verb, "run") == 0 && count == 5) {
        return run(arguments[2], arguments[3], atoi(arguments[4]));
    }
    if (strcmp(verb, "three") == 0 && count == 4) {
        return evaluate_three_ways(arguments[2], atoi(arguments[3]));
    }
    if (strcmp(verb, "first") == 0 && count == 5) {
        return find_first_state(arguments[2], arguments[3], atoi(arguments[4]));
    }
    if (strcmp(verb, "damage") == 0 && count == 4) {
        return damage(arguments[2], arguments[3]);
    }
    if (strcmp(verb, "adjoint") == 0 && count == 7) {
        return adjoint(arguments[2], arguments[3], atoi(arguments[4]), (size_t)atoi(arguments[5]),
                       (size_t)atoi(arguments[6]));
    }
    fputs("driver read|kernels|calls|run|three|first|damage|adjoint ...\n", stderr);
    return 2;
}
