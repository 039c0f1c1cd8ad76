"""Judge an FMU of an unprepared model on kinds of input that nobody told it, by other solvers.

    python -m tests.benchmarks.unprepared.judge drive runs/drive/drive.fmu --json -

The truth comes from scipy (functions), exudyn, or fmpy with the FMU of the model at a finer step.
Motions start from rest under their first inputs, and are three windows long. Calls are:

    h, h/2, h/4  plain: inputs are set to what holds at the begin of each step of this length
    known        at h, inputs are set to those at the step's end, and the FMU knows
    predict      the same inputs by ``slide_fmu.load(FMU).predict``; it has no bound
    simulate     ``slide_fmu.simulate`` at h/4; it has no bound, and no inputs that jump

FMUs with held inputs have ``known`` and ``predict`` where inputs change at their own steps, and
no ``simulate``. Samples count when a whole window has passed, ``window_filled`` and
``error_bound_filled`` are 1, and the model has one response there: nobody can tell from inputs
which of several it gives. So each motion is simulated again after ``--pasts`` other pasts, each a
window long; where an output then differs by more than 1 % of its level in all kinds, there are
several. Over all counted samples of a kind:

    several     share of samples that do not count since there are several responses

    rmse        of each output: RMS of the error / RMS of the truth about its mean over the kind
    rmse_all    the same about its mean over all kinds that were judged
    covered     of each output: share of samples with an error of at most the 95 % bound
    trusted     share of samples with ``trusted`` true
    silent      share of samples with ``trusted`` true and an output whose error exceeds two bounds
    over_bound  largest error / bound where ``trusted`` is true

Tables go to standard error.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import slide_fmu
from slide_fmu.core.figures import optional, plain
from slide_fmu.core.measures import percent, rms
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.importer.file import unpacked
from slide_fmu.report.console import print_table
from slide_fmu.report.progress_display import Messages
from slide_fmu.report.table import ReportTable
from tests.benchmarks.figures_out import measure_and_write
from tests.benchmarks.seeds import UNPREPARED
from tests.benchmarks.unprepared.fmu_calls import QUARTERS, WITH_BOUND, Answer, Judged
from tests.benchmarks.unprepared.kinds import KINDS, NATURES, Band, Motion, after_a_past
from tests.benchmarks.unprepared.models import MODELS, Wanted
from tests.benchmarks.unprepared.truths import truths_of

TONES = "lasting_tones"
"""The kind whose motions have figures of their own."""
SAME = 0.01
"""Responses after other pasts are the same within this part of an output's level."""
TINY = np.finfo(np.float64).tiny


@dataclass(frozen=True)
class Figures:
    """The Figures of a call are those above; None without a bound."""

    samples: int
    rmse: list[float]
    rmse_all: list[float]
    covered: list[float] | None = optional()
    trusted: float | None = optional()
    silent: float | None = optional()
    over_bound: float | None = optional()


@dataclass(frozen=True, eq=False)
class Case:
    """A Case is a kind of input with its motions and true outputs at quarters of steps.

    Attributes:
        kind: its name.
        motions: all that are judged.
        truths: outputs of each motion, (N, n_outputs).
        others: the same after each of some other pasts, (pasts, N, n_outputs).
    """

    kind: str
    motions: list[Motion]
    truths: list[FloatArray]
    others: list[FloatArray]

    def one_response(self, level: FloatArray) -> list[Any]:
        """Return, for each motion, whether all pasts give the same response, (N,)."""
        return [
            (np.abs(others - truth) <= SAME * level).all(axis=(0, 2))
            for others, truth in zip(self.others, self.truths, strict=True)
        ]

    @property
    def nature(self) -> str:
        """How smooth the motions are."""
        return KINDS[self.kind].nature


