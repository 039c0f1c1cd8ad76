"""This module draws the responses of reference and surrogate, and spectra of the error."""

from __future__ import annotations

import numpy as np

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
    "motions. Of several inputs the one is drawn that moves the output most; frequencies at which "
    "it has no power are left out."
)

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
    responses = [_response_chart(validation, spectra, i) for i in outputs]
    errors = [_spectrum_chart(validation, spectra, i) for i in outputs]
    return [
        ReportSection(
            "Frequency response", RESPONSES, charts=[c for c in responses if c is not None]
        ),
        ReportSection("Error spectrum", SPECTRA, charts=errors),
    ]


def _response_chart(validation: Validation, spectra: Spectra, output: int) -> Chart | None:
    """Draw size and phase of both responses of an output, and their difference."""
    true, own = (response[:, :, output] for response in spectra.responses())
    power = np.einsum("fi,fii->i", np.abs(true) ** 2, spectra.inputs.real)
    channel = int(np.argmax(power))
    driven = spectra.driven(channel)
    if np.sum(driven) < 2 or not power[channel] > 0:
        return None
    one, other = validation.surrogate.inputs[channel], validation.surrogate.outputs[output]
    frequency = spectra.frequency[driven]
    true, own = true[driven, channel], own[driven, channel]
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
