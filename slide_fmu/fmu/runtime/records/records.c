#include "records.h"

#include <string.h>

bool slide_records_know(const SlideFeatureSet *set) {
    return set == &slide_chain_motion || set == &slide_director || set == &slide_differences;
}

static SlideChannel *place_channels(const unsigned char *rows, size_t row_size, size_t count,
                                    SlideArena *arena) {
    SlideChannel *channels = slide_place(arena, count, sizeof *channels);
    for (size_t i = 0; arena->base != NULL && i < count; ++i) {
        channels[i] = (SlideChannel){slide_f64(rows + row_size * i),
                                     slide_f64(rows + row_size * i + 8)};
    }
    return channels;
}

static SlideRecordPart part_of(const SlideFeaturePart *part) {
    return (SlideRecordPart){part->first, part->count, part->weights, part->constants, NULL};
}

/* The cell itself has all weights in single precision. */
SlideRecordCell slide_records_cell(const SlideNetwork *network) {
    const SlideCells *cells = &network->of.cells;
    const SlideCell *cell = &cells->cell;
    return (SlideRecordCell){
        .n_states = cell->n_states,
        .n_rows = network->n_values * (1 + cells->n_factors),
        .n_values = network->n_values,
        .n_factors = cells->n_factors,
        .n_features = network->seen.count,
        .substeps = cell->substeps,
        .turned = cell->turned,
        .unit_panels = cell->unit_panels,
        .state_panels = cell->state_panels,
        .row_panels = cell->row_panels,
        .activation = cell->activation,
        .to_gates = part_of(&cell->to_gates),
        .to_units = part_of(&cell->to_units),
        .to_states = part_of(&cell->to_states),
        .to_rows = part_of(&cell->to_rows),
        .units_of_states = {cell->units_of_states, NULL},
        .states_of_states = {cell->states_of_states, NULL},
        .states_of_units = {cell->states_of_units, NULL},
        .rows_of_states = {cell->rows_of_states, NULL},
    };
}

void slide_records_place_scratch(SlideRecordScratch *scratch, const SlideRecordCell *cell,
                                 size_t places, size_t number, SlideArena *arena) {
    const size_t panel = SLIDE_LANES * places * number;
    const size_t units = cell->unit_panels, states = cell->state_panels;
    void **const of_units[] = {&scratch->open, &scratch->offered, &scratch->units,
                               &scratch->cubes};
    void **const of_states[] = {&scratch->driven, &scratch->seen, &scratch->pushed,
                                &scratch->next};
    for (size_t i = 0; i < sizeof of_units / sizeof of_units[0]; ++i) {
        *of_units[i] = slide_place(arena, units, panel);
    }
    for (size_t i = 0; i < sizeof of_states / sizeof of_states[0]; ++i) {
        *of_states[i] = slide_place(arena, states, panel);
    }
    scratch->rows = slide_place(arena, cell->row_panels, panel);
}

void slide_records_place(SlideRecords *records, const SlidePayload *payload,
                         const SlideNetwork *network, const SlideKernel *kernel,
                         SlideArena *arena) {
    const SlideFeatures *seen = &network->seen;
    records->network = network;
    records->kernel = slide_record_kernel(kernel);
    records->n_inputs = payload->n_inputs;
    records->inputs =
        place_channels(payload->input_scaling, SLIDE_INPUT_ROW, payload->n_inputs, arena);
    records->outputs =
        place_channels(payload->output_scaling, SLIDE_OUTPUT_ROW, payload->n_outputs, arena);
    records->cell = slide_records_cell(network);
    slide_records_place_scratch(&records->scratch, &records->cell, SLIDE_TOGETHER, sizeof(float),
                                arena);
    records->points.inputs = slide_place(arena, seen->n_inputs, SLIDE_ROOM * sizeof(double));
    records->points.signals = slide_place(arena, seen->n_signals, SLIDE_ROOM * sizeof(double));
    records->seen = slide_place(arena, seen->count, SLIDE_POINTS * sizeof(float));
    records->states = slide_place(arena, records->cell.state_panels,
                                  SLIDE_LANES * SLIDE_TOGETHER * sizeof(float));
    records->values = slide_place(arena, network->n_values, SLIDE_POINTS * sizeof(float));
}

