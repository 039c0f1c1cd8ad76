"""What a user must know about an FMU, in a few lines: first on console, report and card."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from slide_fmu.core.measures import percent
from slide_fmu.core.units import behind
from slide_fmu.report.validity import is_valid
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.plain_call import late_words, worst_of

MOST_INPUTS = 3
"""Of more inputs, the ranges stand in the table of variables alone."""


Figures = Mapping[str, Any]


@dataclass(frozen=True)
class Subject:
    """This is what a verdict is about.

    Attributes:
        inputs: name, low, high and unit of each input of the FMU.
        memory: time in s for which its outputs depend on an input.
        step: the FMU's step in s, at which all errors are measured.
        planned: whether its inputs are planned motions.
    """

    inputs: tuple[tuple[str, float, float, str], ...]
    memory: float
    step: float
    planned: bool = False

    @classmethod
    def of(cls, surrogate: Surrogate) -> Subject:
        """Return what a surrogate's verdict is about."""
        inputs = tuple((s.name, s.low, s.high, s.unit) for s in surrogate.inputs)
        step = surrogate.window.step
        return cls(inputs, surrogate.network.memory_length * step, step, surrogate.planned)


def verdict(measured: Figures, subject: Subject) -> tuple[str, ...]:
    """Return at most seven lines about an FMU, the error of the plain call first.

    Args:
        measured: the figures of its report; what was not measured may be missing.
        subject: what its verdict is about.
    """
    validations = sorted(
        measured.get("validation", {}).values(),
        key=lambda v: (v["amplitude"][1] > 1, bool(v.get("held_out"))),
    )
    if not validations:
        return ()
    in_range = validations[0]
    found = [
        _plain(measured, in_range, subject),
        _smooth_or_known(measured.get("plain_call"), subject.planned),
        _box(measured.get("box")),
        _bound(in_range, measured),
        _estimate(in_range),
        _valid(subject, in_range, validations[1:]),
        _time(in_range.get("timing", {}))
        + f"Its outputs depend on the inputs of the last {subject.memory:.4g} s.",
    ]
    return tuple(sentence for sentence in found if sentence)


def _up_to(error: float, outputs: Sequence[Figures]) -> str:
    return percent(error) if len(outputs) == 1 else f"up to {percent(error)}"


def _plain(measured: Figures, in_range: Figures, subject: Subject) -> str:
    """Say the error of the plain call at the FMU's own step."""
    found = measured.get("plain_call")
    outputs = found["outputs"] if found else in_range["outputs"]
    if not found:
        known = _up_to(max(o["relative_rmse"] for o in outputs), outputs)
        if "plain_relative_rmse" not in outputs[0]:
            return f"Relative RMSE: {known} on inputs that no training saw."
        plain = _up_to(max(o["plain_relative_rmse"] for o in outputs), outputs)
        return (
            f"Relative RMSE on inputs that no training saw: {plain} in the plain call, "
            f"fmpy.simulate_fmu, and {known} with inputs known to the step's end "
            "(slide_fmu.simulate)."
        )
    rough, smooth = worst_of(outputs, "rough"), worst_of(outputs, "smooth")
    parts = [] if smooth is None else [f"{_up_to(smooth, outputs)} under smooth inputs"]
    single = max((o.get("smooth_worst") or 0.0 for o in outputs), default=0.0)
    if parts and single:
        parts[0] += f" ({percent(single)} in the worst motion)"
    if rough is not None:
        parts.append(f"{_up_to(rough, outputs)} under inputs as in the training")
    call = f"fmpy.simulate_fmu with output_interval = {subject.step:g}"
    return f"Relative RMSE of the plain call, {call}: {', '.join(parts)}."


def _smooth_or_known(found: Figures | None, planned: bool) -> str | None:
    """Say what inputs would cost that are smooth and held, or known ahead."""
    if found is None:
        return None
    held, known = (
        worst_of(found["outputs"], key) for key in ("smooth_if_held", "known_to_step_end")
    )
    if held is not None:
        told = late_words(found, _up_to(held, found["outputs"]))
        return f"Inputs are held over each step. {told[0].upper()}{told[1:]}."
    if known is not None:
        text = f"With inputs known to the step's end: {_up_to(known, found['outputs'])}."
        jumps = " An input that jumps acts like a ramp over one step, half of one late or early."
        return text if planned else text + jumps
    return None


