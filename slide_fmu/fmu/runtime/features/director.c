/* Direction, turn and change of the turn of angles, and the inputs beside them
 * (slide_fmu/features/director.py). */
#include "director.h"

#include <math.h>

/* What an input is, as numbered in a file. */
typedef enum { OTHER, ANGLE, COSINE, SINE } Kind;
static const double PI = 3.14159265358979323846;

static Kind kind_of(const SlideFeaturesView *view, size_t input) {
    return (Kind)slide_u32(view->own + 4 * input);
}

static bool is_cosine(const SlideFeaturesView *view, size_t input) {
    return kind_of(view, input) == COSINE;
}

static size_t count_of(const SlideFeaturesView *view, bool angles) {
    size_t count = 0;
    for (size_t i = 0; i < view->n_inputs; ++i) {
        const Kind kind = kind_of(view, i);
        count += angles ? kind == ANGLE || kind == COSINE : kind == OTHER;
    }
    return count;
}

static void read_kinds(SlideFeaturesView *view, SlideCursor *cursor) {
    bool open = false; /* a cosine was read, and its sine must follow */
    for (uint32_t i = 0; cursor->good && i < view->n_inputs; ++i) {
        const uint32_t kind = slide_take_u32(cursor, "a director");
        slide_check(cursor, kind <= SINE && (kind == SINE) == open,
                    "surrogate file: input %u of a director is of kind %u; expected 0, 1, or 2 "
                    "with 3 behind it",
                    (unsigned)i, (unsigned)kind);
        open = kind == COSINE;
    }
    const unsigned char *ranges = slide_take_f64s(cursor, view->n_inputs, 2, "director");
    for (uint32_t i = 0; cursor->good && i < view->n_inputs; ++i) {
        const double half_range = slide_f64(ranges + 8 * ((size_t)view->n_inputs + i));
        slide_check(cursor, half_range > 0,
                    "surrogate file: half range %g of input %u of a director; expected positive",
                    half_range, (unsigned)i);
    }
    if (!cursor->good) {
        return;
    }
    const uint64_t angles = count_of(view, true), others = count_of(view, false);
    view->n_signals = 4 * angles + 2 * others;
    slide_check(cursor, !open && angles > 0,
                "surrogate file: a director of %u angles, or without its last sine; expected at "
                "least one angle, and whole ones",
                (unsigned)angles);
}

static void fill_directors(Directors *directors, const SlideFeaturesView *view) {
    const size_t n = view->n_inputs;
    const unsigned char *middle = view->own + 4 * n, *half_range = middle + 8 * n;
    for (size_t i = 0; i < n; ++i) {
        const Kind kind = kind_of(view, i);
        if (kind == OTHER) {
            directors->others[directors->n_others++] = i;
        } else if (kind != SINE) {
            directors->angles[directors->n_angles++] =
                (Angle){i, kind == COSINE, slide_f64(middle + 8 * i),
                        slide_f64(half_range + 8 * i)};
        }
    }
}

static void *place_directors(const SlideFeaturesView *view, SlideArena *arena) {
    Directors *directors = slide_place(arena, 1, sizeof *directors);
    Angle *angles = slide_place(arena, count_of(view, true), sizeof *angles);
    size_t *others = slide_place(arena, count_of(view, false), sizeof *others);
    if (directors != NULL) {
        *directors = (Directors){0, 0, angles, others};
        fill_directors(directors, view);
    }
    return directors;
}

/* Into (-pi, pi]. */
static double wrapped(double turn) { return turn - 2 * PI * ceil((turn - PI) / (2 * PI)); }

static double in_rad(const Angle *angle, const double *inputs) {
    const double *at = inputs + angle->input;
    return angle->director ? atan2(at[1], at[0]) : angle->middle + angle->half_range * at[0];
}

static void write_signals(const SlideFeatures *features, const double *input,
                          const double *before) {
    const Directors *directors = features->own;
    const size_t n = directors->n_angles;
    double *signals = features->signals, *others = signals + 4 * n;
    for (size_t k = 0; k < n; ++k) {
        const Angle *of = &directors->angles[k];
        const double angle = in_rad(of, input), angle_before = in_rad(of, before);
        const double turn = wrapped(angle - angle_before);
        const double turn_before =
            wrapped(angle_before - in_rad(of, before + features->n_inputs));
        signals[2 * k] = cos(angle);
        signals[2 * k + 1] = sin(angle);
        signals[2 * n + k] = turn;
        signals[3 * n + k] = turn - turn_before;
    }
    for (size_t k = 0; k < directors->n_others; ++k) {
        const size_t i = directors->others[k];
        others[k] = input[i];
        others[directors->n_others + k] = input[i] - before[i];
    }
}

const SlideFeatureSet slide_director = {
    .number = 5,
    .is_cosine = is_cosine,
    .read = read_kinds,
    .place = place_directors,
    .write = write_signals,
};
