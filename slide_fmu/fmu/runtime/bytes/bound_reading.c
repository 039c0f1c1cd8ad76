#include "bound_reading.h"

enum { MOST_BLOCK = SLIDE_MAX_WINDOW / (SLIDE_BLOCKS + 1) };

static void check_sizes(const SlideBoundView *view, SlideCursor *file) {
    const uint32_t *blocks = view->blocks;
    slide_check(file, blocks[0] >= 1 && blocks[0] <= blocks[1] && blocks[1] <= MOST_BLOCK,
                "surrogate file: an error bound with blocks of %u and %u samples; expected 1 to "
                "%d, the shorter ones first",
                (unsigned)blocks[0], (unsigned)blocks[1], (int)MOST_BLOCK);
}

/* Factors rise with the confidence; limits are those of the watched means. */
static void read_factors(SlideBoundView *view, uint32_t n_outputs, uint32_t n_watched,
                         SlideCursor *file) {
    view->factors = slide_take_f64s(file, SLIDE_CONFIDENCES, n_outputs, "error bound");
    view->limits = slide_take_f64s(file, n_watched, 1, "error bound");
    for (size_t i = 0; file->good && i < (size_t)SLIDE_CONFIDENCES * n_outputs; ++i) {
        const double factor = slide_f64(view->factors + 8 * i);
        const double least = i < n_outputs ? 0 : slide_f64(view->factors + 8 * (i - n_outputs));
        slide_check(file, factor > 0 && factor >= least,
                    "surrogate file: factor %g of an error bound; expected positive ones that "
                    "rise with the confidence",
                    factor);
    }
    for (size_t i = 0; file->good && i < n_watched; ++i) {
        const double limit = slide_f64(view->limits + 8 * i);
        slide_check(file, limit > 0,
                    "surrogate file: limit %g of an error bound; expected it positive", limit);
    }
}

static void read_tolerances(SlideBoundView *view, uint32_t n_outputs, SlideCursor *file) {
    view->tolerances = slide_take_f64s(file, n_outputs, 1, "tolerance");
    for (size_t i = 0; file->good && i < n_outputs; ++i) {
        const double tolerance = slide_f64(view->tolerances + 8 * i);
        slide_check(file, tolerance > 0,
                    "surrogate file: tolerance %g of an error bound; expected it positive",
                    tolerance);
    }
}

static void read_floors(SlideBoundView *view, uint32_t n_outputs, SlideCursor *file) {
    view->floors = slide_take_f64s(file, n_outputs, 1, "floor");
    for (size_t i = 0; file->good && i < n_outputs; ++i) {
        const double least = slide_f64(view->floors + 8 * i);
        slide_check(file, least >= 0,
                    "surrogate file: floor %g of an error bound; expected it not negative", least);
    }
    view->shares = slide_take_f64s(file, n_outputs, 1, "share");
    for (size_t i = 0; file->good && i < n_outputs; ++i) {
        const double share = slide_f64(view->shares + 8 * i);
        slide_check(file, share > 0 && share <= 1,
                    "surrogate file: share %g of the disagreement; expected above 0, at most 1",
                    share);
    }
}

static void read_doubt(SlideBoundView *view, SlideCursor *file) {
    view->doubt = slide_take_f64s(file, 1, 1, "doubt");
    const double doubt = file->good ? slide_f64(view->doubt) : 0;
    slide_check(file, doubt >= 0,
                "surrogate file: doubt %g of an error bound; expected it not negative", doubt);
}

static void read_companion(SlidePayload *payload, SlideCursor *file) {
    SlideNetworkView *companion = &payload->bound.companion;
    slide_network_read(companion, payload->n_inputs, file);
    if (!file->good) {
        return;
    }
    slide_check(file, companion->family == &slide_state_space_family,
                "surrogate file: the companion of an error bound is a network of kind %u; expected "
                "%u (state space)",
                (unsigned)companion->family->number, (unsigned)slide_state_space_family.number);
    slide_check(file,
                file->good && companion->family->fits(companion, payload->n_in, payload->n_out,
                                                      payload->n_outputs),
                "surrogate file: the companion of an error bound maps %u samples to %u values, "
                "which does not fit the window",
                (unsigned)companion->n_samples, (unsigned)companion->n_values);
}

