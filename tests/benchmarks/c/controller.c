/* A source FMU of FMI 2.0 on a Cortex-M7 without operating system (mps2-an500 of QEMU): instructions
 * and stack of instantiation and of communication steps. Built by tests/benchmarks/controller.py,
 * which writes controller_case.h. Results go to the host by semihosting, one "name value" a line. */
#include "own_names.h"

#include "controller_case.h"
#include "fmi2Functions.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { STACK_BYTES = 64 * 1024, PATTERN = 0x5A, N_STEPS = CASE_STEPS };

static uint64_t stack[STACK_BYTES / 8]; /* grows down from its end */
static const fmi2ValueReference inputs_at[] = CASE_INPUTS, outputs_at[] = CASE_OUTPUTS;
static const fmi2ValueReference costly_at[] = CASE_COSTLY; /* error estimates and bounds */
static const double inputs[N_STEPS][CASE_N_INPUTS] = CASE_INPUT_VALUES;
enum {
    N_INPUTS = sizeof inputs_at / sizeof inputs_at[0],
    N_OUTPUTS = sizeof outputs_at / sizeof outputs_at[0],
    N_COSTLY = sizeof costly_at / sizeof costly_at[0]
};

static uint32_t ask_host(uint32_t operation, const void *argument) {
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void say(const char *text) { ask_host(0x04, text); }

static void leave(void) {
    ask_host(0x18, (const void *)0x20026); /* the application ends */
    for (;;) {
    }
}

static void report(const char *name, uint32_t value) {
    char line[100];
    snprintf(line, sizeof line, "%s %lu\n", name, (unsigned long)value);
    say(line);
}

/* The C library asks for memory here, should anything ask it for some. */
void *_sbrk(int bytes);
void *_sbrk(int bytes) {
    (void)bytes;
    say("heap 1\n");
    leave();
    return NULL;
}

/* SysTick counts down 24 bits at 25 MHz, of a processor that does an instruction in 1 ns. */
#define SYSTICK ((volatile uint32_t *)0xE000E010)
enum { INSTRUCTIONS_PER_TICK = 40, TICKS = 0x1000000 };

static uint32_t ticks_since(uint32_t begin) { return (begin - SYSTICK[2]) & (TICKS - 1); }

/* What lies below the present frame gets the pattern; how far it was written over then tells how
 * much stack was used. */
static uint32_t lowest_used;

static __attribute__((noinline)) void paint(void) {
    unsigned char *here = __builtin_frame_address(0);
    lowest_used = (uint32_t)here;
    for (unsigned char *at = (unsigned char *)stack; at < here - 64; ++at) {
        *at = PATTERN;
    }
}

static uint32_t stack_used(void) {
    const unsigned char *at = (const unsigned char *)stack;
    while (*at == PATTERN) {
        ++at;
    }
    return lowest_used - (uint32_t)at;
}

static void log_message(fmi2ComponentEnvironment environment, fmi2String instance,
                        fmi2Status status, fmi2String category, fmi2String message, ...) {
    (void)environment;
    (void)instance;
    (void)status;
    (void)category;
    say(message);
    say("\n");
}

static void expect(int good, const char *what) {
    if (!good) {
        say("failed ");
        say(what);
        say("\n");
        leave();
    }
}

/* Instructions and stack of what is called between begin and end. */
typedef struct {
    uint32_t begin, most, least, stack;
} Meter;

static void begin(Meter *meter) {
    paint();
    meter->begin = SYSTICK[2];
}

static void end(Meter *meter) {
    const uint32_t spent = ticks_since(meter->begin), used = stack_used();
    meter->most = spent > meter->most ? spent : meter->most;
    meter->least = meter->least == 0 || spent < meter->least ? spent : meter->least;
    meter->stack = used > meter->stack ? used : meter->stack;
}

static void report_meter(const char *name, const Meter *meter) {
    char line[80];
    const uint32_t numbers[] = {meter->least * INSTRUCTIONS_PER_TICK,
                                meter->most * INSTRUCTIONS_PER_TICK, meter->stack};
    const char *const what[] = {"least_instructions", "most_instructions", "stack_bytes"};
    for (int i = 0; i < 3; ++i) {
        snprintf(line, sizeof line, "%s.%s", name, what[i]);
        report(line, numbers[i]);
    }
}

static void show_outputs(const double *outputs) {
    char line[80];
    for (int i = 0; i < N_OUTPUTS; ++i) {
        uint32_t bits[2];
        memcpy(bits, &outputs[i], sizeof bits);
        snprintf(line, sizeof line, "output %08lx%08lx\n", (unsigned long)bits[1],
                 (unsigned long)bits[0]);
        say(line);
    }
}

static void run_steps(fmi2Component c) {
    Meter first = {0}, steps = {0}, first_read = {0}, reads = {0};
    for (int k = 0; k < N_STEPS; ++k) {
        double outputs[N_OUTPUTS], others[N_COSTLY];
        Meter *meter = k == 0 ? &first : &steps, *read = k == 0 ? &first_read : &reads;
        begin(meter);
        fmi2Status status = fmi2SetReal(c, inputs_at, N_INPUTS, inputs[k]);
        status |= fmi2DoStep(c, k * CASE_STEP, CASE_STEP, fmi2True);
        status |= fmi2GetReal(c, outputs_at, N_OUTPUTS, outputs);
        end(meter);
        begin(read);
        status |= fmi2GetReal(c, costly_at, N_COSTLY, others);
        end(read);
        expect(status == fmi2OK, "step");
        show_outputs(outputs);
    }
    report_meter("first_step", &first);
    report_meter("step", &steps);
    report_meter("first_read_of_errors", &first_read);
    report_meter("read_of_errors", &reads);
}

static void run(void) {
    static const fmi2CallbackFunctions callbacks = {log_message, NULL, NULL, NULL, NULL};
    Meter life = {0};
    SYSTICK[1] = TICKS - 1;
    SYSTICK[2] = 0;
    SYSTICK[0] = 5; /* the processor's clock, on */
    begin(&life);
    fmi2Component c = fmi2Instantiate("one", fmi2CoSimulation, CASE_GUID, "", &callbacks, 0, 0);
    end(&life);
    expect(c != NULL, "fmi2Instantiate");
    report_meter("instantiate", &life);
    expect(fmi2Instantiate("two", fmi2CoSimulation, CASE_GUID, "", &callbacks, 0, 0) == NULL,
           "a second instance is refused");
    expect(fmi2SetupExperiment(c, 0, 0, 0, 0, 0) == fmi2OK, "fmi2SetupExperiment");
    expect(fmi2EnterInitializationMode(c) == fmi2OK, "fmi2EnterInitializationMode");
    expect(fmi2ExitInitializationMode(c) == fmi2OK, "fmi2ExitInitializationMode");
    run_steps(c);
    say("heap 0\n");
    leave();
}

static void stop(void) {
    say("failed fault\n");
    leave();
}

void start(void);
void start(void) {
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* the floating-point unit, on */
    __asm__ volatile("dsb\n isb");
    run();
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {
    stack + STACK_BYTES / 8, start, stop, stop, stop, stop, stop,
};
