"""The picture of the decay times: two panels for the slider-crank, two for the robot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slide_fmu.core.signals import FloatArray
from slide_fmu.memory.decay import Decay

DARK, BLUE, ORANGE, RED, GREY = "#222222", "#1f77b4", "#ff7f0e", "#d62728", "#888888"
TRUNCATED = 1.0
"""The robot's truncated window in the paper in s."""
PAPER_BAND = (1.1, 1.83)
"""Decay times of the second pair in the paper, in s."""


@dataclass(frozen=True, eq=False)
class CrankCase:
    """The slider-crank with one drive.

    Attributes:
        gains: P in N m/rad, D in N m s/rad.
        times: decay times of the slowest modes in s, shape (angles, modes).
        frequencies: their imaginary parts in rad/s, same shape; 0 for modes that do not swing.
        rigid: number of eigenvalues of rigid-body modes, which are left out.
    """

    gains: tuple[float, float]
    times: FloatArray
    frequencies: FloatArray
    rigid: int


@dataclass(frozen=True, eq=False)
class Findings:
    """All decay times.

    Attributes:
        angles: crank angles in rad.
        cranks: by the name of the drive.
        crank_measured: measured decay times of the driven ones.
        step: sample step of the robot in s.
        linearized: along the robot's motions, that of the paper first.
        measured: pairs of motions under each of them, in the same order.
    """

    angles: FloatArray
    cranks: Mapping[str, CrankCase]
    crank_measured: Mapping[str, Decay]
    step: float
    linearized: Sequence[Decay]
    measured: Sequence[Decay]

    def from_start(self) -> FloatArray:
        """When what was there at the start of each of the robot's motions has decayed, in s.

        The rates of the slowest mode add up to ln(1 %); a motion that is too short goes on with
        its mean rate. Shape (motions,).
        """
        return np.array([_from_start(decay, self.step) for decay in self.linearized])


def _from_start(decay: Decay, step: float) -> float:
    exponents = 0.5 * step * (decay.rates[1:] + decay.rates[:-1])
    decayed = np.cumsum([0.0, *exponents]) / math.log(decay.remaining_amplitude)
    decayed = np.maximum.accumulate(decayed)
    if decayed[-1] < 1.0:
        return decay.mean
    return float(np.interp(1.0, decayed, step * np.arange(len(decayed))))


def draw(found: Findings, path: Path) -> None:
    """Write the picture as PNG."""
    figure = Figure(figsize=(11, 8), layout="constrained")
    (free, driven), (along, beside) = figure.subplots(2, 2)
    case, *others = found.cranks.values()
    _draw_modes(free, found.angles, case)
    free.axhspan(*PAPER_BAND, color=BLUE, alpha=0.12, lw=0)
    free.annotate("paper: 1.1 .. 1.83 s", (np.pi, 1.0), ha="center", va="top", fontsize=8)
    free.set_title("a) slider-crank without drive, rigid-body mode left out")
    _draw_driven(driven, found.angles, others)
    _draw_way(along, found)
    _draw_comparison(beside, found)
    for ax in (free, driven, along, beside):
        ax.grid(alpha=0.3, which="major")
    figure.savefig(path, dpi=130, metadata={"Software": None})


def _draw_modes(ax: Axes, angles: FloatArray, case: CrankCase) -> None:
    names = ("first bending pair", "second bending pair", "slowest mode that does not swing")
    for times, color, name in zip(case.times.T, (BLUE, ORANGE, GREY), names, strict=True):
        ax.semilogy(angles, times, color=color, label=name)
    _label_crank(ax)
    ax.legend(loc="center right", fontsize=8)


def _draw_driven(ax: Axes, angles: FloatArray, cases: Sequence[CrankCase]) -> None:
    for case, style in zip(cases, ("-", "--"), strict=True):
        bending = iter((BLUE, ORANGE))
        for times, swing in zip(case.times.T, case.frequencies.T, strict=True):
            drive = not swing.any()
            color = RED if drive else next(bending)
            ax.semilogy(angles, times, style, color=color)
            if drive:
                low, high = np.min(times), np.max(times)
                span = f"{high:.2g}" if high < 1.01 * low else f"{low:.2g} .. {high:.2g}"
                gains = f"P = {case.gains[0]:g} N m/rad, D = {case.gains[1]:g} N m s/rad"
                text = f"drive with {gains}: {span} s"
                ax.annotate(text, (np.pi, 1.15 * high), ha="center", fontsize=8, color=RED)
    largest = np.max(cases[0].times[:, 0])
    ax.annotate(
        f"first bending pair: up to {largest:.3g} s", (np.pi, 2.2), ha="center", fontsize=8
    )
    ax.annotate("second bending pair", (np.pi, 0.13), ha="center", fontsize=8)
    ax.set_ylim(top=110)
    ax.set_title("b) slider-crank with two drives, dashed: the weak one")
    _label_crank(ax)


def _label_crank(ax: Axes) -> None:
    ax.set_xticks(np.pi * np.arange(0, 2.5, 0.5), ["0", "π/2", "π", "3π/2", "2π"])
    ax.set(xlabel="crank angle / rad", ylabel="decay time to 1 % / s", xlim=(0, 2 * np.pi))


def _draw_way(ax: Axes, found: Findings) -> None:
    paper, start = found.linearized[0], float(found.from_start()[0])
    measured = found.measured[0].mean
    time = found.step * np.arange(len(paper.times))
    ax.plot(time, paper.times, color=BLUE, label="slowest mode, sample by sample")
    lines = (("of the mean rate", paper.mean, DARK, "-"), ("from the start", start, ORANGE, "-"))
    for name, value, color, style in (*lines, ("measured", measured, RED, "--")):
        ax.axhline(value, color=color, ls=style, lw=1, label=f"{name}: {value:.3g} s")
    ax.set(xlabel="time / s", ylabel="decay time to 1 % / s", xlim=(0, time[-1]))
    shown = [*paper.times[np.isfinite(paper.times)], measured]
    ax.set_ylim(0, 1.15 * max(shown))
    ax.set_title("c) robot, trajectory of the paper's figure")
    ax.legend(loc="lower right", fontsize=8)


def _draw_comparison(ax: Axes, found: Findings) -> None:
    linearized = found.from_start()[1:]
    measured = np.array([decay.mean for decay in found.measured[1:]])
    known = measured[np.isfinite(measured)]
    limit = 1.1 * float(np.max([*linearized, *known, TRUNCATED]))
    ax.plot([0, limit], [0, limit], color=DARK, lw=1)
    ax.plot(linearized, measured, "o", ms=4, color=BLUE, alpha=0.7, label="a trajectory")
    ax.plot(np.mean(linearized), np.mean(known), "+", ms=14, mew=2, color=RED, label="mean")
    ax.axhline(TRUNCATED, color=GREY, ls="--", lw=1)
    ax.axvline(TRUNCATED, color=GREY, ls="--", lw=1, label="truncated window of the paper")
    ax.set(xlim=(0, limit), ylim=(0, limit), aspect="equal")
    ax.set(xlabel="linearized, from the start / s", ylabel="measured / s")
    ax.set_title(f"d) robot, {len(linearized)} random trajectories")
    ax.legend(loc="lower right", fontsize=8, framealpha=1.0)
