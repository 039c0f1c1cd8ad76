"""This module finds by a linear fit which output sample answers an input sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.record_files.record import Record
from slide_fmu.records.findings import Finding
from slide_fmu.records.preparation import Pairing, Preparation, longest_piece
from slide_fmu.records.response import dead_time, is_white_noise

LAGS = 12
"""Number of past outputs and inputs in the fit."""

SURE = 8.0
"""An input counts if its coefficient is at least this multiple of its standard deviation."""

UNSURE = 4.0
"""An input does not count below this multiple; chance reaches it in one of many fits."""

FAIR = 1e-3
"""Evidence below this part of the largest counts as rounding, as in records without noise."""

MOST_SAMPLES = 100_000
"""Largest number of samples in a fit."""

SINGULAR = 1e-12
"""Directions in which the data vary less than this part of the largest are left out."""

FEW_CHANGES = 20
"""Inputs that change fewer times are set points, which tell little of the motion between them."""

MOVED = 2.0
"""An output is moved by inputs if each explains this multiple of a random input."""


@dataclass(frozen=True)
class Answer:
    """An Answer has the evidence that an output depends on inputs around its own sample.

    Each is a coefficient of the fit y[k] = sum a_i y[k-i] + sum b_j u[k-j], divided by its
    standard deviation. It is the largest among all inputs and outputs.

    Attributes:
        ahead: evidence of u[k+1], which cannot act yet.
        now: evidence of u[k].
        before: evidence of u[k-1].
    """

    ahead: float
    now: float
    before: float

    @property
    def pairing(self) -> Pairing | None:
        """The pairing that the evidence supports; None if it supports neither."""
        fair = self._fair
        if self.now > max(SURE, fair):
            return "same"
        return "later" if self.before > SURE and self.now < max(UNSURE, fair) else None

    @property
    def foresees(self) -> bool:
        """Tell whether an output depends on an input that comes later."""
        return self.ahead > max(SURE, self._fair)

    @property
    def _fair(self) -> float:
        return FAIR * max(self.ahead, self.now, self.before)


def answer_of(inputs: FloatArray, outputs: FloatArray) -> Answer | None:
    """Find the delay, 0 or 1 samples, with which outputs answer measured inputs.

    A system whose inputs are held answers a sample later; one whose inputs move between samples
    answers at once. Where the inputs hardly change from sample to sample, the evidence is weak.

    Args:
        inputs: shape (N, n_inputs), without gaps.
        outputs: shape (N, n_outputs).

    Returns:
        None where there are too few samples for the fit.
    """
    inputs, outputs = inputs[:MOST_SAMPLES], outputs[:MOST_SAMPLES]
    answers = [_evidence(inputs, column) for column in outputs.T]
    known = [answer for answer in answers if answer is not None]
    return Answer(*np.max(known, axis=0).tolist()) if known else None


def _evidence(inputs: FloatArray, output: FloatArray) -> FloatArray | None:
    """Return the largest evidence of u[k+1], u[k] and u[k-1] for one output, shape (3,)."""
    table, target = _table(inputs, output)
    if len(table) < 3 * table.shape[1]:
        return None
    left, sizes, right = np.linalg.svd(table, full_matrices=False)
    kept = sizes > SINGULAR * sizes[0]
    inverse = right[kept].T / sizes[kept]
    coefficients = inverse @ (left[:, kept].T @ target)
    off = target - table @ coefficients
    noise = float(off @ off) / (len(table) - np.count_nonzero(kept))
    deviations = np.sqrt(noise * np.sum(inverse**2, axis=1))
    evidence = np.abs(coefficients) / np.maximum(deviations, 1e-300)
    of_inputs = evidence[LAGS : LAGS + 3 * inputs.shape[1]]
    return np.asarray(of_inputs.reshape(3, -1).max(axis=1))


def _table(inputs: FloatArray, output: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the columns of a fit, scaled: past outputs, inputs, 1; and the outputs to fit."""
    rows = np.arange(LAGS, len(output) - 1)
    past = [output[rows - lag] for lag in range(1, LAGS + 1)]
    driven = [inputs[rows - lag, i] for lag in range(-1, LAGS + 1) for i in range(inputs.shape[1])]
    table = np.stack([*past, *driven, np.ones(len(rows))], axis=1)
    return table / np.maximum(np.linalg.norm(table, axis=0), 1e-300), output[rows]


