"""Figures of decay times and windows have SI units in their names, for JSON files.

None means that the system does not offer a figure; for a time it means infinite.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from slide_fmu.core.readable import decimal
from slide_fmu.core.window import Window
from slide_fmu.memory.decay import Decay
from slide_fmu.memory.motions import LinearizedSystem


@dataclass(frozen=True, kw_only=True)
class DecayTimes:
    """DecayTimes are decay times in s: from the mean rate, and the longest one."""

    mean: float | None
    worst: float | None

    @classmethod
    def of(cls, decay: Decay) -> DecayTimes:
        """Return the times of a decay."""
        return cls(mean=finite(decay.mean), worst=finite(decay.worst))


@dataclass(frozen=True, kw_only=True)
class LinearizedTimes(DecayTimes):
    """LinearizedTimes are decay times in s by eigenvalues; the longest at an instant too."""

    local_worst: float | None


@dataclass(frozen=True, kw_only=True)
class ModeFigures:
    """A ModeFigures is a mode of the system linearized at rest."""

    frequency_rad_s: float
    damping_ratio: float
    decay_time_s: float | None


@dataclass(frozen=True, kw_only=True)
class WindowSize:
    """A WindowSize has the lengths of a window."""

    step_s: float
    n_in: int
    n_out: int
    truncation_time_s: float

    @classmethod
    def of(cls, window: Window) -> WindowSize:
        """Return the lengths of a window."""
        return cls(
            step_s=window.step,
            n_in=window.n_in,
            n_out=window.n_out,
            truncation_time_s=window.truncation_time,
        )


@dataclass(frozen=True, kw_only=True)
class SizingVerdict:
    """A SizingVerdict says whether a window is long enough.

    Attributes:
        recommended_n_in: shortest sufficient length.
        refusal: why no window can cover the system's memory; None if one can.
        remark: what the user should know.
    """

    window: WindowSize
    recommended_n_in: int | None
    sufficient: bool
    refusal: str | None
    remark: str | None


@dataclass(frozen=True, kw_only=True)
class SystemSizing(SizingVerdict):
    """A SystemSizing says how a window fits a system that is simulated.

    Figures from the equations (all but ``measured_decay_time_s``) are None if the system does not
    offer equations.
    """

    remaining_amplitude: float
    decay_time_s: LinearizedTimes | None
    modes_at_rest: tuple[ModeFigures, ...] | None
    rigid_body_eigenvalues: int | None
    measured_decay_time_s: DecayTimes


@dataclass(frozen=True, kw_only=True)
class FittedTime:
    """A FittedTime is a decay time in s of a linear fit, with its 95 % interval."""

    value: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, kw_only=True)
class SlowestPole:
    """A SlowestPole is from a linear fit: rate and deviation in 1/s, frequency in rad/s."""

    rate_1_s: float
    rate_deviation_1_s: float
    angular_frequency_rad_s: float


@dataclass(frozen=True, kw_only=True)
class LinearModelFigures:
    """A LinearModelFigures has the sizes of a linear fit."""

    order: int
    states: int


@dataclass(frozen=True, kw_only=True)
class RecordSizingFigures(SizingVerdict):
    """A RecordSizingFigures says how a window fits measured records, by a linear fit of them."""

    remaining_amplitude: float
    fitted_decay_time_s: FittedTime
    slowest_pole: SlowestPole
    linear_model: LinearModelFigures


SizingFigures = SystemSizing | RecordSizingFigures


def seconds(value: float | None) -> str:
    """Write a decay time in s for users; None is a motion that never decays."""
    return "without end" if value is None else f"{decimal(value, 4)} s"


def finite(value: float) -> float | None:
    """Return a number for JSON, which has no infinity: None replaces it."""
    return value if math.isfinite(value) else None


def linearized_times(linearized: LinearizedSystem | None) -> LinearizedTimes | None:
    """Return the decay times of linearized equations, if there are any."""
    if linearized is None:
        return None
    times = DecayTimes.of(linearized.decay)
    return LinearizedTimes(**vars(times), local_worst=finite(linearized.local_worst))


def mode_figures(linearized: LinearizedSystem | None) -> tuple[ModeFigures, ...] | None:
    """Return the modes at rest of linearized equations, if there are any."""
    if linearized is None:
        return None
    return tuple(
        ModeFigures(
            frequency_rad_s=mode.natural_frequency,
            damping_ratio=mode.damping_ratio,
            decay_time_s=finite(mode.decay_time),
        )
        for mode in linearized.modes.modes
    )
