#include "forecast.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Inputs that differ by less, in parts of their range, are the same: importers round what they interpolate. */
static const double ROUNDING = 1e-9;

static const double PI = 3.14159265358979323846;
static const double BETTER = 0.5; /* of another mean square error */

/* An input jumps that moves faster than any in the training by this factor, which curves between
 * samples may have, and by more than this part of its range. */
static const double FASTER = 1.3, SMALL_JUMP = 0.02;

/* Correlation with points up to so many before, above which values are no independent ones. Of 32
 * independent values less than one in ten thousand has it: the flag stays for the whole memory. */
static const double ALIKE = 0.7, ALIKE_OF_SHORT = 0.75; /* there are more steps in a memory */
enum { MOST_LAG = 4 };

/* Changes lead on, where the square of their sum is so many times the sum of their squares: of independent
 * values, whatever for how long each is held, one in ten thousand does. Smaller ones (parts of the range, in
 * a step) do not count. */
static const double LEADS = 6, SMALL_CHANGE = 5e-4;

/* A forecast is poor at a point, if its square error is more than this part of the held value's; of a
 * smooth input at a kink or two. This does not matter while changes are smaller on average (in mean square,
 * parts of the range), as those of a digitised sine about its ends. */
static const double POOR = 0.25, SMALL_WALK = 2.5e-3;
enum { MANY_POOR = 4 };

/* A held input is smooth, too, where a forecast's mean square error is this part of the held value's but for
 * two of the points that are scored: of independent values, and of random walks, less than one in a hundred
 * thousand is. */
static const double FAR_BETTER = 0.05;

/* Square of a change at a kink over that of the largest change besides; more is a jump. */
static const double MOST_AT_KINK = 4;
enum { N_KINKS = 2 };

/* Of held inputs files say nothing: a straight line and a parabola are tried. */
static const double LINE_AND_PARABOLA[] = {-1, 0, -3, 1};
enum { N_OF_HELD = 2, N_PAST_OF_HELD = 2, N_SCORED_OF_HELD = 12, MOST_OF_SCORED = 8 };

/* Square of what all forecasts missed over its mean before; less than a part of the range does not count. */
static const double SURPRISE = 9, SURPRISE_OF_RANGE = 1e-6;

/* The first change of an input that moves after a rest, over the next one: more is a jump. */
static const double MOST_AT_FIRST = 1.5;

/* Fewer changes of held inputs could be those of stairs that rise evenly by chance. */
enum { LEAST_CHANGES = 4 };

/* Of u(t - i H) - u(t), the sum of which is how much an input changes. */
typedef struct {
    const double *weights;
    size_t n_past;
} Candidate;

static const double CUBIC_WEIGHTS[] = {-6, 4, -1}, HELD_WEIGHT = 0;
static const Candidate CUBIC = {CUBIC_WEIGHTS, 3}, HELD = {&HELD_WEIGHT, 1};

static size_t n_past_of(const SlideForecast *forecast) {
    return forecast->n_past > CUBIC.n_past ? forecast->n_past : CUBIC.n_past;
}

/* Points that a forecast and the scores of the last ones need. */
static size_t n_points(const SlideForecast *forecast) { return n_past_of(forecast) + 2; }

/* The held value, those of the file, the cubic. */
static size_t n_choices(const SlideForecast *forecast) {
    return (size_t)forecast->n_candidates + 2;
}

static Candidate choice(const SlideForecast *forecast, size_t input, size_t index) {
    if (index == 0) {
        return HELD;
    }
    if (index == n_choices(forecast) - 1) {
        return CUBIC;
    }
    const size_t row = (input * forecast->n_candidates + index - 1) * forecast->n_past;
    return (Candidate){forecast->weights + row, forecast->n_past};
}

/* A row of the file: the largest change, then the weights. */
static void read_row(const SlideForecast *forecast, const unsigned char *row, size_t input) {
    const size_t n_weights = (size_t)forecast->n_candidates * forecast->n_past;
    forecast->largest[input] = slide_f64(row);
    for (size_t i = 0; i < n_weights; ++i) {
        forecast->weights[input * n_weights + i] = slide_f64(row + 8 * (i + 1));
    }
}

