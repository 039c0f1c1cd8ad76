"""Input shapers are what is usual against residual vibration: baselines, and starts of a search.

A shaper sends parts of a motion later, so that their vibrations cancel (Singer and Seering,
"Preshaping command inputs to reduce system vibration", 1990). The modes are those of the
surrogate's own free response: nothing else is needed than the surrogate.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray

ORDER = 8
"""So many states describe a free response: up to four modes."""

MOST_DAMPED = 0.7
"""A mode with a larger damping ratio does not ring."""


@dataclass(frozen=True)
class Ringing:
    """A mode rings after a motion.

    Attributes:
        frequency: undamped angular frequency, in rad/s.
        damping: its damping ratio.
        energy: sum of its squares in all outputs, relative to the whole response's.
    """

    frequency: float
    damping: float
    energy: float


@dataclass(frozen=True, eq=False)
class Shaper:
    """A Shaper is a row of impulses.

    Attributes:
        name: such as ``"ZV on 2 modes"``.
        delays: of the impulses in s, rising from 0, shape (n,).
        parts: their sizes, which add up to 1, shape (n,).
    """

    name: str
    delays: FloatArray
    parts: FloatArray


NONE = Shaper("not shaped", np.zeros(1), np.ones(1))


def ringing_modes(response: FloatArray, step: float) -> list[Ringing]:
    """Find the modes that ring in a free response, that of the most energy first.

    This is the eigensystem realization algorithm (Juang and Pappa, 1985).

    Args:
        response: outputs about where they come to rest, shape (N, n_outputs).
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
    found = []
    for pole, part in zip(poles, parts, strict=True):
        rate = np.log(pole) / step
        if pole.imag <= 0 or rate.real >= 0 or -rate.real > MOST_DAMPED * abs(rate):
            continue
        alone = 2 * (basis[:, poles == pole] @ part[None]).real
        energy = float(np.sum(alone**2) / np.sum(scaled**2))
        found.append(Ringing(abs(rate), -rate.real / abs(rate), energy))
    return sorted(found, key=lambda mode: -mode.energy)


def shapers(modes: list[Ringing]) -> list[Shaper]:
    """Give ZV and ZVD shapers on the strongest mode, and on the two strongest ones."""
    found = []
    for count in range(1, min(2, len(modes)) + 1):
        on = "1 mode" if count == 1 else f"{count} modes"
        zv = [_zero_vibration(mode) for mode in modes[:count]]
        found.append(_joined(f"ZV on {on}", zv))
        found.append(_joined(f"ZVD on {on}", zv + zv))
    return found


def _zero_vibration(mode: Ringing) -> Shaper:
    """Two impulses half a damped period apart, whose vibrations cancel."""
    root = np.sqrt(1 - mode.damping**2)
    left = np.exp(-mode.damping * np.pi / root)
    return Shaper(
        "", np.array([0.0, np.pi / (mode.frequency * root)]), np.array([1, left]) / (1 + left)
    )


def _joined(name: str, shapers: list[Shaper]) -> Shaper:
    """One shaper after the other: every impulse of one with every one of the others."""
    rows = list(itertools.product(*(zip(s.delays, s.parts, strict=True) for s in shapers)))
    delays = np.array([sum(delay for delay, _ in row) for row in rows])
    parts = np.array([np.prod([part for _, part in row]) for row in rows])
    order = np.argsort(delays)
    return Shaper(name, delays[order], parts[order])
