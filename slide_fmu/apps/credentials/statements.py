"""An FMU's credentials state the figures of its card and report, as entries."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from slide_fmu.apps.credentials.metadata import Entry, Row, joined, table
from slide_fmu.core.measures import percent
from slide_fmu.core.signals import Signal
from slide_fmu.excitation.kinds import Excitation, names_of
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import SPLITS, Recipe
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.report.limits import limits
from slide_fmu.report.row_tables import (
    RULE,
    WORDS,
    call_of,
    in_order,
    judgement_on,
    length_of,
    name_of,
)
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.trust_sections import deviations_of
from slide_fmu.validation import row as measured_row
from slide_fmu.validation.error_figures import ValidationFigures

OF_OUTPUTS = (
    *("name", "unit", "rms_reference_about_mean", "rmse", "relative_rmse", "max_error"),
    *("plain_relative_rmse", "relative_noise_floor", "free_relative_rmse"),
)
"""Figures of an output in its row, if they are known."""


def statements(described: FmuDescription, recipe: Recipe) -> list[Entry]:
    """Return all known facts about an FMU.

    Args:
        described: the FMU; it was measured or not.
        recipe: the recipe that it was made from, with all values resolved.
    """
    measured = described.measured
    return [
        Entry("purpose", [_purpose(recipe)]),
        *_validity(described, recipe),
        *_reference(recipe, measured),
        *_data(described, recipe),
        *([] if measured is None else _accuracy(measured)),
        Entry("limits", limits(described, recipe)),
    ]


def _purpose(recipe: Recipe) -> str:
    stands_for = rules_of(recipe).words.stands_for
    return (
        f"{recipe.description.rstrip('.')}. This FMU stands in for {stands_for} where outputs are "
        "wanted fast, under inputs like those that it was trained on."
    )


def _validity(described: FmuDescription, recipe: Recipe) -> list[Entry]:
    surrogate = described.surrogate
    entries = [
        Entry("validity.in_words", _in_words(described, recipe)),
        table("validity.inputs", "Input", [_signal_row(s) for s in surrogate.inputs]),
        table("validity.excitations", "Excitation", _excitation_rows(recipe)),
    ]
    others = {
        "validity.also_learnt_from": recipe.kinds_of_training(),
        "error_bound.learnt_from": recipe.further_kinds(),
    }
    for name, kinds in others.items():
        if kinds:
            entries.append(table(name, "Excitation", _kind_rows(kinds)))
    if surrogate.physical_parameters:
        rows = [_range_row(p.signal) for p in surrogate.physical_parameters]
        entries.append(table("validity.parameters", "Parameter", rows))
    return entries


def _in_words(described: FmuDescription, recipe: Recipe) -> list[str]:
    """Say for which inputs the FMU is valid, and what it was trained on."""
    surrogate, measured = described.surrogate, described.measured
    kinds = rules_of(recipe).described(
        recipe, surrogate.inputs, surrogate.window.step, held_out=False
    )
    sentences = [f"Trained on {name}: {text}." for name, text in kinds.items()]
    rows = () if measured is None else measured.rows
    call = call_of(rows)
    for row in in_order(rows):
        if row.is_at(call, 1.0) and (verdict := judgement_on(row)):
            error = f"relative RMSE {percent(row.error)}"
            sentences.append(f"{name_of(row)}: {verdict} at {length_of(row)}, {error}.")
    return [*sentences, WORDS, RULE] if rows else sentences


def _range_row(signal: Signal) -> Row:
    return {
        "name": signal.name,
        "unit": signal.unit,
        "low": signal.low,
        "high": signal.high,
        "start": signal.start_value,
    }


def _signal_row(signal: Signal) -> Row:
    return {**_range_row(signal), "hold": signal.hold, "angle": signal.angle}


def _excitation_rows(recipe: Recipe) -> list[Row]:
    drawn = {row["name"]: row for row in _kind_rows(recipe.mix())}
    motions = rules_of(recipe).motions(recipe)
    return [drawn.get(m.name, {"name": m.name, "kind": m.kind}) for m in motions]


def _kind_rows(kinds: Sequence[Excitation | LoopRecipe]) -> list[Row]:
    return [
        {
            "name": name,
            "kind": kind.kind,
            "weight": kind.weight,
            "settings": "; ".join(f"{key} {value}" for key, value in kind.settings().items()),
        }
        for name, kind in zip(names_of(kinds), kinds, strict=True)
    ]


def _reference(recipe: Recipe, measured: RunFigures | None) -> list[Entry]:
    """State the reference of the errors, and its own error if known."""
    system, reference = recipe.system, rules_of(recipe).words.reference
    if reference:
        return [Entry("reference.model", [reference])]
    own = {**system.parameters, **system.reference}
    rows = [{"name": name, "value": value} for name, value in own.items()]
    model = table("reference.model", "Setting", rows, kind=system.kind, model=system.model)
    if not system.reference:
        text = "The reference is the model that made the data; its own error is not known here."
        return [model, Entry("reference.error", [text])]
    if measured is None:
        text = "The reference is a finer model than the one that made the data."
        return [model, Entry("reference.error", [text])]
    errors = [
        {
            "inputs": name,
            "output": output.name,
            "relative_rmse_of_data_model": output.model_relative_rmse,
        }
        for name, validation in measured.ordered.items()
        for output in validation.outputs
    ]
    return [model, table("reference.error", "Error", errors)]


def _data(described: FmuDescription, recipe: Recipe) -> list[Entry]:
    """State the training data, and the programs used."""
    data, provenance, origin = recipe.data, described.provenance or {}, described.origin
    entries = []
    if not rules_of(recipe).simulated:
        entries.append(table("data.records", "Record", _rows(provenance.get("records", []))))
        if "noise_record" in provenance:
            entries.append(
                table("data.noise_record", "Record", _rows([provenance["noise_record"]]))
            )
    else:
        rows = [{"name": split, "trajectories": recipe.count(split)} for split in SPLITS]
        times = {"duration_s": data.duration, "burn_in_s": data.burn_in, "seed": data.seed}
        entries.append(table("data.trajectories", "Part", rows, **times))
    seeds = origin.known_seeds
    if recipe.bound is not None:
        seeds["error_bound"] = recipe.bound.expert.seed
    of_all = ({"of": k, "value": v} for k, v in sorted(seeds.items()))
    entries.append(table("training", "Seed", of_all))
    if "start" in provenance:
        entries.append(table("training.start", "Fmu", _rows([provenance["start"]])))
    versions = sorted(origin.versions.items())
    rows_of_versions = ({"package": k, "version": v} for k, v in versions)
    return [*entries, table("versions", "Version", rows_of_versions)]


def _rows(rows: Iterable[Row]) -> list[Row]:
    """Sort the attributes of rows: rows stored in an FMU are sorted, other rows must be equal."""
    return [dict(sorted(row.items())) for row in rows]


def _accuracy(measured: RunFigures) -> list[Entry]:
    """Return the measured errors, and the figures of estimates, bounds and stability tests."""
    validations = measured.ordered
    entries = [joined("accuracy", _accuracy_tables(validations))]
    if measured.rows:
        entries.append(table("accuracy.rows", "Row", map(_row, in_order(measured.rows))))
        outputs = [line for row in in_order(measured.rows) for line in _outputs_of(row)]
        entries.append(table("accuracy.outputs", "Output", outputs))
    estimates = list(_estimates(validations))
    if estimates:
        entries.append(table("error_estimate", "Deviation", estimates))
    if measured.stability:
        entries.append(table("stability", "Test", _rows(map(vars, measured.stability))))
    return entries


def _named(row: measured_row.Row) -> Row:
    """Return what a row was measured on."""
    return {
        "group": row.group,
        "inputs": row.inputs,
        "call": row.call,
        "communication_step_s": row.step_s,
    }


def _row(row: measured_row.Row) -> Row:
    """Return a row without its outputs."""
    return {
        **_named(row),
        "trajectories": row.trajectories,
        "samples": row.samples,
        "counted": row.counted,
        "relative_rmse": row.error,
        "covered": row.covered,
        "width": row.width,
        "trusted": row.trusted,
        "harmful": row.harmful,
        "silent": row.silent,
        "over_bound": row.over_bound,
    }


def _outputs_of(row: measured_row.Row) -> Iterator[Row]:
    """Yield the errors of each output of a row."""
    for output in row.outputs:
        yield {**_named(row), **vars(output)}


def _estimates(validations: Mapping[str, ValidationFigures]) -> Iterator[Row]:
    """Yield how far error estimates are off, for each validation and output."""
    for name, validation in validations.items():
        for output, deviation in deviations_of(validation.error_estimate):
            assert validation.error_estimate is not None
            span = validation.error_estimate.span_samples
            of_output = {"inputs": name, "output": output, "span_samples": span}
            yield {**of_output, **{key: v for key, v in vars(deviation).items() if key != "name"}}


def _accuracy_tables(validations: Mapping[str, ValidationFigures]) -> Iterable[Entry]:
    for name, validation in validations.items():
        low, high = validation.amplitude
        of_inputs = {"amplitude_low": low, "amplitude_high": high}
        counts = {"trajectories": validation.trajectories, "seed": validation.seed}
        rows = [{key: getattr(o, key) for key in OF_OUTPUTS} for o in validation.outputs]
        yield table("Validation", "Output", rows, inputs=name, **of_inputs, **counts)
