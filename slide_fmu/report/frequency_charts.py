"""This module draws the responses of reference and surrogate, and the error over frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import ratio
from slide_fmu.core.web.charts import Axis, Chart, HeatCell, HeatMap, Line, Panel
from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.trajectory_charts import own_line, true_line
from slide_fmu.validation.error_map import ErrorMap, error_map
from slide_fmu.validation.frequency import ComplexArray, Spectra, spectra_of
from slide_fmu.validation.results import Validation

FREQUENCY = Axis("frequency", "Hz", log=True)

RESPONSES = (
    "How the outputs answer to an input at each frequency, found in the same way from what the "
    "reference gave and from what the surrogate gave (H1 estimates by Welch's method over all "
    "trajectories). Of a nonlinear system it is the linear answer that comes nearest to these "
    "motions. For each output, the input is drawn that moves it most; the other pairs are among "
    "the details. Frequencies at which the input has no power are left out."
)

OTHER_RESPONSES = (
    "The same for the other inputs of each output, the strongest first. An input is left out "
    "where it causes less than {least} of the output's power: its response is then too uncertain "
    "to judge."
)

LEAST_SHARE = 0.01
"""Smallest part of an output's power for which the response to an input is drawn."""

MAP = "Error by amplitude and frequency"

SPECTRA = (
    "Amplitude densities of the outputs and of the error over all trajectories. Where the line of "
    "the error meets that of the reference, the surrogate knows nothing of these frequencies; "
    "where it lies far below, it does."
)


def frequency_sections(validation: Validation) -> list[ReportSection]:
    """Return the sections on frequencies; empty where the trajectories are too short."""
    surrogate = validation.surrogate
    spectra = spectra_of(validation.comparisons, surrogate.window.step, surrogate.hold)
    if spectra is None:
        return []
    outputs = range(len(validation.surrogate.outputs))
    strongest, others = _response_charts(validation, spectra)
    outputs = range(len(validation.surrogate.outputs))
    errors = [_spectrum_chart(validation, spectra, i) for i in outputs]
    responses = ReportSection("Frequency response", RESPONSES, charts=strongest)
    text = OTHER_RESPONSES.format(least=percent(LEAST_SHARE))
    further = ReportSection("Frequency response of other inputs", text, charts=others, folded=True)
    return [
        *(section for section in (responses, further) if section.charts),
        ReportSection("Error spectrum", SPECTRA, charts=errors, folded=True),
    ]


def _response_charts(validation: Validation, spectra: Spectra) -> tuple[list[Chart], list[Chart]]:
    """Draw the strongest input of each output, and the other pairs that can be judged."""
    powers = spectra.powers()
    strongest, others = [], []
    for output, power in enumerate(powers.T):
        least = LEAST_SHARE * power.sum()
        ranked = [int(i) for i in np.argsort(-power, kind="stable") if power[i] > 0]
        ranked = [i for i in ranked if np.sum(spectra.driven(i)) > 1]
        charts = [
            _response_chart(validation, spectra, i, output) for i in ranked if power[i] >= least
        ]
        strongest += charts[:1]
        others += charts[1:]
    return strongest, others


def _response_chart(validation: Validation, spectra: Spectra, channel: int, output: int) -> Chart:
    """Draw size and phase of both responses of a pair, and their difference."""
    driven = spectra.driven(channel)
    one, other = validation.surrogate.inputs[channel], validation.surrogate.outputs[output]
    frequency = spectra.frequency[driven]
    true, own = (response[driven, channel, output] for response in spectra.responses())
    apart = np.abs(own - true) / np.maximum(np.abs(true), np.finfo(float).tiny)
    panels = [
        Panel(
            "size",
            ratio(other.unit, one.unit),
            _both(validation, frequency, np.abs(true), np.abs(own)),
            log=True,
        ),
        Panel(
            "phase", "°", _both(validation, frequency, _phase(true), _phase(own)), height="short"
        ),
        Panel(
            "deviation over size",
            "1",
            [Line("deviation", frequency, apart, "bad")],
            log=True,
            height="short",
        ),
    ]
    return Chart(f"{one.name} to {other.name}", panels, FREQUENCY)


def _spectrum_chart(validation: Validation, spectra: Spectra, output: int) -> Chart:
    signal = validation.surrogate.outputs[output]
    unit = ratio(signal.unit, "√Hz")
    true, own, error = (
        np.sqrt(density[:, output])
        for density in (spectra.reference, spectra.surrogate, spectra.error)
    )
    lines = [
        *_both(validation, spectra.frequency, true, own),
        Line("error", spectra.frequency, error, "bad"),
    ]
    return Chart(signal.name, [Panel("density", unit, lines, log=True)], FREQUENCY)


def _both(
    validation: Validation, frequency: FloatArray, true: FloatArray, own: FloatArray
) -> list[Line]:
    return [true_line(validation, frequency, true), own_line(frequency, own)]


def _phase(response: ComplexArray) -> FloatArray:
    return np.asarray(np.angle(response, deg=True))


def error_maps(validation: Validation) -> list[HeatMap]:
    """Return the heat map of a validation; none where it would have fewer than two cells."""
    errors = error_map(validation)
    if errors is None or not np.nansum(errors.error) or np.isfinite(errors.error).sum() < 2:
        return []
    return [_heat_map(errors)]


def _heat_map(errors: ErrorMap) -> HeatMap:
    """Draw the largest amplitudes on top, and the lowest frequencies on the left."""
    text = (
        f"Relative RMSE of the worst output, in pieces of {errors.seconds:.3g} s. "
        "Amplitude and frequency are those of the input that moves most in a piece."
    )
    rows = _part_names([100 * edge for edge in errors.amplitudes[1:]], " %")
    columns = _part_names(errors.frequencies.tolist(), "")
    known = errors.error[np.isfinite(errors.error) & (errors.error > 0)]
    low, high = np.log(known.min()), np.log(known.max())
    cells = [
        [_cell(error, int(count), low, high) for error, count in zip(*row, strict=True)]
        for row in zip(errors.error, errors.pieces, strict=True)
    ]
    down, last = "part of the range", int(np.flatnonzero(errors.pieces.sum(axis=1))[-1])
    rows, cells = rows[last::-1], cells[last::-1]
    return HeatMap(MAP, text, "frequency / Hz", down, columns, rows, cells)


def _cell(error: float, count: int, low: float, high: float) -> HeatCell | None:
    if count == 0:
        return None
    level = (np.log(max(error, np.exp(low))) - low) / max(high - low, 1e-9)
    return HeatCell(percent(float(f"{error:.2g}")), float(level), f"{count} pieces")


def _part_names(edges: Sequence[float], unit: str) -> list[str]:
    """Name the parts between edges; the first and the last one are open."""
    texts = [decimal(edge, 6) for edge in edges]
    if not texts:
        return ["all"]
    between = [f"{one} to {other}{unit}" for one, other in pairwise(texts)]
    return [f"below {texts[0]}{unit}", *between, f"above {texts[-1]}{unit}"]