void slide_forecast_place(SlideForecast *forecast, const SlidePayload *payload,
                          SlideArena *arena) {
    const SlideForecastView *view = &payload->forecast;
    const bool held = !payload->first_order;
    forecast->n_candidates = held ? N_OF_HELD : view->n_candidates;
    forecast->n_past = held ? N_PAST_OF_HELD : view->n_past;
    forecast->n_scored = held ? N_SCORED_OF_HELD : view->n_candidates > 0 ? view->n_scored : 1;
    forecast->least_changes = held ? LEAST_CHANGES : 0;
    const size_t n = payload->n_inputs;
    const size_t n_weights = (size_t)forecast->n_candidates * forecast->n_past;
    forecast->sample_step = payload->step;
    forecast->jumps = view->jumps;
    forecast->largest = slide_place(arena, n, sizeof(double));
    forecast->weights = slide_place(arena, n * n_weights, sizeof(double));
    forecast->low = slide_place(arena, n, sizeof(double));
    forecast->high = slide_place(arena, n, sizeof(double));
    forecast->past = slide_place(arena, n, sizeof(double));
    for (size_t i = 0; arena->base != NULL && i < n; ++i) {
        const unsigned char *scaling = payload->input_scaling + SLIDE_INPUT_ROW * i;
        forecast->low[i] = slide_f64(scaling) - slide_f64(scaling + 8);
        forecast->high[i] = slide_f64(scaling) + slide_f64(scaling + 8);
        if (held) {
            forecast->largest[i] = DBL_MAX;
            memcpy(forecast->weights + i * n_weights, LINE_AND_PARABOLA,
                   sizeof LINE_AND_PARABOLA);
        } else if (view->n_candidates > 0) {
            read_row(forecast, view->rows + 8 * (1 + n_weights) * i, i);
        }
    }
}

void slide_forecast_place_state(SlideForecastState *state, const SlideForecast *forecast,
                                uint32_t n_inputs, SlideArena *arena) {
    const size_t n = n_inputs, n_errors = n_choices(forecast) * forecast->n_scored;
    state->spacing = slide_place(arena, 1, sizeof *state->spacing);
    const size_t start = arena->used - sizeof *state->spacing;
    state->scored = slide_place(arena, 1, sizeof *state->scored);
    state->latest = slide_place(arena, n, sizeof(double));
    state->channels = slide_place(arena, n * n_points(forecast), sizeof(double));
    state->changes = slide_place(arena, n * n_choices(forecast), sizeof(double));
    state->errors = slide_place(arena, n * n_errors, sizeof(double));
    state->best = slide_place(arena, n, sizeof *state->best);
    state->moves = slide_place(arena, n, sizeof *state->moves);
    state->values = slide_place(arena, forecast->least_changes > 0 ? n * SLIDE_LOOKED : 0,
                                sizeof(double));
    state->size = arena->used - start;
}

void slide_forecast_copy(const SlideForecastState *from, SlideForecastState *to) {
    memcpy(to->spacing, from->spacing, *from->spacing == 0 ? sizeof *from->spacing : from->size);
}

/* How much a candidate says that a channel changes after the newest of these points. */
static double change_of(Candidate candidate, const double *x, double largest) {
    double change = 0;
    for (size_t i = 0; i < candidate.n_past; ++i) {
        change += candidate.weights[i] * (x[i + 1] - x[0]);
    }
    return slide_within(change, -largest, largest);
}

/* A channel goes on to a new point, from which all are counted. */
static void push(const SlideForecast *forecast, double change, double *channel) {
    for (size_t i = n_points(forecast) - 1; i > 0; --i) {
        channel[i] = channel[i - 1] - change;
    }
    channel[0] = 0;
}

static bool differs(const SlideForecast *forecast, size_t input, double one, double other) {
    return fabs(one - other) > ROUNDING * (forecast->high[input] - forecast->low[input]);
}

bool slide_forecast_differ(const SlideForecast *forecast, const SlideHistoryShape *shape,
                           const double *some, const double *others) {
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        if (differs(forecast, i, some[i], others[i])) {
            return true;
        }
    }
    return false;
}

