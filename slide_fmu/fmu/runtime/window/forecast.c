#include "forecast.h"

#include <math.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
static const double BETTER = 0.5; /* of another mean square error */

/* Of u(t - i H) - u(t), the sum of which is how much an input changes. */
typedef struct {
    const double *weights;
    size_t n_past;
} Candidate;

static const double CUBIC_WEIGHTS[] = {-6, 4, -1}, HELD_WEIGHT = 0;
static const Candidate CUBIC = {CUBIC_WEIGHTS, 3}, HELD = {&HELD_WEIGHT, 1};

static size_t n_points(const SlideForecast *forecast) {
    const size_t n_past = forecast->n_past > CUBIC.n_past ? forecast->n_past : CUBIC.n_past;
    return n_past + forecast->n_scored + 1;
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
    const size_t n = payload->n_inputs, row = 1 + (size_t)view->n_candidates * view->n_past;
    forecast->n_candidates = view->n_candidates;
    forecast->n_past = view->n_past;
    forecast->n_scored = view->n_scored;
    forecast->sample_step = payload->step;
    forecast->largest = slide_place(arena, n, sizeof(double));
    forecast->weights = slide_place(arena, n * (row - 1), sizeof(double));
    forecast->low = slide_place(arena, n, sizeof(double));
    forecast->high = slide_place(arena, n, sizeof(double));
    forecast->past = slide_place(arena, n_points(forecast) * n, sizeof(double));
    forecast->channel = slide_place(arena, n_points(forecast), sizeof(double));
    for (size_t i = 0; arena->base != NULL && i < n; ++i) {
        const unsigned char *scaling = payload->input_scaling + SLIDE_INPUT_ROW * i;
        forecast->low[i] = slide_f64(scaling) - slide_f64(scaling + 8);
        forecast->high[i] = slide_f64(scaling) + slide_f64(scaling + 8);
        if (view->n_candidates > 0) {
            read_row(forecast, view->rows + 8 * row * i, i);
        }
    }
}

static double within(double value, double low, double high) {
    return value < low ? low : (value > high ? high : value);
}

/* How much a candidate says that a channel changes after the newest of these points. */
static double change_of(Candidate candidate, const double *x, double largest) {
    double change = 0;
    for (size_t i = 0; i < candidate.n_past; ++i) {
        change += candidate.weights[i] * (x[i + 1] - x[0]);
    }
    return within(change, -largest, largest);
}

/* The squared errors of a candidate at the last points. */
static double score(const SlideForecast *forecast, Candidate candidate, double largest) {
    double sum = 0;
    for (const double *x = forecast->channel + forecast->n_scored; x > forecast->channel; --x) {
        const double error = x[-1] - x[0] - change_of(candidate, x, largest);
        sum += error * error;
    }
    return sum;
}

/* The change of the channel that the best candidate says. */
static double best_change(const SlideForecast *forecast, size_t input, double length) {
    const double largest = forecast->largest[input] * length / forecast->sample_step;
    const size_t n_past = forecast->n_past;
    const double *weights = forecast->weights + input * forecast->n_candidates * n_past;
    double least = BETTER * score(forecast, HELD, largest);
    Candidate best = HELD;
    for (size_t i = 0; i < forecast->n_candidates; ++i, weights += n_past) {
        const Candidate candidate = {weights, n_past};
        const double found = score(forecast, candidate, largest);
        if (found < least) {
            least = found;
            best = candidate;
        }
    }
    if (forecast->n_candidates > 0 && score(forecast, CUBIC, largest) < BETTER * least) {
        best = CUBIC;
    }
    return change_of(best, forecast->channel, largest);
}

/* Turns of a director until the newest point, unwrapped. */
static void fill_turns(const SlideForecast *forecast, size_t n_inputs, size_t input) {
    const double *z = forecast->past + input;
    forecast->channel[0] = 0;
    for (size_t i = 1; i < n_points(forecast); ++i, z += n_inputs) {
        const double *before = z + n_inputs;
        double turn = atan2(before[1], before[0]) - atan2(z[1], z[0]);
        turn -= 2 * PI * ceil((turn - PI) / (2 * PI));
        forecast->channel[i] = forecast->channel[i - 1] + turn;
    }
}

static void turn_on(const SlideForecast *forecast, size_t n_inputs, size_t input, double length,
                    double *inputs) {
    const double *z = forecast->past + input;
    fill_turns(forecast, n_inputs, input);
    const double turn = best_change(forecast, input, length);
    const double c = cos(turn), s = sin(turn);
    inputs[input] = c * z[0] - s * z[1];
    inputs[input + 1] = s * z[0] + c * z[1];
}

static void move_on(const SlideForecast *forecast, size_t n_inputs, size_t input, double length,
                    double *inputs) {
    const double now = forecast->past[input];
    for (size_t i = 0; i < n_points(forecast); ++i) {
        forecast->channel[i] = forecast->past[i * n_inputs + input];
    }
    inputs[input] = within(now + best_change(forecast, input, length),
                           fmin(now, forecast->low[input]), fmax(now, forecast->high[input]));
}

static void sample_past(const SlideForecast *forecast, const SlideHistoryShape *shape,
                        const SlideHistory *history, double length) {
    SlideReader reader = slide_history_reader(shape, history);
    for (size_t age = n_points(forecast); age-- > 1;) {
        const double end = -(double)age * length;
        slide_history_sample(&reader, end - forecast->sample_step, end,
                             forecast->past + age * shape->n_inputs);
    }
    memcpy(forecast->past, slide_history_newest(shape, history),
           shape->n_inputs * sizeof *forecast->past);
}

void slide_forecast(const SlideForecast *forecast, const SlideHistoryShape *shape,
                    const SlideHistory *history, double length, double *inputs) {
    sample_past(forecast, shape, history, length);
    for (size_t i = 0; i < shape->n_inputs; ++i) {
        if (shape->cosine[i]) {
            turn_on(forecast, shape->n_inputs, i, length, inputs);
            ++i;
        } else {
            move_on(forecast, shape->n_inputs, i, length, inputs);
        }
    }
}
