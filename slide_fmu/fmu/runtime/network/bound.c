#include "bound.h"

#include <float.h>
#include <math.h>

static size_t n_statistics(const SlideBound *bound) {
    return 2 * bound->n_seen + 3 * bound->n_outputs + bound->n_expected;
}

static double *place_numbers(const unsigned char *numbers, size_t count, SlideArena *arena) {
    double *placed = slide_place(arena, count, sizeof *placed);
    for (size_t i = 0; arena->base != NULL && i < count; ++i) {
        placed[i] = slide_f64(numbers + 8 * i);
    }
    return placed;
}

static void place_scratch(SlideBound *bound, SlideArena *arena) {
    const size_t n_outputs = bound->n_outputs, n_seen = bound->n_seen;
    bound->statistics =
        slide_place(arena, 1 + SLIDE_BEFORE, n_statistics(bound) * sizeof(double));
    bound->squares = slide_place(arena, n_outputs > n_seen ? n_outputs : n_seen, sizeof(double));
    bound->means = slide_place(arena, 2 * n_outputs + n_seen, sizeof(double));
    bound->expected = slide_place(arena, bound->n_expected, sizeof(double));
}

/* What judges errors: numbers, and the head. */
static void place_judge(SlideBound *bound, const SlideBoundView *view, SlideArena *arena) {
    const size_t n_outputs = bound->n_outputs, n_watched = 2 * n_outputs + bound->n_seen;
    bound->span_factors =
        place_numbers(view->span_factors, view->span_block > 0 ? n_outputs : 0, arena);
    bound->tolerances = place_numbers(view->tolerances, n_outputs, arena);
    bound->floors = place_numbers(view->floors, n_outputs, arena);
    bound->shares = place_numbers(view->shares, n_outputs, arena);
    bound->doubt = slide_f64(view->doubt);
    bound->quietest = place_numbers(view->quietest, n_statistics(bound) - bound->n_seen, arena);
    bound->factors = place_numbers(view->factors, SLIDE_CONFIDENCES * n_outputs, arena);
    bound->limits = place_numbers(view->limits, n_watched, arena);
    for (size_t i = 0; arena->base != NULL && i < n_watched; ++i) {
        bound->limits[i] = fmin(1 / bound->limits[i], DBL_MAX);
    }
    slide_network_place(&bound->head, &view->head, view->head.n_values, arena);
}

void slide_bound_place(SlideBound *bound, const SlidePayload *payload, SlideArena *arena) {
    const SlideBoundView *view = &payload->bound;
    const size_t n_outputs = payload->n_outputs, n_seen = view->n_seen;
    const uint64_t block = view->blocks[0], longer = view->blocks[1];
    const uint64_t span_block = view->span_block;
    const uint64_t means_over = (SLIDE_BLOCKS + 1) * (longer + span_block);
    bound->memory_length = 0;
    bound->span_length = 0;
    bound->n_outputs = 0;
    if (!payload->has_bound) {
        return;
    }
    bound->memory_length = 2 * (uint64_t)view->companion.n_samples + means_over;
    bound->memory_length += payload->first_order && slide_f64(view->doubt) > 0 ? SLIDE_LOOKED_BACK : 0;
    bound->n_outputs = n_outputs;
    bound->n_states = view->companion.of.cell.n_states;
    bound->n_seen = n_seen;
    bound->n_expected = payload->has_estimator ? n_outputs : 0;
    /* Besides those of the means, as many as a step that is only forecast may take in. */
    bound->n_predicted = slide_power_of_two(means_over + payload->n_in + SLIDE_UNSETTLED);
    bound->of_short = (SlideBlocksShape){block, n_outputs};
    bound->of_long = (SlideBlocksShape){longer, n_outputs};
    bound->of_seen = (SlideBlocksShape){longer, n_seen};
    bound->of_span = (SlideBlocksShape){span_block, n_outputs};
    place_judge(bound, view, arena);
    slide_network_place(&bound->companion, &view->companion, payload->n_outputs, arena);
    const uint64_t seen = bound->companion.memory_length;
    bound->filling_length = seen + (SLIDE_BLOCKS + 1) * longer;
    if (payload->has_estimator && payload->estimator.n_samples > bound->filling_length) {
        bound->filling_length = payload->estimator.n_samples;
    }
    bound->span_length = span_block > 0 ? seen + means_over : 0;
    place_scratch(bound, arena);
}

