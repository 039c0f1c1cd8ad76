/* Sequences of calls, in any order, to two instances of one surrogate: one in each standard. */
#include "fmu.h"
#include "instance.h"
#include "surrogate.h"
#include "target.h"
#include "variables.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SAMPLES = 1000, MOST_CALLS = 100, MOST_REFERENCES = 48, N_SLOTS = 2, STATE_CHECKSUM = 12 };

/* Where states are saved; each knows whether it was tampered with. */
typedef struct {
    void *state;
    bool tampered;
} Slot;

typedef struct {
    FuzzInput *input;
    FuzzFmu fmus[2];
    Slot slots[N_SLOTS];
} Run;

static const SlideModel *model_of(const FuzzFmu *fmu) {
    return &((const SlideInstance *)fmu->component)->model;
}

/* The first variables of all kinds, most of which exist, or any number. */
static size_t take_references(FuzzInput *input, uint32_t *references) {
    const size_t count = fuzz_u8(input) % (MOST_REFERENCES + 1);
    for (size_t i = 0; i < count; ++i) {
        const uint8_t reference = fuzz_u8(input);
        references[i] = reference == 0xFF ? fuzz_u32(input)
                                          : reference % 32u * SLIDE_REFERENCES_PER_KIND +
                                                reference / 32u % 4;
    }
    return count;
}

/* As many values as references, where the next byte says so or the standard knows no other number;
 * the caller gets exactly these, so that a sanitizer sees any access behind them. */
static size_t take_count(FuzzInput *input, const FuzzFmu *fmu, size_t n_references) {
    const uint8_t wanted = fuzz_u8(input);
    return fmu->standard == 2 || wanted < 0x80 ? n_references : wanted % 128;
}

static void set_values(FuzzFmu *fmu, FuzzInput *input) {
    uint32_t references[MOST_REFERENCES];
    const size_t count = take_references(input, references);
    const size_t n_values = take_count(input, fmu, count);
    double *values = malloc(n_values * sizeof *values + 1);
    for (size_t i = 0; i < n_values; ++i) {
        values[i] = fuzz_value(input);
    }
    fuzz_set(fmu, references, count, values, n_values);
    free(values);
}

static void get_values(FuzzFmu *fmu, FuzzInput *input) {
    uint32_t references[MOST_REFERENCES];
    const size_t count = take_references(input, references);
    const size_t n_values = take_count(input, fmu, count);
    double *values = malloc(n_values * sizeof *values + 1);
    fuzz_get(fmu, references, count, values, n_values);
    free(values);
}

static bool all_finite(const double *values, size_t count) {
    bool finite = true;
    for (size_t i = 0; i < count; ++i) {
        finite = finite && isfinite(values[i]);
    }
    return finite;
}

/* A variable by itself, an array with all its values: given values are finite, and none is given
 * of a variable that does not exist, or is of another type. Outputs before the start may be unknown:
 * these are not numbers. */
static void get_one(FuzzFmu *fmu, uint32_t reference, bool exists) {
    const SlideVariable variable = slide_variable(fmu->component, reference);
    double *values = malloc(variable.size * sizeof *values);
    const int status = fuzz_get(fmu, &reference, 1, values, variable.size);
    const bool real = exists && variable.type == SLIDE_REAL;
    fuzz_expect((status == 0) <= real, "a refusal of what is not there");
    const bool unknown = variable.kind == SLIDE_INITIAL_OUTPUT_WINDOW;
    fuzz_expect(status != 0 || fmu->tampered || unknown || all_finite(values, variable.size),
                "finite values");
    free(values);
    int truth = -1;
    const int answer = fuzz_get_boolean(fmu, &reference, &truth);
    fuzz_expect((answer == 0) <= (exists && !real), "a refusal of what is no Boolean");
    fuzz_expect(answer != 0 || truth == 0 || truth == 1, "a truth");
}

/* Every variable of every kind, and one that does not exist behind them. */
static void get_all(FuzzFmu *fmu) {
    for (uint32_t kind = 0; kind <= SLIDE_KINDS; ++kind) {
        const uint32_t count =
            kind < SLIDE_KINDS ? slide_count_of(fmu->component, (SlideVariableKind)kind) : 0;
        for (uint32_t i = 0; i <= count && i < MOST_REFERENCES; ++i) {
            get_one(fmu, kind * SLIDE_REFERENCES_PER_KIND + i, i < count);
        }
    }
}

static double take_length(const FuzzFmu *fmu, FuzzInput *input) {
    static const double parts[] = {1, 2, 0.6, 3, 0.5, 0.1, 0.01, 1e-7, 1.5, 7, 40, 1.0000001};
    const uint8_t kind = fuzz_u8(input);
    const double step = model_of(fmu)->step;
    const double length = kind >= 0xF0 ? fuzz_value(input) : parts[kind % 12] * step;
    return length > MOST_SAMPLES * step && length < 1e10 * step ? step : length; /* takes long */
}