/* The largest change within a step. */
static double largest_of(const SlideForecast *forecast, const SlideForecastState *state,
                         size_t input) {
    return fmin(forecast->largest[input] * (*state->spacing / forecast->sample_step), DBL_MAX);
}

/* What all choices say comes after the points that are there. */
static void foresee(const SlideForecast *forecast, const SlideHistoryShape *shape,
                    SlideForecastState *state) {
    const size_t n = n_choices(forecast);
    for (size_t input = 0; input < shape->n_inputs; ++input) {
        const double *channel = state->channels + input * n_points(forecast);
        const double largest = largest_of(forecast, state, input);
        for (size_t i = 0; i < n; ++i) {
            state->changes[input * n + i] =
                change_of(choice(forecast, input, i), channel, largest);
        }
        input += shape->cosine[input];
    }
}

/* A further point, some time after the last one: how far was what was foreseen? */
static void add_point(const SlideForecast *forecast, const SlideHistoryShape *shape,
                      SlideForecastState *state, const double *inputs, bool scores) {
    const size_t place = (size_t)(*state->scored % forecast->n_scored), n = n_choices(forecast);
    for (size_t input = 0; input < shape->n_inputs; ++input) {
        const bool of_angle = shape->cosine[input];
        double *errors = state->errors + input * n * forecast->n_scored;
        const bool changes = forecast->least_changes == 0 ||
                             differs(forecast, input, state->latest[input], inputs[input]);
        const double change =
            changes ? slide_change_to(of_angle, state->latest + input, inputs + input) : 0;
        for (size_t i = 0; scores && i < n; ++i) {
            const double error = change - state->changes[input * n + i];
            errors[i * forecast->n_scored + place] = error * error;
        }
        push(forecast, change, state->channels + input * n_points(forecast));
        input += of_angle;
    }
    memcpy(state->latest, inputs, shape->n_inputs * sizeof *inputs);
    *state->scored += scores;
    for (size_t i = 0; forecast->least_changes > 0 && i < shape->n_inputs; ++i) {
        double *values = state->values + i * SLIDE_LOOKED;
        const double before = values[(*state->scored + SLIDE_LOOKED - 1) % SLIDE_LOOKED];
        values[*state->scored % SLIDE_LOOKED] =
            differs(forecast, i, before, inputs[i]) ? inputs[i] : before;
    }
}

/* The inputs at points so many times a length before the begin of the newest step, and at it. */
static void read_points(const SlideForecast *forecast, const SlideHistoryShape *shape,
                        const SlideHistory *history, double length, size_t first, bool scores,
                        SlideForecastState *state) {
    SlideReader reader = slide_history_reader(shape, history);
    *state->spacing = length;
    for (size_t age = first + 1; age-- > 0;) {
        const double before = fmin((double)age * length, shape->reach);
        slide_history_at(&reader, -before - length, forecast->past);
        if (age == first) {
            memcpy(state->latest, forecast->past, shape->n_inputs * sizeof(double));
        }
        add_point(forecast, shape, state, forecast->past, scores && age < forecast->n_scored);
        if (scores && age <= forecast->n_scored) {
            foresee(forecast, shape, state);
        }
    }
}

static double sum_of(const double *values, size_t count) {
    double even = 0, odd = 0;
    for (size_t i = 0; i + 2 <= count; i += 2) {
        even += values[i];
        odd += values[i + 1];
    }
    return even + odd + (count % 2 == 1 ? values[count - 1] : 0);
}

/* Is a choice far better than holding the input, but for up to two points at which it was not? One kink counts for
 * more than all points of a smooth input besides. A jump is no kink: the input changes there more than elsewhere,
 * also than before the first of these points. */