void slide_bound_place_state(SlideBoundState *state, const SlideBound *bound, SlideArena *arena) {
    if (bound->memory_length == 0) {
        return;
    }
    const size_t n_outputs = bound->n_outputs;
    state->predicted =
        slide_place(arena, (size_t)bound->n_predicted, n_outputs * sizeof(float));
    state->known = slide_place(arena, 1, sizeof *state->known);
    const size_t start = arena->used - sizeof *state->known;
    bound->companion.family->place_state(&state->companion, &bound->companion, arena);
    slide_blocks_place(&state->of_short, &bound->of_short, arena);
    slide_blocks_place(&state->of_long, &bound->of_long, arena);
    slide_blocks_place(&state->of_seen, &bound->of_seen, arena);
    if (bound->span_length > 0) {
        slide_blocks_place(&state->of_span, &bound->of_span, arena);
    }
    state->apart_squared = slide_place(arena, n_outputs, sizeof(double));
    state->seen = slide_place(arena, bound->n_seen, sizeof(double));
    state->concluded = slide_place(arena, 1, sizeof *state->concluded);
    state->scales = slide_place(arena, n_outputs, sizeof(double));
    state->apart = slide_place(arena, n_outputs, sizeof(double));
    state->estimates = slide_place(arena, n_outputs, sizeof(double));
    state->novelty = slide_place(arena, 1, sizeof(double));
    state->evaluated = arena->used - start;
}

void slide_bound_restart(const SlideBound *bound, SlideBoundState *state) {
    if (bound->memory_length > 0) {
        *state->known = 0;
        *state->concluded = 0;
    }
}

void slide_bound_take_back(const SlideBound *bound, SlideBoundState *state, uint64_t count) {
    if (bound->memory_length > 0 && *state->known > count) {
        slide_bound_restart(bound, state);
    }
}

float *slide_bound_predicted(const SlideBound *bound, const SlideBoundState *state,
                             uint64_t sample) {
    return state->predicted + (size_t)(sample & (bound->n_predicted - 1)) * bound->n_outputs;
}

void slide_bound_remember(const SlideBound *bound, SlideBoundState *state, uint64_t sample,
                          const float *values) {
    if (bound->memory_length == 0) {
        return;
    }
    float *place = slide_bound_predicted(bound, state, sample);
    for (size_t i = 0; i < bound->n_outputs; ++i) {
        place[i] = values == NULL ? NAN : values[i];
    }
}

/* The companion goes on by a sample: its values, which stay valid until the next. */
static const float *advance(const SlideBound *bound, const SlideKernel *kernel,
                            const SlideSamplesShape *shape, const SlideSamples *samples,
                            uint64_t sample, SlideBoundState *state) {
    const SlideNetwork *companion = &bound->companion;
    const double *input = slide_samples_at(shape, samples, sample);
    slide_network_see_anyhow(companion, &state->companion, sample, input, input + shape->n_inputs);
    const float *values =
        companion->family->evaluate(companion, kernel, &state->companion, sample);
    companion->family->accept(companion, &state->companion);
    return values;
}

/* What the companion sees: the older of its states after the sample, as it was before the younger
 * one took its place, and the features that drive it. */
static void look(const SlideBound *bound, SlideBoundState *state) {
    const SlideCells *cells = &bound->companion.of.cells;
    const size_t first = cells->n_factors + cells->cell.to_states.first;
    const float *drive = bound->companion.features + first;
    for (size_t i = 0; i < bound->n_seen; ++i) {
        const double seen = i < bound->n_states ? cells->next[i] : drive[i - bound->n_states];
        state->seen[i] = seen;
        bound->squares[i] = seen * seen;
    }
}

/* The squared disagreement with the companion's values. False: the predictor gave none. */
static bool compare(const SlideBound *bound, const float *predicted, const float *values,
                    SlideBoundState *state) {
    const bool present = !isnan(predicted[0]);
    for (size_t i = 0; i < bound->n_outputs; ++i) {
        const double apart = (double)predicted[i] - values[i];
        state->apart_squared[i] = present ? apart * apart : 0;
    }
    return present;
}