/* Inputs of a block, scaled, and those before it. */
static void take_in(const SlideRecords *records, const SlideGroup *group, size_t first,
                    size_t n_samples) {
    const SlideRecordList *list = &group->list;
    const size_t n = records->n_inputs, places = group->places;
    const size_t n_before = first < SLIDE_BEFORE ? first : SLIDE_BEFORE; /* of the record */
    for (size_t place = 0; place < places; ++place) {
        const size_t record = place < list->count ? place : list->count - 1;
        const double *from = list->inputs + (record * list->stride + first) * n;
        for (size_t i = 0; i < n; ++i, ++from) {
            const double offset = records->inputs[i].offset;
            const double factor = 1 / records->inputs[i].scale;
            double *to = records->points.inputs + i * SLIDE_ROOM + SLIDE_LEAD + place;
            for (size_t sample = 0; sample < n_samples; ++sample) {
                to[sample * places] = (from[sample * n] - offset) * factor;
            }
            for (size_t age = 1; age <= SLIDE_BEFORE; ++age) {
                const size_t known = age < n_before ? age : n_before;
                *(to - age * places) = (*(from - known * n) - offset) * factor;
            }
        }
    }
}

SlidePoints slide_records_look(const SlideRecords *records, const SlideGroup *group, size_t first,
                               size_t n_samples) {
    SlidePoints points = records->points;
    points.records = group->places;
    points.n_points = n_samples * group->places;
    take_in(records, group, first, n_samples);
    records->kernel->signals(&records->network->seen, &points);
    return points;
}

static bool see(const SlideRecords *records, const SlideGroup *group, size_t first,
                size_t n_samples) {
    const SlidePoints points = slide_records_look(records, group, first, n_samples);
    return records->kernel->see(&records->network->seen, &points, records->seen);
}

/* Outputs of a block, as far as they are among the last n_given. */
static void give(const SlideRecords *records, const SlideGroup *group, size_t first,
                 size_t n_samples, size_t n_given, double *outputs) {
    const size_t n = records->cell.n_values, places = group->places;
    const size_t n_silent = group->list.length - n_given; /* at the start of each record */
    const size_t begin = first < n_silent ? n_silent - first : 0;
    for (size_t record = 0; record < group->list.count; ++record) {
        double *to = outputs + record * n_given * n;
        for (size_t i = 0; i < n; ++i) {
            const SlideChannel channel = records->outputs[i];
            const float *from = records->values + i * places + record;
            for (size_t sample = begin; sample < n_samples; ++sample) {
                to[(first + sample - n_silent) * n + i] =
                    channel.offset + channel.scale * from[sample * n * places];
            }
        }
    }
}

static bool run_group(const SlideRecords *records, const SlideGroup *group, size_t n_held,
                      size_t n_given, double *outputs) {
    const SlideRecordCell *cell = &records->cell;
    const size_t places = group->places, length = group->list.length;
    const size_t block = SLIDE_POINTS / places;
    memset(records->states, 0,
           cell->state_panels * SLIDE_LANES * places * sizeof *records->states);
    bool finite = n_held == 0 || see(records, group, 0, 1);
    records->kernel->settle(cell, &records->scratch, places, records->seen, n_held,
                            records->states);
    for (size_t first = 0; finite && first < length; first += block) {
        const size_t left = length - first, n_samples = left < block ? left : block;
        finite = see(records, group, first, n_samples);
        records->kernel->run(cell, &records->scratch, places, records->seen, n_samples,
                             records->states, records->values);
        give(records, group, first, n_samples, n_given, outputs);
    }
    return finite;
}

/* How many of the records that are left go together. Four take as long as three by themselves, and
 * twice as many not twice as long; one that would fill the other half alone is better off alone. */
static size_t places_for(size_t left, size_t together) {
    size_t places = left <= 2 ? 1 : SLIDE_FEWEST;
    while (places > 1 && places < left && places < together) {
        places *= 2;
    }
    return left > SLIDE_FEWEST + 1 && left == places / 2 + 1 ? places / 2 : places;
}

SlideGroup slide_records_group(const SlideRecords *records, const SlideRecordList *list,
                               size_t first, size_t together) {
    const size_t left = list->count - first, places = places_for(left, together);
    SlideGroup group = {*list, places};
    group.list.inputs += first * list->stride * records->n_inputs;
    group.list.count = left < places ? left : places;
    return group;
}

bool slide_records_run(const SlideRecords *records, const SlideRecordList *list, size_t n_held,
                       size_t n_given, double *outputs) {
    bool finite = true;
    for (size_t first = 0; finite && first < list->count;) {
        const SlideGroup group = slide_records_group(records, list, first, SLIDE_TOGETHER);
        finite = run_group(records, &group, n_held, n_given,
                           outputs + first * n_given * records->cell.n_values);
        first += group.list.count;
    }
    return finite;
}
