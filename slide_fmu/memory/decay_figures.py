"""The figures of decay times and windows, with SI units in their names, as JSON files hold them.

None stands for what the system does not offer, and in a time for one without end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from slide_fmu.core.window import Window
from slide_fmu.memory.decay import Decay
from slide_fmu.memory.motions import Linearized


@dataclass(frozen=True, kw_only=True)
class DecayTimes:
    """These are decay times in s: that of the mean rate, and the longest one."""

    mean: float | None
    worst: float | None

    @classmethod
    def of(cls, decay: Decay) -> DecayTimes:
        """Return the times of a decay."""
        return cls(mean=finite(decay.mean), worst=finite(decay.worst))


@dataclass(frozen=True, kw_only=True)
class LinearizedTimes(DecayTimes):
    """These are decay times in s from the eigenvalues, and the longest one at an instant."""

    local_worst: float | None


@dataclass(frozen=True, kw_only=True)
class ModeFigures:
    """This is a mode of the system linearized at rest."""

    frequency_rad_s: float
    damping_ratio: float
    decay_time_s: float | None


@dataclass(frozen=True, kw_only=True)
class WindowSize:
    """These are the lengths of a window."""

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
    """This says whether a window is long enough.

    Attributes:
        recommended_n_in: shortest length that is.
        refusal: why no window can hold the system; None if one can.
        remark: what one should know.
    """

    window: WindowSize
    recommended_n_in: int | None
    sufficient: bool
    refusal: str | None
    remark: str | None


@dataclass(frozen=True, kw_only=True)
class SystemSizing(SizingVerdict):
    """This is how a window holds a system that is simulated.

    What the equations say (all but ``measured_decay_time_s``) is None if they are not offered.
    """

    remaining_amplitude: float
    decay_time_s: LinearizedTimes | None
    modes_at_rest: tuple[ModeFigures, ...] | None
    rigid_body_eigenvalues: int | None
    measured_decay_time_s: DecayTimes


@dataclass(frozen=True, kw_only=True)
class FittedTime:
    """This is a decay time in s of a linear fit, with its 95 % interval."""

    value: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, kw_only=True)
class SlowestPole:
    """This is the slowest pole of a linear fit: rate and deviation in 1/s, frequency in rad/s."""

    rate_1_s: float
    rate_deviation_1_s: float
    angular_frequency_rad_s: float


@dataclass(frozen=True, kw_only=True)
class LinearModel:
    """These are the sizes of a linear fit."""

    order: int
    states: int


@dataclass(frozen=True, kw_only=True)
class RecordSizingFigures(SizingVerdict):
    """This is how a window holds what was recorded, by a linear fit of the records."""

    remaining_amplitude: float
    fitted_decay_time_s: FittedTime
    slowest_pole: SlowestPole
    linear_model: LinearModel


SizingFigures = SystemSizing | RecordSizingFigures


def seconds(value: float | None) -> str:
    """Write a decay time in s as people read it; None stands for a motion that never decays."""
    return "without end" if value is None else f"{value:.4g} s"


def finite(value: float) -> float | None:
    """Return a number for JSON, which knows no infinity: None stands for it."""
    return value if math.isfinite(value) else None


def linearized_times(linearized: Linearized | None) -> LinearizedTimes | None:
    """Return the decay times of what was linearized, if anything was."""
    if linearized is None:
        return None
    times = DecayTimes.of(linearized.decay)
    return LinearizedTimes(**vars(times), local_worst=finite(linearized.local_worst))


def mode_figures(linearized: Linearized | None) -> tuple[ModeFigures, ...] | None:
    """Return the modes at rest of what was linearized, if anything was."""
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