def _box(found: Figures | None) -> str | None:
    """Say the error at constant inputs."""
    names = {"corners": "at the corners of the inputs' ranges", "steady": "inside of them"}
    parts = [
        f"{_up_to(max(o['relative_rmse'] for o in found[key]['outputs']), found[key]['outputs'])} "
        f"{text}"
        for key, text in names.items()
        if found and key in found
    ]
    return f"Error at constant inputs: {', '.join(parts)}." if parts else None


def _bound(in_range: Figures, measured: Figures) -> str | None:
    """Say what the error bound covers, and how wide it is."""
    found = in_range.get("error_bound")
    if not found:
        return "It has no error bound."
    widths = [output["width"] for output in found["outputs"] if output["width"] is not None]
    covered = _shares([output["coverage"] for output in found["outputs"]])
    plain = _shares(found.get("plain", {}).get("coverage", []))
    text = f"Its error bound of {100 * found['confidence']:g} % covers {covered} of the samples"
    if plain not in ("", covered):
        text += f" where inputs are known to the step's end, {plain} in the plain call"
    smooth = (measured.get("plain_call") or {}).get("outputs", [])
    corners = (measured.get("box") or {}).get("corners", {}).get("outputs", [])
    elsewhere = {
        "under smooth inputs": [output.get("smooth_covered") for output in smooth],
        "at the corners": [output.get("covered") for output in corners],
    }
    for where, values in elsewhere.items():
        if known := [value for value in values if value is not None]:
            text += f", {_shares(known)} {where}"
    if not widths:
        return f"{text}."
    text += f", and is {max(widths):.2g} times as wide as the best constant one"
    worse = [str(o["name"]) for o in found["outputs"] if (o.get("skill") or 0.0) < 0]
    return f"{text}; of {', '.join(worse)} the constant one says more." if worse else f"{text}."


def _shares(values: Sequence[float]) -> str:
    """Return shares in per cent, the least and the largest of several."""
    ends = [percent(value) for value in (min(values), max(values))] if values else []
    return " to ".join(dict.fromkeys(ends))


def _estimate(in_range: Figures) -> str | None:
    """Say what the error estimate is worth."""
    found = (in_range.get("error_estimate") or {}).get("without_floor", [])
    pairs = [
        (o["mean"], o["constant_mean"]) for o in found if "mean" in o and "constant_mean" in o
    ]
    if not pairs:
        return None
    own, constant = max(pairs)
    return (
        f"Its error estimate is off by {percent(own)} on average, the best constant by "
        f"{percent(constant)}."
    )


def _valid(subject: Subject, in_range: Figures, others: Sequence[Figures]) -> str:
    """Say for which inputs the FMU is valid, and for which it is not."""
    ranges = [f"{name} {low:g} .. {high:g}{behind(unit)}" for name, low, high, unit in
              subject.inputs]  # fmt: skip
    shown = f" ({', '.join(ranges)})" if len(ranges) <= MOST_INPUTS else ""
    text = f"Valid for inputs like those of its training, within their ranges{shown}."
    kinds = (in_range.get("error_bound") or {}).get("excitations", [])
    bad = [kind["name"] for kind in kinds if kind.get("harm") and not is_valid(kind["harm"])]
    if bad:
        text += f" Not for {', '.join(bad)}: more of their errors than usual are large."
    for figures in others:
        error = percent(max(output["relative_rmse"] for output in figures["outputs"]))
        if figures.get("held_out"):
            text += f" Other kinds of input that were measured: {error}."
        else:
            low, high = figures["amplitude"]
            text += f" Beyond the range, at {low:g} to {high:g} times the amplitude: {error}."
    return text


def _time(found: Figures) -> str:
    """Say what a step takes, next to one of the model; nothing where it was not measured."""
    if "fmu_step_us" not in found:
        return ""
    text = f"A step takes {found['fmu_step_us']:.3g} us"
    if "speedup" not in found:
        return f"{text}. "
    return f"{text}, one of the model {found['speedup']:.3g} times as long. "