static bool is_smooth(size_t n, double before, const double *held, const double *errors,
                      double *rest) {
    double of_held = sum_of(held, n), of_kept = before * before, of_kinks = 0;
    size_t kinks[N_KINKS] = {n, n};
    *rest = sum_of(errors, n);
    for (size_t k = 0; k < N_KINKS; ++k) {
        size_t worst = n;
        for (size_t i = 0; i < n; ++i) {
            const bool gone = k > 0 && i == kinks[0];
            worst = !gone && (worst == n || errors[i] > errors[worst]) ? i : worst;
        }
        if (errors[worst] <= FAR_BETTER * held[worst]) {
            break; /* it is no kink */
        }
        kinks[k] = worst;
        *rest -= errors[worst];
        of_held -= held[worst];
        of_kinks = errors[worst] > POOR * held[worst] ? fmax(of_kinks, held[worst]) : of_kinks;
    }
    for (size_t i = 0; i < n; ++i) {
        of_kept = i == kinks[0] || i == kinks[1] ? of_kept : fmax(of_kept, held[i]);
    }
    return *rest < FAR_BETTER * of_held && of_kinks <= MOST_AT_KINK * of_kept;
}

/* How the value of a held input at a point, by the point's number, differs from that before it. */
static double change_at(const double *values, uint64_t point) {
    return values[point % SLIDE_LOOKED] - values[(point - 1) % SLIDE_LOOKED];
}

/* The index of the choice that is taken. */
static size_t best_of(const SlideForecast *forecast, const SlideForecastState *state,
                      size_t input) {
    const size_t n = n_choices(forecast), n_scored = forecast->n_scored;
    const double *errors = state->errors + input * n * n_scored;
    double least = BETTER * sum_of(errors, n_scored), least_rest = DBL_MAX;
    size_t best = 0;
    for (size_t i = 1; i + 1 < n; ++i) {
        const double error = sum_of(errors + i * n_scored, n_scored);
        if (error < least) {
            least = error;
            best = i;
        }
    }
    if (forecast->n_candidates > 0 && sum_of(errors + (n - 1) * n_scored, n_scored) < BETTER * least) {
        best = n - 1;
    }
    for (size_t i = 1; best == 0 && forecast->least_changes > 0 && i + 1 < n; ++i) {
        const double *values = state->values + input * SLIDE_LOOKED;
        const uint64_t first = *state->scored + SLIDE_LOOKED - n_scored;
        const double before = *state->scored > n_scored ? change_at(values, first) : 0;
        double rest;
        if (is_smooth(n_scored, before, errors, errors + i * n_scored, &rest) && rest < least_rest) {
            least_rest = rest;
            best = i;
        }
    }
    return best;
}

/* Which choice makes the forecast of each input, and whether the input moves. */
static void choose(const SlideForecast *forecast, const SlideHistoryShape *shape,
                   SlideForecastState *state) {
    for (size_t input = 0; input < shape->n_inputs; ++input) {
        const double *held = state->errors + input * n_choices(forecast) * forecast->n_scored;
        uint32_t changes = 0;
        for (size_t i = 0; i < forecast->n_scored; ++i) {
            changes += held[i] > 0;
        }
        state->best[input] = best_of(forecast, state, input);
        state->moves[input] = changes >= forecast->least_changes && state->best[input] > 0;
        input += shape->cosine[input];
    }
}

void slide_forecast_see(const SlideForecast *forecast, const SlideHistoryShape *shape,
                        const SlideHistory *history, SlideForecastState *state) {
    const double *step = slide_history_newest(shape, history), length = step[0];
    if (*state->spacing == 0) {
        memset(state->spacing, 0, state->size);
        read_points(forecast, shape, history, length, n_past_of(forecast) + forecast->n_scored,
                    true, state);
    } else {
        add_point(forecast, shape, state, step + 1, true);
        if (*state->spacing != length) {
            read_points(forecast, shape, history, length, n_points(forecast) - 1, false, state);
        }
        foresee(forecast, shape, state);
    }
    choose(forecast, shape, state);
}

