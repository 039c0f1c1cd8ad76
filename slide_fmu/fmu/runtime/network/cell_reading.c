#include "cell_layout.h"

static bool check_sizes(const SlideCellView *cell, SlideMessage *message) {
    if (cell->n_out < 1 || cell->n_out > cell->n_samples) {
        return slide_say(message,
                         "surrogate file: n_samples %u, n_out %u of a cell; expected 1 <= n_out "
                         "<= n_samples",
                         (unsigned)cell->n_samples, (unsigned)cell->n_out);
    }
    if (cell->n_states < 1 || cell->n_values < 1) {
        return slide_say(message, "surrogate file: a cell has no states or no values");
    }
    if (cell->units != SLIDE_TANH && cell->units != SLIDE_CUBIC && cell->units != SLIDE_GATED) {
        return slide_say(message, "surrogate file: units %u of a cell; expected %d, %d or %d",
                         (unsigned)cell->units, (int)SLIDE_TANH, (int)SLIDE_CUBIC,
                         (int)SLIDE_GATED);
    }
    if ((uint64_t)cell->turned * 2 > cell->n_states ||
        (cell->turned > 0 && cell->units != SLIDE_GATED)) {
        return slide_say(message,
                         "surrogate file: %u turned pairs of %u states; expected gated units and "
                         "at most half the states",
                         (unsigned)cell->turned, (unsigned)cell->n_states);
    }
    return true;
}

static bool check_roles(const SlideCellView *cell, SlideMessage *message) {
    const SlideRoles *roles = &cell->roles;
    if (roles->turn.count != (cell->turned > 0 ? 2 : 0)) {
        return slide_say(message, "surrogate file: %u features of the turn; expected cosine and "
                                  "sine where states are turned, else none",
                         (unsigned)roles->turn.count);
    }
    return cell->units == SLIDE_GATED || roles->gated.count + roles->schedule.count == 0 ||
           slide_say(message, "surrogate file: features of gated units, which the cell has not");
}

static bool read_roles(SlideRoles *roles, uint32_t n_features, SlideCursor *section,
                       SlideMessage *message) {
    SlideIndices *const lists[] = {&roles->drive,    &roles->statics, &roles->gated,
                                   &roles->schedule, &roles->readout, &roles->turn};
    for (size_t i = 0; i < sizeof lists / sizeof lists[0]; ++i) {
        if (!slide_read_indices(lists[i], n_features, section, "a role of features", message)) {
            return false;
        }
    }
    return true;
}

/* Every product of two sizes stays below 2^64: where a matrix was taken before, its sizes are
 * bounded by the file's. */
static bool read_weights(SlideCellView *cell, SlideCursor *section, SlideMessage *message) {
    const SlideRoles *roles = &cell->roles;
    bool gated = cell->units == SLIDE_GATED;
    uint64_t n = cell->n_states, units = cell->n_units, drive = roles->drive.count;
    uint64_t arguments = gated ? (uint64_t)roles->schedule.count + 1 : n + drive + 1;
    uint64_t products = gated ? n + roles->gated.count : 0;
    const struct {
        const unsigned char **place;
        uint64_t rows, columns;
    } parts[] = {{&cell->a, n, n},
                 {&cell->b, n, drive},
                 {&cell->e, n, units},
                 {&cell->w, units, arguments},
                 {&cell->v, units, products},
                 {&cell->c, cell->n_rows, n},
                 {&cell->d, cell->n_rows, roles->statics.count},
                 {&cell->d0, cell->n_rows, 1}};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; ++i) {
        if (!slide_read_f32(parts[i].place, parts[i].rows, parts[i].columns, section, "weight",
                            message)) {
            return false;
        }
    }
    return true;
}

bool slide_cell_read(SlideCellView *cell, uint32_t n_features, SlideCursor *section,
                     SlideMessage *message) {
    if (!slide_take_u32(section, &cell->n_samples) || !slide_take_u32(section, &cell->n_out) ||
        !slide_take_u32(section, &cell->n_states) || !slide_take_u32(section, &cell->n_units) ||
        !slide_take_u32(section, &cell->n_values) || !slide_take_u32(section, &cell->units) ||
        !slide_take_u32(section, &cell->turned)) {
        return slide_too_short(message, "a cell");
    }
    if (!check_sizes(cell, message) ||
        !read_roles(&cell->roles, n_features, section, message) || !check_roles(cell, message)) {
        return false;
    }
    cell->n_rows = (uint64_t)cell->n_values * (1 + (uint64_t)cell->roles.readout.count);
    return read_weights(cell, section, message);
}