/* The newest samples that count for the means of some blocks: from the start of a block on. */
typedef struct {
    uint64_t count;
    bool from_first; /* they begin with sample 0, which stands for all before it */
} Span;

/* newest: the newest sample, counted from sample 0. */
static Span span_of(const SlideBlocksShape *shape, uint64_t newest) {
    const uint64_t begun = newest % shape->length + 1;
    return newest / shape->length < SLIDE_BLOCKS
               ? (Span){newest + 1, true}
               : (Span){begun + SLIDE_BLOCKS * shape->length, false};
}

/* The samples that count for the means at the newest sample and at some before it. */
static Span span_until(const SlideBlocksShape *shape, uint64_t newest, uint64_t before) {
    const Span first = span_of(shape, newest - before);
    return (Span){first.count + before, first.from_first};
}

/* A sample's squares, or NULL where they are absent; left: samples from it to the newest one. */
static void add(const SlideBlocksShape *shape, SlideBlocks *blocks, const double *squares,
                uint64_t left, Span span) {
    if (left == span.count && span.from_first && squares != NULL) {
        slide_blocks_fill(shape, blocks, squares);
    } else if (left == span.count) {
        slide_blocks_begin(shape, blocks);
    }
    if (left <= span.count) {
        slide_blocks_add(shape, blocks, squares);
    }
}

/* The samples to evaluate. Where the state is too old to go on from, the companion starts from zero
 * one hand-over before that which the first sample that counts comes after: from there on, its
 * states at this sample are what they always are. */
static uint64_t begin(const SlideBound *bound, uint64_t newest, uint64_t behind, uint64_t wanted,
                      SlideBoundState *state) {
    const uint64_t n_samples = bound->companion.n_samples;
    const uint64_t age = (newest + 1 - wanted + n_samples - 1) % n_samples;
    const uint64_t most = wanted + age + n_samples;
    if (behind > most) {
        bound->companion.family->restart(&bound->companion, &state->companion);
    }
    return behind < most ? behind : most;
}

/* The squared errors that the head expects of a sample count for the estimate over a span, unless
 * the predictor gave nothing after it: then nothing is known of its error. */
static void add_expected(const SlideBound *bound, const SlideKernel *kernel, bool present,
                         uint64_t left, Span span, SlideBoundState *state) {
    slide_bound_weigh(bound, kernel, state);
    add(&bound->of_span, &state->of_span, present ? bound->squares : NULL, left, span);
}

void slide_bound_catch_up(const SlideBound *bound, const SlideKernel *kernel,
                          const SlideSamplesShape *shape, const SlideSamples *samples,
                          uint64_t count, SlideBoundState *state) {
    if (count == *state->known) {
        return;
    }
    const uint64_t newest = count - shape->capacity; /* sample 0 has the number capacity - 1 */
    const bool estimates = bound->span_length > 0;
    const Span whole = estimates ? span_of(&bound->of_span, newest) : (Span){1, false};
    const Span brief = span_until(&bound->of_short, newest, whole.count - 1);
    const Span lengthy = span_until(&bound->of_long, newest, whole.count - 1);
    const uint64_t wanted = brief.count > lengthy.count ? brief.count : lengthy.count;
    const uint64_t todo = begin(bound, newest, count - *state->known, wanted, state);
    bool present = false;
    for (uint64_t left = todo; left > 0; --left) {
        const uint64_t sample = count - left;
        const float *values = advance(bound, kernel, shape, samples, sample, state);
        if (left <= wanted) {
            present = compare(bound, slide_bound_predicted(bound, state, sample), values, state);
            const double *of_outputs = present ? state->apart_squared : NULL;
            look(bound, state);
            add(&bound->of_short, &state->of_short, of_outputs, left, brief);
            add(&bound->of_long, &state->of_long, of_outputs, left, lengthy);
            add(&bound->of_seen, &state->of_seen, bound->squares, left, lengthy);
        }
        if (estimates && left <= whole.count) {
            add_expected(bound, kernel, present, left, whole, state);
        }
    }
    *state->known = count;
}
