"""Figures of one surrogate on kinds of input as users drive machines, and their table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from kind_tables import LEVELS
from user_kind_truths import CONTROL, Truth

from slide_fmu.core.figures import plain
from slide_fmu.core.measures import percent, rms
from slide_fmu.core.signals import FloatArray
from slide_fmu.report.table import ReportTable
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.row import HARMFUL
from slide_fmu.validation.trust import TrustOutputs
from tests.benchmarks.bound_measures import harm_of

UNIQUE = 0.01
"""A response counts as unique where motions from other initial states differ by less than this
part of the kind's RMS about its mean, over all samples that are measured."""
LITTLE_COVERED, OFTEN_SILENT = 0.9, 0.01
"""Kinds below the one share of covered samples, or above the other of silent ones, are counted."""

Figures = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Run:
    """A run is a surrogate along a truth, at the samples that are measured.

    Attributes:
        truth: where it comes from.
        reference: true outputs, (n, n_outputs), in their units.
        errors: absolute, of the same shape.
        apart: largest difference of motions from other initial states, of the same shape.
        trust: bound and domain; None without a bound.
        unique: whether these motions end in the same one; None where there is one only.
    """

    truth: Truth
    reference: FloatArray
    errors: FloatArray
    apart: FloatArray
    trust: TrustOutputs | None
    unique: bool | None = None


def samples_needed(surrogate: Surrogate) -> int:
    """Return the number of input samples before errors and bounds of a surrogate count."""
    filling = 0 if surrogate.bound is None else surrogate.bound.filling_length
    return max(surrogate.network.memory_length, filling)


def run_of(surrogate: Surrogate, truth: Truth, first: int) -> Run:
    """Evaluate a surrogate as a co-simulation does, with inputs known to the step's end.

    Args:
        first: the first sample that is measured.
    """
    reference, trust = truth.outputs[0, first:], None
    errors = np.abs(surrogate.predict_newest(truth.inputs)[first - 1 :] - reference)
    if surrogate.bound is not None:
        told = surrogate.trust(truth.inputs)
        trust = TrustOutputs(
            told.bounds()[first - 1 :],
            np.zeros(len(errors)),
            told.in_domain[first - 1 :].astype(float),
            told.trusted()[first - 1 :].astype(float),
        )
    apart = np.max(np.abs(truth.outputs[:, first:] - reference), axis=0)
    return Run(truth, reference, errors, apart, trust)


def figures_of(surrogate: Surrogate, runs: Sequence[Run], usual: FloatArray) -> Figures:
    """Return the figures of a surrogate, by kind and level, and over all kinds of a level.

    Args:
        usual: 95 % quantile of the absolute errors in range, (n_outputs,), of the released FMU.
    """
    cases = dict.fromkeys(run.truth.case for run in runs)
    rows, judged = [], []
    for case in cases:
        chosen = _judged([run for run in runs if run.truth.case == case])
        judged += chosen
        rows.append({"kind": case[0], "level": case[1], **_pooled(surrogate, chosen, usual)})
    return {
        "name": surrogate.name,
        "has_a_bound": surrogate.bound is not None,
        "kinds": rows,
        "levels": {
            level: _level(surrogate, [r for r in judged if r.truth.case[1] == level], rows, usual)
            for level in (*LEVELS, CONTROL)
            if any(row["level"] == level for row in rows)
        },
    }


def _judged(runs: Sequence[Run]) -> list[Run]:
    """Return the runs of a kind and level; each knows whether its response is unique."""
    size = rms_about_mean(runs)
    return [
        replace(run, unique=bool(np.all(rms(run.apart) <= UNIQUE * size)))
        if len(run.truth.outputs) > 1
        else run
        for run in runs
    ]


def rms_about_mean(runs: Sequence[Run]) -> FloatArray:
    """Return the RMS of the reference about its mean over all runs, (n_outputs,), not zero."""
    reference = np.concatenate([run.reference for run in runs])
    about = reference - reference.mean(axis=0)
    return np.asarray(np.maximum(rms(about), np.finfo(np.float64).tiny))


def _level(
    surrogate: Surrogate, runs: Sequence[Run], rows: Sequence[Figures], usual: FloatArray
) -> Figures:
    """Return the figures over all kinds of a level, with the worst of them."""
    found = _pooled(surrogate, runs, usual)
    kinds = [row for row in rows if row["level"] == runs[0].truth.case[1]]
    worst = [max(o["relative_rmse"] for o in row["outputs"]) for row in kinds]
    found["kinds"] = len(kinds)
    found["relative_rmse_of_kinds"] = {
        "median": float(np.median(worst)),
        "largest": float(max(worst)),
        "kind": kinds[int(np.argmax(worst))]["kind"],
    }
    if surrogate.bound is not None:
        found["kinds_covered_little"] = sum(row["coverage"] < LITTLE_COVERED for row in kinds)
        found["kinds_often_silent"] = sum(row["silent"] > OFTEN_SILENT for row in kinds)
    return found


