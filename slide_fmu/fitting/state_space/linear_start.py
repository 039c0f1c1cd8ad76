"""A state-space fit of a known system starts from linear models with its eigenvalues."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy.linalg
import torch
from numpy.typing import NDArray

from slide_fmu.recipe.against_system import require_turned_pairs

LARGEST_POLE = 0.995
"""Largest radius of the poles of a start; a fit may exceed it again."""
NEIGHBOURS = 1.3
"""Two oscillations whose eigenvalues differ by less than this factor count as one that turns."""
MEMORIES = (0.2, 0.6)
"""Range of pole radii given to extra, fast states."""
EXCITED_POWER = 0.999
"""Fraction of the power of the state input in the excited band."""


class LinearModel(NamedTuple):
    """A LinearModel is x[k+1] = A x[k] + B f[k], y[k+1] = C x[k+1].

    Attributes:
        a: A, shape (n, n).
        b: B, shape (n, q), for the state input f of scaled features.
        c: C, shape (p, n), for the scaled outputs y.
    """

    a: torch.Tensor
    b: torch.Tensor
    c: torch.Tensor


def band_edge(drive: torch.Tensor, step: float) -> float:
    """Return the angular frequency in rad/s below which nearly all power of the state input lies.

    Sequences (n_trajectories, N, q) with the step in s are faded in and out (Hann window);
    otherwise the spectrum of an oscillation with incomplete periods would leak.
    """
    fade = torch.hann_window(drive.shape[1], dtype=drive.dtype, device=drive.device)
    faded = fade[:, None] * drive
    power = torch.fft.rfft(faded, dim=1).abs().square().sum((0, 2)).cumsum(0)
    bins = int((power < EXCITED_POWER * power[-1]).sum())
    return 2 * math.pi * bins / (drive.shape[1] * step)


def excited_eigenvalues(
    eigenvalues: NDArray[np.complex128], drive: torch.Tensor, step: float
) -> NDArray[np.complex128]:
    """Return the eigenvalues in 1/s in the excited band, the lowest first; at least one.

    The state input has the shape (n_trajectories, N, q), the step is in s.
    """
    ordered = eigenvalues[np.argsort(np.abs(eigenvalues), kind="stable")]
    count = int(np.sum(np.abs(ordered) <= band_edge(drive, step)))
    return ordered[: max(1, count)]


def lowest_eigenvalues(
    eigenvalues: NDArray[np.complex128], order: int
) -> NDArray[np.complex128] | None:
    """Return the lowest eigenvalues that need exactly ``order`` states; None if impossible.

    A real eigenvalue needs one state, an eigenvalue of a conjugate pair needs two.
    """
    ordered = eigenvalues[np.argsort(np.abs(eigenvalues), kind="stable")]
    places = np.flatnonzero(np.cumsum(_states_of_each(ordered)) == order)
    return ordered[: places[0] + 1] if places.size else None


def states_of(eigenvalues: NDArray[np.complex128]) -> int:
    """Count the states that eigenvalues need: two for an eigenvalue of a conjugate pair."""
    return int(np.sum(_states_of_each(eigenvalues)))


def _states_of_each(eigenvalues: NDArray[np.complex128]) -> NDArray[np.int64]:
    return np.where(eigenvalues.imag != 0, 2, 1)


def from_eigenvalues(
    eigenvalues: NDArray[np.complex128],
    step: float,
    sizes: tuple[int, int],
    generator: torch.Generator,
) -> LinearModel:
    """Build a linear model in modal form with the poles exp(v h), and random B and C.

    The eigenvalues v are in 1/s, one of each conjugate pair; the sizes are numbers of state inputs
    and of outputs.
    """
    pairs = zip(eigenvalues, _states_of_each(eigenvalues), strict=True)
    modes = [_mode(value, step)[:n, :n] for value, n in pairs]
    a = torch.from_numpy(scipy.linalg.block_diag(*modes))

    def random(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    scale = 1 / math.sqrt(len(a))
    return pulled_inside(a, scale * random(len(a), sizes[0]), scale * random(sizes[1], len(a)))


def from_turned_pairs(
    eigenvalues: NDArray[np.complex128],
    step: float,
    sizes: tuple[int, int, int, int],
    generator: torch.Generator,
) -> LinearModel:
    """Build a linear model whose first states are pairs that turn with the system about z.

    Two neighbouring oscillations of nearly equal frequency are treated as one that may have any
        direction across the axis, with their mean eigenvalue: two pairs. Further states belong to
        the next oscillations, and some forget fast. The state input and the outputs are vectors
        (x, y, z), one after the other: pairs are moved only by x and y, and move only these. The
        sizes are numbers of states, of pairs among them, of state inputs and of outputs.
    """
    order, pairs, n_drive, n_outputs = sizes
    require_turned_pairs(pairs, order, n_drive, n_outputs)
    a = torch.zeros(order, order, dtype=torch.float64)
    turning, single = _turning_modes(eigenvalues)
    blocks = [_mode(value, step) for value in turning[: pairs // 2]]
    memories = _memories(pairs - 2 * len(blocks))
    for index, block in enumerate(blocks):
        a[4 * index : 4 * index + 4, 4 * index : 4 * index + 4] = torch.kron(block, torch.eye(2))
    for index, pole in enumerate(memories):
        state = 4 * len(blocks) + 2 * index
        a[state, state] = a[state + 1, state + 1] = pole
    first = 2 * pairs
    for value in single[: (order - first) // 2]:
        a[first : first + 2, first : first + 2] = _mode(value, step)
        first += 2
    for state, pole in enumerate(_memories(order - first), first):
        a[state, state] = pole
    scale = 1 / math.sqrt(order)
    b = _turning_matrix((order, n_drive), (pairs, 2 * pairs), generator)
    c = _turning_matrix((order, n_outputs), (pairs, 2 * pairs), generator).T
    return pulled_inside(a, scale * b, (scale * c).contiguous())


def _turning_modes(
    eigenvalues: NDArray[np.complex128],
) -> tuple[list[complex], list[complex]]:
    """Return means of neighbouring oscillations that belong together, and the other eigenvalues.

    Both are in 1/s, the lowest first.
    """
    waves = sorted((complex(v) for v in eigenvalues if v.imag > 0), key=abs)
    turning, single = [], []
    while waves:
        wave = waves.pop(0)
        if waves and abs(waves[0]) < NEIGHBOURS * abs(wave):
            turning.append(0.5 * (wave + waves.pop(0)))
        else:
            single.append(wave)
    return turning, single


def _mode(eigenvalue: complex, step: float) -> torch.Tensor:
    """Return the real 2 x 2 block of an oscillation with an eigenvalue in 1/s."""
    pole = complex(np.exp(eigenvalue * step))
    return torch.tensor([[pole.real, pole.imag], [-pole.imag, pole.real]], dtype=torch.float64)


def _memories(count: int) -> list[float]:
    """Return the poles of ``count`` states that forget fast."""
    return [float(pole) for pole in np.linspace(*MEMORIES, count)]


def _turning_matrix(
    shape: tuple[int, int], pairs: tuple[int, int], generator: torch.Generator
) -> torch.Tensor:
    """Draw coefficients, shape (order, 3 m), between states and vectors that turn alike.

    A pair commutes with every turn if its block is a I + b J, with a quarter turn J. ``pairs`` has
    the number of pairs among the states, and the number of states in them.
    """
    result = torch.zeros(*shape, dtype=torch.float64)
    for first in range(0, shape[1], 3):
        along, across = torch.randn(2, pairs[0], 1, 1, generator=generator, dtype=torch.float64)
        turn = torch.tensor([[0.0, -1.0], [1.0, 0.0]], dtype=torch.float64)
        blocks = along * torch.eye(2, dtype=torch.float64) + across * turn
        result[: pairs[1], first : first + 2] = blocks.reshape(pairs[1], 2)
        rest = shape[0] - pairs[1]
        result[pairs[1] :, first + 2] = torch.randn(rest, generator=generator, dtype=torch.float64)
    return result


def pulled_inside(a: torch.Tensor, b: torch.Tensor, c: torch.Tensor) -> LinearModel:
    """Return the linear model with its poles pulled inside the circle of ``LARGEST_POLE``."""
    values, vectors = torch.linalg.eig(a)
    radius = values.abs()
    if float(radius.max()) > LARGEST_POLE:
        kept = values * (LARGEST_POLE / radius).clamp_max(1.0)
        a = torch.linalg.solve(vectors, kept * vectors, left=False).real.contiguous()
    return LinearModel(a, b, c)
