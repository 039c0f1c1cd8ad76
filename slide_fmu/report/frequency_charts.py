"""This module draws the responses of reference and surrogate, and the error over frequencies."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.measures import percent
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import ratio
from slide_fmu.core.web.charts import Axis, Chart, Line, Panel
from slide_fmu.report.html_report import ReportSection
from slide_fmu.report.trajectory_charts import own_line, true_line
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