/* From the statistics of a sample as they are: each of them is a channel. The last ones are
 * logarithms, which have least values. */
static void read_head(const SlidePayload *payload, SlideBoundView *view, SlideCursor *file) {
    SlideNetworkView *head = &view->head;
    const uint32_t n_statistics =
        2 * view->n_seen + (payload->has_estimator ? 4 : 3) * payload->n_outputs;
    slide_network_read(head, n_statistics, file);
    if (!file->good) {
        return;
    }
    slide_check(file, head->family == &slide_feed_forward_family,
                "surrogate file: the head of an error bound is a network of kind %u; expected %u "
                "(feed-forward)",
                (unsigned)head->family->number, (unsigned)slide_feed_forward_family.number);
    slide_check(file,
                head->n_samples == 1 && head->features.set == &slide_differences &&
                    head->features.n_signals == n_statistics &&
                    head->features.chosen.count == n_statistics,
                "surrogate file: the head of an error bound maps %u samples of %u features; "
                "expected 1 of %u",
                (unsigned)head->n_samples, (unsigned)head->features.chosen.count,
                (unsigned)n_statistics);
    view->quietest = slide_take_f64s(file, n_statistics - view->n_seen, 1, "quietest");
}

void slide_bound_read(SlidePayload *payload, SlideCursor *file) {
    SlideBoundView *view = &payload->bound;
    const uint32_t n_outputs = payload->n_outputs;
    slide_check(file,
                payload->predictor.family == &slide_state_space_family &&
                    payload->parameters.count == 0,
                "surrogate file: an error bound of a network of kind %u with %u parameters; "
                "expected %u (state space) without any",
                (unsigned)payload->predictor.family->number, (unsigned)payload->parameters.count,
                (unsigned)slide_state_space_family.number);
    slide_open_section(file, "BOUN");
    view->blocks[0] = slide_take_u32(file, "BOUN");
    view->blocks[1] = slide_take_u32(file, "BOUN");
    const uint32_t n_watched = slide_take_u32(file, "BOUN");
    check_sizes(view, file);
    read_factors(view, n_outputs, n_watched, file);
    read_tolerances(view, n_outputs, file);
    read_floors(view, n_outputs, file);
    read_doubt(view, file);
    read_companion(payload, file);
    if (file->good) {
        const SlideCellView *cell = &view->companion.of.cell;
        view->n_seen = cell->n_states + cell->roles.drive.count;
        slide_check(file, n_watched == view->n_seen + 2 * n_outputs,
                    "surrogate file: %u limits of an error bound; expected %u", (unsigned)n_watched,
                    (unsigned)(view->n_seen + 2 * n_outputs));
    }
    if (file->good) {
        read_head(payload, view, file);
    }
    slide_close_section(file, "BOUN");
}

static void read_span_factors(SlideBoundView *view, uint32_t n_outputs, SlideCursor *file) {
    view->span_factors = slide_take_f64s(file, n_outputs, 1, "error estimate");
    for (size_t i = 0; file->good && i < n_outputs; ++i) {
        const double factor = slide_f64(view->span_factors + 8 * i);
        slide_check(file, factor > 0,
                    "surrogate file: factor %g of an error estimate; expected it positive", factor);
    }
}

void slide_span_read(SlidePayload *payload, SlideCursor *file) {
    SlideBoundView *view = &payload->bound;
    slide_check(file, !payload->has_estimator,
                "surrogate file: an error estimate of the bound beside an error estimator; "
                "expected one of them");
    slide_open_section(file, "SPAN");
    view->span_block = slide_take_u32(file, "SPAN");
    slide_check(file, view->span_block >= 1 && view->span_block <= MOST_BLOCK,
                "surrogate file: an error estimate with blocks of %u samples; expected 1 to %d",
                (unsigned)view->span_block, (int)MOST_BLOCK);
    read_span_factors(view, payload->n_outputs, file);
    slide_close_section(file, "SPAN");
}

void slide_bound_check_head(const SlidePayload *payload, const SlideBoundView *view,
                            SlideCursor *file) {
    const uint32_t n_values = view->head.n_values;
    const uint32_t expected = (view->span_block > 0 ? 2 : 1) * payload->n_outputs;
    slide_check(file, n_values == expected,
                "surrogate file: the head of an error bound gives %u values; expected %u",
                (unsigned)n_values, (unsigned)expected);
}