static bool same(const double *one, const double *other, size_t count) {
    return memcmp(one, other, count * sizeof *one) == 0;
}

/* A step, back, and the same step: the same results, all of them. */
static void step_twice(FuzzFmu *fmu, FuzzInput *input) {
    const double length = take_length(fmu, input), time = fuzz_time(fmu);
    const SlideModel *model = model_of(fmu);
    const size_t count = (size_t)model->n_outputs * (model->estimator.positions > 0 ? 2 : 1);
    double found[2][MOST_REFERENCES];
    int status[2];
    void *before = NULL;
    if (count > MOST_REFERENCES || fuzz_save(fmu, &before) != 0) {
        return;
    }
    for (int turn = 0; turn < 2; ++turn) {
        status[turn] = fuzz_do_step(fmu, time, length);
        for (size_t k = 0; k < count; ++k) {
            const uint32_t output = (uint32_t)k % model->n_outputs;
            const uint32_t kind = k < model->n_outputs ? SLIDE_OUTPUT : SLIDE_ERROR_ESTIMATE;
            const uint32_t reference = kind * SLIDE_REFERENCES_PER_KIND + output;
            found[turn][k] = 0;
            fuzz_get(fmu, &reference, 1, &found[turn][k], 1);
        }
        if (turn == 0) {
            fuzz_expect(fuzz_restore(fmu, before) == 0, "that its own state is taken");
        }
    }
    fuzz_expect(status[0] == status[1], "the same verdict after going back");
    fuzz_expect(same(found[0], found[1], count),
                "the same results after going back");
    fuzz_free_state(fmu, &before);
}

static void run_steps(FuzzFmu *fmu, FuzzInput *input) {
    const uint32_t reference = 0;
    double value = fuzz_value(input), change = fuzz_value(input);
    const double length = take_length(fmu, input);
    for (unsigned left = fuzz_u8(input) % 64; left > 0; --left) {
        fuzz_set(fmu, &reference, 1, &value, 1);
        fuzz_do_step(fmu, fuzz_time(fmu), length);
        value = fmod(value + change, 2.0);
    }
}

static void derive(FuzzFmu *fmu, FuzzInput *input, bool adjoint) {
    uint32_t unknowns[MOST_REFERENCES], knowns[MOST_REFERENCES];
    double seed[MOST_REFERENCES], sensitivity[MOST_REFERENCES];
    const size_t n_unknowns = take_references(input, unknowns);
    const size_t n_knowns = take_references(input, knowns);
    for (size_t i = 0; i < MOST_REFERENCES; ++i) {
        seed[i] = fuzz_value(input);
    }
    const bool backwards = adjoint && fmu->standard == 3;
    const int status = fuzz_derivative(fmu, adjoint, unknowns, n_unknowns, knowns, n_knowns, seed,
                                       sensitivity);
    fuzz_expect(status != 0 || fmu->tampered ||
                    all_finite(sensitivity, backwards ? n_knowns : n_unknowns),
                "finite derivatives");
}

/* Of each output by each input, as a Newton method asks. */
static void derive_all(FuzzFmu *fmu) {
    const double one = 1;
    const SlideModel *model = model_of(fmu);
    for (uint32_t known = 0; known < model->n_inputs && known < MOST_REFERENCES; ++known) {
        for (uint32_t i = 0; i < model->n_outputs && i < MOST_REFERENCES; ++i) {
            const uint32_t unknown = SLIDE_OUTPUT * SLIDE_REFERENCES_PER_KIND + i;
            double slope = NAN;
            const int status =
                fuzz_derivative(fmu, known % 2 == 1, &unknown, 1, &known, 1, &one, &slope);
            fuzz_expect(status != 0 || fmu->tampered || isfinite(slope), "a finite derivative");
        }
    }
}

static void derive_by_time(FuzzFmu *fmu, FuzzInput *input) {
    uint32_t references[MOST_REFERENCES];
    int32_t orders[MOST_REFERENCES];
    double values[MOST_REFERENCES];
    const bool of_inputs = fuzz_u8(input) % 2 == 0;
    const size_t count = take_references(input, references);
    for (size_t i = 0; i < count; ++i) {
        const uint8_t order = fuzz_u8(input);
        orders[i] = order >= 0xF0 ? (int32_t)fuzz_u32(input) : order % 4;
        values[i] = fuzz_value(input);
    }
    fuzz_time_derivatives(fmu, of_inputs, references, count, orders, values);
}