/* Are values like those some points before them, about their mean? */
static bool are_alike(const double *values, size_t newest, double alike) {
    double mean = 0, square = 0;
    size_t n_changes = 0;
    for (size_t i = 0; i < SLIDE_LOOKED; ++i) {
        mean += values[i] / SLIDE_LOOKED;
        n_changes += i > 0 && values[i] != values[i - 1];
    }
    for (size_t i = 0; i < SLIDE_LOOKED; ++i) {
        square += (values[i] - mean) * (values[i] - mean);
    }
    for (size_t lag = 1; lag <= MOST_LAG && n_changes > SLIDE_LOOKED / 2; ++lag) {
        double sum = 0;
        for (size_t i = lag; i < SLIDE_LOOKED; ++i) { /* in the order of time */
            sum += (values[(newest + 1 + i) % SLIDE_LOOKED] - mean) *
                   (values[(newest + 1 + i - lag) % SLIDE_LOOKED] - mean);
        }
        if (fabs(sum) > alike * square * (SLIDE_LOOKED - lag) / SLIDE_LOOKED) {
            return true;
        }
    }
    return false;
}

uint64_t slide_forecast_n_changes(const SlideForecastState *state, size_t input) {
    const double *values = state->values + input * SLIDE_LOOKED;
    uint64_t count = 0;
    for (uint64_t place = *state->scored + SLIDE_LOOKED;
         count + 1 < SLIDE_LOOKED && change_at(values, place) != 0;
         --place) {
        count += 1;
    }
    return count;
}

bool slide_forecast_begins(const SlideForecastState *state, size_t input, uint64_t n_changes) {
    const double *values = state->values + input * SLIDE_LOOKED;
    const uint64_t first = *state->scored + SLIDE_LOOKED - n_changes + 1;
    const double change = change_at(values, first), next = change_at(values, first + 1);
    return n_changes > 1 && change * next > 0 && fabs(change) <= MOST_AT_FIRST * fabs(next);
}

bool slide_forecast_begins_to_change(const SlideForecastState *state, uint32_t n_inputs) {
    for (size_t i = 0; i < n_inputs; ++i) {
        const uint64_t count = slide_forecast_n_changes(state, i);
        if (count > 1 && count < LEAST_CHANGES && !state->moves[i]) {
            return true;
        }
    }
    return false;
}

/* Does an input go on changing in most steps? It may repeat a value, as one that comes late does; two in a
 * row are a stop. A newest change far above the others is a jump or a kink: the next one shows which. */
static bool goes_on(const double *values, uint64_t newest) {
    size_t n_changes = 0, n_last = 0;
    double last = 0, largest = 0;
    for (uint64_t i = 0; i < N_SCORED_OF_HELD; ++i) {
        const double change = change_at(values, newest - i);
        n_changes += change != 0;
        n_last += change != 0 && i < 2;
        last = i == 0 ? change : last;
        largest = i > 0 ? fmax(largest, fabs(change)) : largest;
    }
    return n_changes >= MOST_OF_SCORED && n_last > 0 &&
           last * last <= MOST_AT_KINK * largest * largest;
}

bool slide_forecast_hides(const SlideForecast *forecast, const SlideForecastState *state,
                          uint32_t n_inputs) {
    const double alike = 2 * *state->spacing > forecast->sample_step ? ALIKE : ALIKE_OF_SHORT;
    for (size_t i = 0; i < n_inputs; ++i) {
        if (!state->moves[i] &&
            goes_on(state->values + i * SLIDE_LOOKED, *state->scored + SLIDE_LOOKED) &&
            are_alike(state->values + i * SLIDE_LOOKED, *state->scored % SLIDE_LOOKED, alike)) {
            return true;
        }
    }
    return false;
}

/* Do the newest changes of an input mostly lead one way? Then their sum, squared, is far above the sum of
 * their squares. Without the largest of them, which may be a jump. */
static bool leads_on(const double *values, uint64_t newest, uint64_t n_changes, double least) {
    double sum = 0, square = 0, largest = 0;
    for (uint64_t i = 0; i < n_changes; ++i) {
        const double change = change_at(values, newest - i);
        sum += change;
        square += change * change;
        largest = fabs(change) > fabs(largest) ? change : largest;
    }
    sum -= largest;
    return sum * sum > LEADS * (square - largest * largest) &&
           fabs(sum) > (double)n_changes * least;
}

/* At how many of the points that were scored was no choice much better than holding the input? At a kink a
 * parabola fails up to three times, a line once. */