def _pooled(surrogate: Surrogate, runs: Sequence[Run], usual: FloatArray) -> Figures:
    """Return the figures of runs, over all samples of them."""
    errors, size = np.concatenate([run.errors for run in runs]), rms_about_mean(runs)
    known = [run.unique for run in runs if run.unique is not None]
    outputs = [
        {
            "name": signal.name,
            "unit": signal.unit,
            "relative_rmse": float(rms(errors)[i] / size[i]),
            "rmse": float(rms(errors)[i]),
            "rms_reference_about_mean": float(size[i]),
            "rmse_over_usual": float(rms(errors)[i] / usual[i]),
        }
        for i, signal in enumerate(surrogate.outputs)
    ]
    return {
        "trajectories": len(runs),
        "failed": sum(run.truth.failed for run in runs),
        "unique": float(np.mean(known)) if known else None,
        "relative_rmse_where_unique": _relative([run for run in runs if run.unique]),
        "outputs": outputs,
        "harmful": float(np.mean(np.any(errors > HARMFUL * usual, axis=1))),
        **_trust(runs, errors, usual),
    }


def _relative(runs: Sequence[Run]) -> list[float] | None:
    """Return the RMSE of every output over the RMS about its mean; None without runs."""
    if not runs:
        return None
    errors = np.concatenate([run.errors for run in runs])
    return [float(value) for value in rms(errors) / rms_about_mean(runs)]


def _trust(runs: Sequence[Run], errors: FloatArray, usual: FloatArray) -> Figures:
    """Return what bound and domain are worth; nothing without a bound.

    Flagged samples are those that are not trusted.
    """
    answers = [run.trust for run in runs if run.trust is not None]
    if not answers:
        return {}
    bounds = np.concatenate([one.bounds for one in answers])
    inside = np.concatenate([one.in_domain for one in answers]) != 0
    covered = errors <= bounds
    harm = plain(harm_of([run.errors for run in runs], answers, usual))
    return {
        "coverage": float(np.mean(covered)),
        "coverage_of_outputs": np.mean(covered, axis=0).tolist(),
        "coverage_in_domain": float(np.mean(covered[inside])) if inside.any() else None,
        "mean_bound_over_usual": float(np.mean(bounds / usual)),
        "outside_of_domain": float(np.mean(~inside)),
        "flagged": _flagged(runs),
        "flagged_where_not_unique": _flagged([run for run in runs if run.unique is False]),
        "harmful_flagged": harm["harmful_flagged"],
        "harmless_flagged": harm["harmless_flagged"],
        "silent": harm["harmful_unnoticed"],
    }


def _flagged(runs: Sequence[Run]) -> float | None:
    """Return the share of flagged samples; None without runs."""
    flagged = [run.trust.flagged for run in runs if run.trust is not None]
    return float(np.mean(np.concatenate(flagged))) if flagged else None


def table_of(figures: Figures) -> ReportTable:
    """Return the table of a surrogate: a row for each kind and level, then one for each level."""
    heading = (
        "kind",
        "level",
        "relative RMSE, %",
        "RMSE / usual",
        "unique",
        "covered",
        "bound / usual",
        "flagged",
        "harmful",
        "of these flagged",
        "harmless flagged",
        "silent",
    )
    rows = [_cells(row["kind"], row["level"], row) for row in figures["kinds"]]
    rows += [_cells("all", level, row) for level, row in figures["levels"].items()]
    title = f"{figures['name']}: kinds of input as users drive machines"
    return ReportTable.of(heading, rows, title).without_empty_columns()


def _cells(kind: str, level: str, row: Mapping[str, Any]) -> list[str]:
    keys = "flagged", "harmful", "harmful_flagged", "harmless_flagged", "silent"
    bound = row.get("mean_bound_over_usual")
    return [
        kind,
        level,
        ", ".join(f"{100 * output['relative_rmse']:.3g}" for output in row["outputs"]),
        f"{max(output['rmse_over_usual'] for output in row['outputs']):.3g}",
        _percent(row["unique"]),
        _percent(row.get("coverage")),
        "" if bound is None else f"{bound:.3g}",
        *(_percent(row.get(key)) for key in keys),
    ]


def _percent(value: float | None) -> str:
    return "" if value is None else percent(value)
