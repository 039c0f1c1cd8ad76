"""Input shapers are the usual method against residual vibration: baselines, and starts of a
search.

A shaper delays parts of a motion so that their vibrations cancel (Singer and Seering, "Preshaping
command inputs to reduce system vibration", 1990). The modes are identified from the surrogate's
own free response: only the surrogate is needed.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray

ORDER = 8
"""Number of states that describe a free response: up to four modes."""

MOST_DAMPED = 0.7
"""A mode with a larger damping ratio does not ring."""


@dataclass(frozen=True)
class RingingMode:
    """A RingingMode is a mode that vibrates after a motion.

    Attributes:
        frequency: undamped angular frequency, in rad/s.
        damping: damping ratio.
        energy: sum of its squares in all outputs, relative to the whole response.
    """

    frequency: float
    damping: float
    energy: float


@dataclass(frozen=True, eq=False)
class Shaper:
    """A Shaper is a sequence of impulses.

    Attributes:
        name: for example ``"ZV on 2 modes"``.
        delays: delays of the impulses in s, rising from 0, shape (n,).
        parts: their sizes, with the sum 1, shape (n,).
    """

    name: str
    delays: FloatArray
    parts: FloatArray


NONE = Shaper("not shaped", np.zeros(1), np.ones(1))


def ringing_modes(response: FloatArray, step: float) -> list[RingingMode]:
    """Find the modes that vibrate in a free response, in falling order of energy.

    The method is the eigensystem realization algorithm (Juang and Pappa, 1985).

    Args:
        response: outputs relative to their rest, shape (N, n_outputs).
        step: time between samples, in s.
    """
    scale = np.abs(response).max()
    if scale == 0 or len(response) < 4 * ORDER:
        return []
    scaled, rows = response / scale, len(response) // 2
    hankel = np.stack([scaled[k : k + rows + 1] for k in range(len(scaled) - rows)])
    before, after = (h.reshape(len(hankel), -1) for h in (hankel[:, :-1], hankel[:, 1:]))
    u, values, vt = np.linalg.svd(before, full_matrices=False)
    order = int(np.sum(values[:ORDER] > 1e-6 * values[0]))
    root = np.sqrt(values[:order])
    poles = np.linalg.eigvals((u[:, :order] / root).T @ after @ (vt[:order].T / root))
    basis = poles[None] ** np.arange(len(scaled))[:, None]
    parts = np.linalg.lstsq(basis, scaled.astype(complex), rcond=None)[0]
    modes = []
    for pole, part in zip(poles, parts, strict=True):
        rate = np.log(pole) / step
        if pole.imag <= 0 or rate.real >= 0 or -rate.real > MOST_DAMPED * abs(rate):
            continue
        alone = 2 * (basis[:, poles == pole] @ part[None]).real
        energy = float(np.sum(alone**2) / np.sum(scaled**2))
        modes.append(RingingMode(abs(rate), -rate.real / abs(rate), energy))
    return sorted(modes, key=lambda mode: -mode.energy)


def shapers(modes: list[RingingMode]) -> list[Shaper]:
    """Return ZV and ZVD shapers for the strongest mode, and for the two strongest ones."""
    chosen = []
    for count in range(1, min(2, len(modes)) + 1):
        on = "1 mode" if count == 1 else f"{count} modes"
        zv = [_zero_vibration(mode) for mode in modes[:count]]
        chosen.append(_joined(f"ZV on {on}", zv))
        chosen.append(_joined(f"ZVD on {on}", zv + zv))
    return chosen


def _zero_vibration(mode: RingingMode) -> Shaper:
    """Return two impulses half a damped period apart, whose vibrations cancel."""
    root = np.sqrt(1 - mode.damping**2)
    left = np.exp(-mode.damping * np.pi / root)
    return Shaper(
        "", np.array([0.0, np.pi / (mode.frequency * root)]), np.array([1, left]) / (1 + left)
    )


def _joined(name: str, shapers: list[Shaper]) -> Shaper:
    """Return shapers in series: every impulse of one with every impulse of the others."""
    rows = list(itertools.product(*(zip(s.delays, s.parts, strict=True) for s in shapers)))
    delays = np.array([sum(delay for delay, _ in row) for row in rows])
    parts = np.array([np.prod([part for _, part in row]) for row in rows])
    order = np.argsort(delays)
    return Shaper(name, delays[order], parts[order])