def is_moved(inputs: FloatArray, output: FloatArray) -> bool | None:
    """Tell whether any input moves an output, linearly, by an F-test of the fit with and without.

    Args:
        inputs: shape (N, n_inputs), without gaps.
        output: shape (N,).

    Returns:
        None where there are too few samples for the fit.
    """
    table, target = _table(inputs[:MOST_SAMPLES], output[:MOST_SAMPLES])
    if len(table) < 3 * table.shape[1]:
        return None
    alone = np.concatenate([table[:, :LAGS], table[:, -1:]], axis=1)
    with_inputs, without = (_left_over(columns, target) for columns in (table, alone))
    explained = (without - with_inputs) / (table.shape[1] - alone.shape[1])
    return bool(explained > MOVED * with_inputs / (len(table) - table.shape[1]))


def _left_over(table: FloatArray, target: FloatArray) -> float:
    """Return the residual sum of squares of a fit."""
    coefficients = np.linalg.lstsq(table, target, rcond=SINGULAR)[0]
    return float(np.sum((target - table @ coefficients) ** 2))


def check_pairing(records: Sequence[Record], preparation: Preparation) -> tuple[Finding, ...]:
    """Remark outputs that answer at another sample than the preparation says, or not at all.

    The records are taken as they are measured, each at its longest piece without gaps.

    Raises:
        RecordError: a record lacks a column, or its time does not rise.
    """
    findings = []
    for record in records:
        piece = longest_piece(record, preparation.inputs, preparation.outputs)
        answer = answer_of(*piece)
        if answer is not None:
            findings += _contradictions(record, preparation, answer)
        findings += _unmoved(record, preparation.outputs, *piece)
    return (*findings, *_set_points(records, preparation))


def _set_points(records: Sequence[Record], preparation: Preparation) -> list[Finding]:
    """Remark inputs that hardly ever move: what follows a change is all that is ever seen."""
    tables = [record.chosen(preparation.inputs) for record in records]
    changes = sum(int((np.abs(np.diff(table, axis=0)) > 0).any(axis=1).sum()) for table in tables)
    if changes >= FEW_CHANGES:
        return []
    samples = sum(map(len, tables))
    return [
        Finding(
            "set points",
            "remarked",
            records[0].path,
            "",
            f"the inputs {list(preparation.inputs)} change at {changes} of {samples} samples",
            f"at least {FEW_CHANGES} changes, so that the outputs show how fast the machine "
            "forgets",
            "record inputs that move, such as steps at random times, a sweep or a multisine",
        )
    ]


def _unmoved(
    record: Record, names: Sequence[str], inputs: FloatArray, outputs: FloatArray
) -> list[Finding]:
    findings = []
    for name, output in zip(names, outputs.T, strict=True):
        if is_moved(inputs, output) is not False:
            continue
        delay = dead_time(inputs, output)
        if delay is None:
            findings.append(_unanswered(record, name, is_white_noise(inputs, output)))
        elif delay > LAGS:
            findings.append(_late(record, name, delay))
    return findings


def _late(record: Record, name: str, delay: int) -> Finding:
    return Finding(
        "dead time",
        "remarked",
        record.path,
        name,
        f"it answers the inputs after about {delay} samples",
        f"an answer within {LAGS}",
        "all is well if the machine has such a dead time, which the window holds; else its clock "
        "is late",
    )


def _unanswered(record: Record, name: str, is_noise: bool) -> Finding:
    expected = "an output that answers the inputs"
    if is_noise:
        return Finding(
            "noise",
            "refused",
            record.path,
            name,
            "it is white noise: neither the inputs nor their squares nor its own past say "
            "anything about it",
            expected,
            "check the column, its sensor and its clock, or leave it out",
        )
    return Finding(
        "unmoved",
        "remarked",
        record.path,
        name,
        "no input moves it, as far as a linear fit shows",
        expected,
        "check the columns, and whether their clocks are the same; what follows the square of "
        "an input about 0 looks so too",
    )


def _contradictions(record: Record, preparation: Preparation, answer: Answer) -> list[Finding]:
    evidence = (
        f"a linear fit weighs u[k+1], u[k] and u[k-1] in y[k] by {answer.ahead:.1f}, "
        f"{answer.now:.1f} and {answer.before:.1f} standard deviations"
    )
    if answer.foresees:
        what = "outputs that no later input moves"
        remedy = (
            "the outputs are stamped too early, or were filtered: shift or record them anew; if "
            "the input bends between samples, as a smooth one does, nothing is wrong"
        )
    elif answer.pairing not in (None, preparation.pairing):
        what = f"what belongs to the pairing {preparation.pairing!r}"
        remedy = f"use the pairing {answer.pairing!r}, unless the stamps are wrong"
    else:
        return []
    return [Finding("pairing", "remarked", record.path, "", evidence, what, remedy)]