static void save(FuzzFmu *fmu, Slot *slot) {
    if (fuzz_save(fmu, &slot->state) == 0) {
        slot->tampered = fmu->tampered;
    }
}

static void restore(FuzzFmu *fmu, Slot *slot) {
    if (fuzz_restore(fmu, slot->state) == 0) {
        fmu->tampered = slot->tampered;
    }
}

static void deserialize(FuzzFmu *fmu, const unsigned char *bytes, size_t size, Slot *slot) {
    void *state = NULL;
    if (fuzz_deserialize(fmu, bytes, size, &state) == 0) {
        fuzz_free_state(fmu, &slot->state);
        *slot = (Slot){state, true};
    }
}

/* Repair the checksum of a serialised state, as an attacker would. */
static void seal(unsigned char *bytes, size_t header, size_t size) {
    const uint32_t sum = size < header ? 0 : slide_crc32(bytes + header, size - header);
    for (size_t i = 0; i < 4 && size >= header; ++i) {
        bytes[STATE_CHECKSUM + i] = (unsigned char)(sum >> 8 * i);
    }
}

/* Serialise, edit the block behind the header, or the header as well, and read it again. */
static void tamper(FuzzFmu *fmu, FuzzInput *input, Slot *slot) {
    enum { MORE = 4096 };
    void *state = NULL;
    size_t size = 0;
    fuzz_expect(fuzz_save(fmu, &state) == 0 && fuzz_serialized_size(fmu, state, &size) == 0,
                "a state at any time");
    const size_t header = size - ((SlideInstance *)fmu->component)->state.size;
    const size_t kept = fuzz_u8(input) < 0xF0 ? header : 0;
    unsigned char *bytes = malloc(size + MORE);
    fuzz_expect(fuzz_serialize(fmu, state, bytes, size) == 0, "a serialised state at any time");
    size = kept + fuzz_edit(input, bytes + kept, size - kept, size - kept + MORE);
    seal(bytes, header, size);
    unsigned char *exact = malloc(size + 1); /* a sanitizer sees any access behind it */
    memcpy(exact, bytes, size);
    deserialize(fmu, exact, size, slot);
    free(exact);
    free(bytes);
    fuzz_free_state(fmu, &state);
}

static void deserialize_anything(FuzzFmu *fmu, FuzzInput *input, Slot *slot) {
    unsigned char bytes[256];
    const size_t size = fuzz_u8(input);
    for (size_t i = 0; i < size; ++i) {
        bytes[i] = fuzz_u8(input);
    }
    deserialize(fmu, bytes, size, slot);
}

/* With whatever strings: refused, but for the right ones. */
static void instantiate_another(int standard, FuzzInput *input) {
    const uint8_t wrong = fuzz_u8(input);
    char *texts[3] = {fuzz_string(input), fuzz_string(input), fuzz_string(input)};
    FuzzFmu fmu = {standard, NULL, false};
    fmu.component = fuzz_instantiate(standard, wrong & 1 ? texts[0] : "another",
                                     wrong & 2 ? texts[1] : fuzz_guid(),
                                     wrong & 4 ? texts[2] : FUZZ_LOCATION, wrong & 8, wrong & 16);
    fuzz_free(&fmu);
    for (int i = 0; i < 3; ++i) {
        free(texts[i]);
    }
}

static void set_logging(FuzzFmu *fmu, FuzzInput *input) {
    static const char *const known[] = {"logEvents", "logAll", "logStatusError", NULL};
    const uint8_t which = fuzz_u8(input);
    char *text = fuzz_string(input);
    const char *categories[2] = {known[which % 4], which & 4 ? text : "logStatusDiscard"};
    fuzz_set_logging(fmu, which & 8, (which >> 4 & 3) % 3, which >> 6 == 3 ? NULL : categories);
    free(text);
}

static void step_anywhere(FuzzFmu *fmu, FuzzInput *input) {
    const double time = fuzz_value(input);
    fuzz_do_step(fmu, time, take_length(fmu, input));
}

static void begin(FuzzFmu *fmu, FuzzInput *input) {
    const double start = fuzz_value(input);
    fuzz_set_up(fmu, start, fuzz_u8(input) % 4 == 3, fuzz_value(input));
    fuzz_enter_initialization(fmu, start);
}