def figures_of(
    answers: Sequence[Answer], truths: Sequence[FloatArray], level: FloatArray
) -> Figures:
    """Return the figures of a call.

    Args:
        answers: of the call, for each motion.
        truths: true outputs at the same points.
        level: RMS of the truth about its mean over all kinds, (n_outputs,).

    Raises:
        ValueError: no sample counts.
    """
    pairs = list(zip(answers, truths, strict=True))
    true = np.concatenate([y[one.counted] for one, y in pairs])
    if not len(true):
        raise ValueError(
            "0 samples count; expected some after the FMU's window and bound are filled: "
            "judge longer motions (--windows)"
        )
    errors = np.concatenate([np.abs(one.outputs - y)[one.counted] for one, y in pairs])
    size, wrong = np.maximum(rms(true - true.mean(axis=0)), TINY), rms(errors)
    relative = (wrong / size).tolist(), (wrong / np.maximum(level, TINY)).tolist()
    pieces = [(a.bounds[a.counted], a.trusted[a.counted]) for a in answers if a.bounds is not None]
    if not pieces:
        return Figures(len(true), *relative)
    bounds, trusted = (np.concatenate(part) for part in zip(*pieces, strict=True))
    silent = trusted & (errors > 2 * bounds).any(axis=1)
    ratios = errors[trusted] / np.maximum(bounds[trusted], TINY)
    return Figures(
        len(true),
        *relative,
        (errors <= bounds).mean(axis=0).tolist(),
        float(trusted.mean()),
        float(silent.mean()),
        float(ratios.max()) if trusted.any() else None,
    )


def row_of(
    answers: Sequence[Answer],
    truths: Sequence[FloatArray],
    single: Sequence[Any],
    level: FloatArray,
) -> dict[str, Any]:
    """Return the figures of a call where the model has one response, and how often it has several.

    Args:
        answers, truths, level: as for ``figures_of``.
        single: whether the model has one response at each sample of each motion, (N,).

    Raises:
        ValueError: no sample counts.
    """
    before = np.concatenate([one.counted for one in answers])
    kept = [replace(a, counted=a.counted & mask) for a, mask in zip(answers, single, strict=True)]
    left = np.concatenate([one.counted for one in kept])
    several = 1.0 - left.sum() / max(before.sum(), 1)
    if several == 1.0:
        return {"samples": 0, "several": 1.0}
    return {"several": float(several), **plain(figures_of(kept, truths, level))}