static uint32_t n_poor(const SlideForecast *forecast, const double *errors) {
    const size_t n_scored = forecast->n_scored;
    uint32_t count = 0;
    for (size_t i = 0; i < n_scored; ++i) {
        double least = errors[n_scored + i];
        for (size_t k = 2; k <= forecast->n_candidates; ++k) {
            least = fmin(least, errors[k * n_scored + i]);
        }
        count += least > POOR * errors[i];
    }
    return count;
}

bool slide_forecast_unclear(const SlideForecast *forecast, const SlideForecastState *state,
                            uint32_t n_inputs) {
    const size_t n_scored = forecast->n_scored;
    const uint64_t newest = *state->scored + SLIDE_LOOKED;
    for (size_t i = 0; i < n_inputs; ++i) {
        const double *errors = state->errors + i * n_choices(forecast) * n_scored;
        const double *values = state->values + i * SLIDE_LOOKED;
        const double range = forecast->high[i] - forecast->low[i], least = SMALL_CHANGE * range;
        const double walk = SMALL_WALK * range;
        const bool changes = sum_of(errors, n_scored) > (double)n_scored * walk * walk;
        if (state->moves[i]) {
            if (changes && n_poor(forecast, errors) >= MANY_POOR) {
                return true;
            }
        } else if (goes_on(values, newest) &&
                   (leads_on(values, newest, n_scored, least) ||
                    leads_on(values, newest, SLIDE_LOOKED - 1, least))) {
            return true;
        }
    }
    return false;
}

bool slide_forecast_jumps(const SlideForecast *forecast, const SlideHistoryShape *shape,
                          const double *from, const double *to, double time) {
    const double samples = time / forecast->sample_step;
    const double part = FASTER * (forecast->jumps ? fmax(samples, 1) : samples);
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        const bool of_angle = shape->cosine[i];
        const double range = of_angle ? 2 : forecast->high[i] - forecast->low[i];
        const double limit = fmax(part * forecast->largest[i], SMALL_JUMP * range);
        const double chord = of_angle ? hypot(to[i] - from[i], to[i + 1] - from[i + 1])
                                      : fabs(to[i] - from[i]);
        if (chord > (of_angle ? 2 * sin(fmin(0.5 * limit, 0.5 * PI)) : limit)) {
            return true;
        }
        i += of_angle;
    }
    return false;
}

bool slide_forecast_surprised(const SlideForecast *forecast, const SlideHistoryShape *shape,
                              const SlideForecastState *state) {
    const size_t n_scored = forecast->n_scored;
    const size_t newest = (size_t)((*state->scored + n_scored - 1) % n_scored);
    for (size_t i = 0; n_scored > 1 && i < shape->n_inputs; ++i) {
        const double *errors = state->errors + i * n_choices(forecast) * n_scored;
        const double range = shape->cosine[i] ? 2 : forecast->high[i] - forecast->low[i];
        const double least = SURPRISE_OF_RANGE * SURPRISE_OF_RANGE * range * range;
        double smallest = DBL_MAX, usual = DBL_MAX;
        for (size_t k = 0; k < n_choices(forecast); ++k) {
            const double of_newest = errors[k * n_scored + newest];
            smallest = fmin(smallest, of_newest);
            usual = fmin(usual, (sum_of(errors + k * n_scored, n_scored) - of_newest) /
                                    (double)(n_scored - 1));
        }
        if (smallest > fmax(SURPRISE * usual, least)) {
            return true;
        }
        i += shape->cosine[i];
    }
    return false;
}

void slide_forecast(const SlideForecast *forecast, const SlideHistoryShape *shape,
                    const SlideForecastState *state, double *inputs) {
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        const double change = state->changes[i * n_choices(forecast) + state->best[i]];
        const double *now = state->latest + i;
        if (shape->cosine[i]) {
            const double c = cos(change), s = sin(change);
            inputs[i] = c * now[0] - s * now[1];
            inputs[i + 1] = s * now[0] + c * now[1];
            ++i;
        } else {
            inputs[i] = slide_within(now[0] + change, fmin(now[0], forecast->low[i]),
                               fmax(now[0], forecast->high[i]));
        }
    }
}