/* No places for results, too little room, no state. */
static void call_without_arguments(FuzzFmu *fmu, Slot *slot) {
    unsigned char little[8];
    size_t size;
    void *none = NULL;
    const bool refused =
        fuzz_set(fmu, NULL, 2, NULL, 2) && fuzz_get(fmu, NULL, 2, NULL, 2) &&
        fuzz_save(fmu, NULL) && fuzz_restore(fmu, NULL) && fuzz_serialize(fmu, NULL, NULL, 0) &&
        fuzz_serialized_size(fmu, NULL, &size) && fuzz_serialized_size(fmu, slot->state, NULL) &&
        fuzz_serialize(fmu, slot->state, little, sizeof little) &&
        fuzz_deserialize(fmu, NULL, 0, &none) && fuzz_deserialize(fmu, little, 0, NULL) &&
        fuzz_derivative(fmu, false, NULL, 1, NULL, 1, NULL, NULL) &&
        fuzz_derivative(fmu, true, NULL, 1, NULL, 1, NULL, NULL) &&
        fuzz_derivative(fmu, false, NULL, 1, NULL, 0, NULL, NULL) &&
        fuzz_derivative(fmu, true, NULL, 0, NULL, 1, NULL, NULL);
    fuzz_expect(refused, "a refusal of missing arguments");
    fuzz_expect(fuzz_free_state(fmu, &none) == 0, "that freeing no state is fine");
}

static void call(Run *run) {
    FuzzInput *input = run->input;
    const uint8_t what = fuzz_u8(input);
    FuzzFmu *fmu = &run->fmus[what >> 7];
    Slot *slot = &run->slots[what >> 6 & 1];
    unsigned which;
    switch (what & 31) {
    case 0:
        begin(fmu, input);
        break;
    case 1:
        fuzz_enter_initialization(fmu, 0);
        break;
    case 2:
        fuzz_exit_initialization(fmu);
        break;
    case 3:
        fuzz_terminate(fmu);
        break;
    case 4:
        fuzz_expect(fuzz_reset(fmu) == 0, "a reset at any time");
        fmu->tampered = false;
        break;
    case 5:
    case 6:
        set_values(fmu, input);
        break;
    case 7:
        get_values(fmu, input);
        break;
    case 8:
        get_all(fmu);
        break;
    case 9:
    case 10:
        fuzz_do_step(fmu, fuzz_time(fmu), take_length(fmu, input));
        break;
    case 11:
        step_anywhere(fmu, input);
        break;
    case 12:
    case 13:
        run_steps(fmu, input);
        break;
    case 14:
        step_twice(fmu, input);
        break;
    case 15:
        save(fmu, slot);
        break;
    case 16:
        restore(fmu, slot);
        break;
    case 17:
        fuzz_free_state(fmu, &slot->state);
        break;
    case 18:
    case 19:
        tamper(fmu, input, slot);
        break;
    case 20:
        tamper(fmu, input, slot);
        restore(fmu, slot);
        break;
    case 21:
        deserialize_anything(fmu, input, slot);
        break;
    case 22:
        derive(fmu, input, false);
        break;
    case 23:
        derive(fmu, input, true);
        break;
    case 24:
        derive_all(fmu);
        break;
    case 25:
        derive_by_time(fmu, input);
        break;
    case 26:
        instantiate_another(fmu->standard, input);
        break;
    case 27:
        set_logging(fmu, input);
        break;
    case 28:
        call_without_arguments(fmu, slot);
        break;
    default:
        which = fuzz_u8(input);
        fuzz_ask(fmu, which, fuzz_u8(input));
        break;
    }
}

void fuzz_calls(FuzzInput *input) {
    Run run = {input, {{2, NULL, false}, {3, NULL, false}}, {{NULL, false}}};
    const uint8_t how = fuzz_u8(input);
    for (int i = 0; i < 2; ++i) {
        FuzzFmu *fmu = &run.fmus[i];
        fmu->component = fuzz_instantiate(fmu->standard, "one", fuzz_guid(), FUZZ_LOCATION,
                                          how & 1, how & 2);
    }
    fuzz_watch(&run.fmus[1]);
    /* FMI 3.0 needs more memory, for arrays and to undo steps that are watched */
    fuzz_expect(run.fmus[0].component != NULL || run.fmus[1].component == NULL,
                "the same verdict in both standards");
    if (run.fmus[1].component != NULL) {
        for (int i = 0; i < 2 && how < 0xC0; ++i) {
            fuzz_set_up(&run.fmus[i], 0, false, 0);
            fuzz_enter_initialization(&run.fmus[i], 0);
            fuzz_exit_initialization(&run.fmus[i]);
        }
        for (unsigned left = MOST_CALLS; left > 0 && input->at < input->end; --left) {
            call(&run);
        }
        for (int i = 0; i < N_SLOTS; ++i) {
            fuzz_free_state(&run.fmus[i], &run.slots[i].state);
        }
    }
    fuzz_watch(NULL);
    for (int i = 0; i < 2; ++i) {
        fuzz_free(&run.fmus[i]);
    }
}