def measure(given: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Judge an FMU on the chosen kinds."""
    with unpacked(given.fmu) as files:
        surrogate = slide_fmu.load(given.fmu)
        judged = Judged(files, surrogate, int(np.ceil(given.windows * surrogate.window.n_in)))
        cases = cases_of(given, judged, bar)
        kept = [y[judged.after_window] for case in cases for y in case.truths]
        every = np.concatenate(kept)
        level = rms(every - every.mean(axis=0))
        advance, rows, tones = bar("calls"), [], []
        for done, case in enumerate(cases, start=1):
            single = case.one_response(level)
            for call in judged.calls(case.motions[0], case.nature):
                answers = [judged.answer(call, motion) for motion in case.motions]
                first = 4 if call == "predict" else 0
                truths = [y[first :: QUARTERS[call]] for y in case.truths]
                masks = [one[first :: QUARTERS[call]] for one in single]
                figures = row_of(answers, truths, masks, level)
                rows.append({"kind": case.kind, "nature": case.nature, "call": call, **figures})
                if case.kind == TONES and call in WITH_BOUND:
                    for motion, *own in zip(case.motions, answers, truths, masks, strict=True):
                        answer, y, mask = own
                        one = row_of([answer], [y], [mask], level)
                        tones.append({**motion.drawn.about, "call": call, **one})
            advance(done, len(cases))
    console = Messages(file=sys.stderr, highlight=False)
    tones.sort(key=lambda tone: (WITH_BOUND.index(tone["call"]), tone["hertz"]))
    for table in tables_of(rows, tones):
        print_table(table, console)
    return {
        "model": given.model,
        "fmu": str(given.fmu),
        "step_s": judged.step,
        "window_samples": surrogate.window.n_in,
        "held": judged.held,
        "outputs": list(judged.outputs),
        "seed": given.seed,
        "windows": given.windows,
        "kinds": rows,
        "tones": tones,
    }


def cases_of(given: argparse.Namespace, judged: Judged, bar: Stages) -> list[Case]:
    """Return the chosen kinds with their motions and truths."""
    model, duration = MODELS[given.model], judged.steps * judged.step
    wanted = Wanted(judged.inputs, judged.outputs, judged.times)
    ahead = judged.surrogate.window.n_in
    lead = ahead * judged.step
    longer = replace(wanted, times=np.arange(4 * (judged.steps + ahead) + 1) * (judged.step / 4))
    ranges = [(signal.low, signal.high) for signal in judged.surrogate.inputs]
    advance, cases = bar("true outputs"), []
    names = given.kind or list(KINDS)
    for done, name in enumerate(names, start=1):
        about = (*model.band, judged.step, duration, model.resonances)
        motions, after = [], []
        for index in range(KINDS[name].count):
            seed = given.seed, list(KINDS).index(name), index
            band = Band(*about, index, given.on_grid)
            motions.append(KINDS[name].motion(ranges, np.random.default_rng(seed), band))
            for past in range(given.pasts):
                rng = np.random.default_rng((*seed, 1 + past))
                after.append(after_a_past(motions[-1], lead, rng, band))
        key = (name, given.seed, about, given.on_grid, ranges)
        truths = truths_of(model, wanted, motions, given.cache, key)
        others = truths_of(model, longer, after, given.cache, (key, lead, given.pasts))
        kept = np.array(others).reshape(
            len(motions), given.pasts, len(longer.times), len(wanted.outputs)
        )
        cases.append(Case(name, motions, truths, list(kept[:, :, 4 * ahead :])))
        advance(done, len(names))
    return cases


def tables_of(
    rows: Sequence[dict[str, Any]], tones: Sequence[dict[str, Any]]
) -> list[ReportTable]:
    """Return the tables of all kinds, of lasting tones one by one, and of the natures of kinds."""
    figures = (
        "several",
        "rmse",
        "rmse all",
        "covered",
        "worst",
        "trusted",
        "silent",
        "error / bound",
    )
    kinds = [[row["kind"], row["nature"], row["call"], *_cells(row)] for row in rows]
    each = [
        [f"{t['hertz']:.4g}", f"{t['amplitude']:.2g}", str(t["input"]), t["call"], *_cells(t)]
        for t in tones
    ]
    means = []
    for nature in NATURES:
        for call in WITH_BOUND:
            part = [r for r in rows if (r["nature"], r["call"]) == (nature, call) and r["samples"]]
            if part and "covered" in part[0]:
                means.append([nature, call, str(len(part)), *_mean_cells(part)])
    heading = "nature", "call", "kinds", "rmse", "covered", "least", "trusted", "silent", "most"
    title = "rmse of the worst output; shares of the samples that count"
    tables = [
        ReportTable.of(("kind", "nature", "call", *figures), kinds, title),
        ReportTable.of(("Hz", "amplitude", "input", "call", *figures), each, "Lasting tones"),
        ReportTable.of(heading, means, "Means over kinds"),
    ]
    return [table.without_empty_columns() for table in tables if table.rows]


def _cells(row: dict[str, Any]) -> list[str]:
    if not row["samples"]:
        return [percent(row["several"]), *[""] * 7]
    found = [percent(row["several"]), percent(max(row["rmse"])), percent(max(row["rmse_all"]))]
    if "covered" not in row:
        return [*found, "", "", "", "", ""]
    shares = np.mean(row["covered"]), min(row["covered"]), row["trusted"], row["silent"]
    ratio = row.get("over_bound")
    return [*found, *(percent(float(s)) for s in shares), "" if ratio is None else f"{ratio:.3g}"]


def _mean_cells(part: Sequence[dict[str, Any]]) -> list[str]:
    covered = [float(np.mean(row["covered"])) for row in part]
    silent = [row["silent"] for row in part]
    rmse = float(np.mean([max(row["rmse"]) for row in part]))
    trusted = float(np.mean([row["trusted"] for row in part]))
    shares = np.mean(covered), min(covered), trusted, np.mean(silent), max(silent)
    return [percent(rmse), *(percent(float(share)) for share in shares)]


def parser() -> argparse.ArgumentParser:
    """Return the reader of the command line."""
    found = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    found.add_argument("model", choices=MODELS)
    found.add_argument("fmu", type=Path, help="FMU that slide-fmu made of it")
    found.add_argument("--kind", action="append", choices=KINDS, help="once or several times")
    found.add_argument("--cache", type=Path, help="folder that keeps the true outputs")
    found.add_argument("--pasts", type=int, default=2, help="other pasts; 0: all samples count")
    found.add_argument("--windows", type=float, default=3.0, help="length of each motion")
    found.add_argument("--on-grid", action="store_true", help="levels change at steps of the FMU")
    found.add_argument("--seed", type=int, default=UNPREPARED)
    return found


if __name__ == "__main__":
    measure_and_write(parser(), measure)
