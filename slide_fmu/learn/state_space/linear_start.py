"""Linear models that a state-space fit starts from: of eigenvalues, or of impulse responses."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy.linalg
import torch
from numpy.typing import NDArray

from slide_fmu.recipe.against_system import require_turned_pairs

RIDGE = 1e-6
"""Of the impulse responses' regression, relative to the mean power of the features."""
LARGEST_POLE = 0.995
"""Faster decay than this radius is asked of every start; a fit may leave it again."""
LEAST_SHOWN = 0.03
"""Singular values of the impulse responses below this part of the largest show no state."""
NEIGHBOURS = 1.3
"""Oscillations whose eigenvalues differ by less than this factor are taken as one that turns."""
MEMORIES = (0.2, 0.6)
"""First and last pole of states that are short memories."""
EXCITED_POWER = 0.999
"""The excited band holds this part of the drive's power."""


class LinearModel(NamedTuple):
    """x[k+1] = A x[k] + B f[k], y[k+1] = C x[k+1]."""

    a: torch.Tensor
    b: torch.Tensor
    c: torch.Tensor


def impulse_responses(
    drive: torch.Tensor, static: torch.Tensor, targets: torch.Tensor, taps: int
) -> torch.Tensor:
    """Impulse responses to the drive by ridge regression on the last samples.

    Args:
        drive: shape (n_trajectories, N, q).
        static: shape (n_trajectories, N, m): what the targets also follow at once.
        targets: shape (n_trajectories, N + 1, p); targets[k + 1] follows features[.. k].
        taps: their length.

    Returns:
        Shape (taps, p, q); the first is the response to the newest feature.
    """
    q, p = drive.shape[2], targets.shape[2]
    width = taps * q + static.shape[2] + 1
    matrix, right = drive.new_zeros(width, width), drive.new_zeros(width, p)
    for record, other, target in zip(drive, static, targets, strict=True):
        newest_first = record.unfold(0, taps, 1).flip(-1).transpose(1, 2)
        regressors = newest_first.reshape(len(newest_first), -1)
        one = regressors.new_ones(len(regressors), 1)
        rows = torch.cat([regressors, other[taps - 1 :], one], 1)
        matrix += rows.T @ rows
        right += rows.T @ target[taps:]
    matrix.diagonal().add_(RIDGE * matrix.diagonal()[:-1].mean())
    solution: torch.Tensor = torch.linalg.solve(matrix, right)
    return solution[: taps * q].view(taps, q, p).transpose(1, 2)


def _hankel(responses: torch.Tensor, shift: int) -> torch.Tensor:
    """Block Hankel matrix of impulse responses, from the first (shift 0) or the second on."""
    taps, p, q = responses.shape
    rows = taps // 2
    index = torch.arange(rows)[:, None] + torch.arange(rows)
    blocks = responses[index + shift]
    return blocks.permute(0, 2, 1, 3).reshape(rows * p, rows * q)


def states_shown(responses: torch.Tensor) -> int:
    """Number of states that impulse responses show, at least 1."""
    singular = torch.linalg.svdvals(_hankel(responses, 0))
    return int((singular > LEAST_SHOWN * singular[0]).sum())


def realize(responses: torch.Tensor, n_states: int) -> LinearModel:
    """A linear model of impulse responses: eigensystem realization (Juang and Pappa, 1985).

    Args:
        responses: shape (taps, p, q).
        n_states: order of the model.

    Raises:
        ValueError: the order is higher than the responses can show.
    """
    taps, p, q = responses.shape
    most = taps // 2 * min(p, q)
    if n_states > most:
        raise ValueError(
            f"network.order = {n_states}; expected at most {most} for impulse responses of "
            f"{taps} samples: lower it, or make the window longer"
        )
    left, singular, right = torch.linalg.svd(_hankel(responses, 0), full_matrices=False)
    root = singular[:n_states].clamp_min(1e-12 * float(singular[0])).sqrt()
    left, right = left[:, :n_states], right[:n_states].T
    a = (left / root).T @ _hankel(responses, 1) @ (right / root)
    return _pulled_inside(a, (right * root).T[:, :q], (left * root)[:p])


def band_edge(drive: torch.Tensor, step: float) -> float:
    """Angular frequency in rad/s below which nearly all power of the drive lies.

    Records fade in and out (Hann), else oscillations that do not close within them would leak.

    Args:
        drive: shape (n_trajectories, N, q).
        step: sample step in s.
    """
    fade = torch.hann_window(drive.shape[1], dtype=drive.dtype, device=drive.device)
    faded = fade[:, None] * drive
    power = torch.fft.rfft(faded, dim=1).abs().square().sum((0, 2)).cumsum(0)
    bins = int((power < EXCITED_POWER * power[-1]).sum())
    return 2 * math.pi * bins / (drive.shape[1] * step)


def excited_eigenvalues(
    eigenvalues: NDArray[np.complex128], drive: torch.Tensor, step: float
) -> NDArray[np.complex128]:
    """The eigenvalues in the excited band, the lowest first; at least one."""
    ordered = eigenvalues[np.argsort(np.abs(eigenvalues), kind="stable")]
    count = int(np.sum(np.abs(ordered) <= band_edge(drive, step)))
    return ordered[: max(1, count)]


def lowest_eigenvalues(
    eigenvalues: NDArray[np.complex128], order: int
) -> NDArray[np.complex128] | None:
    """The lowest eigenvalues that have so many states; None if no number of them has."""
    ordered = eigenvalues[np.argsort(np.abs(eigenvalues), kind="stable")]
    states = np.cumsum(np.where(ordered.imag != 0, 2, 1))
    found = np.flatnonzero(states == order)
    return ordered[: found[0] + 1] if found.size else None


def states_of(eigenvalues: NDArray[np.complex128]) -> int:
    """Number of states that they need: two for one of a conjugate pair."""
    return int(np.sum(np.where(eigenvalues.imag != 0, 2, 1)))


def from_eigenvalues(
    eigenvalues: NDArray[np.complex128],
    step: float,
    sizes: tuple[int, int],
    generator: torch.Generator,
) -> LinearModel:
    """A linear model in modal form with the poles exp(v h), and random B and C.

    Args:
        eigenvalues: v in 1/s, one of each conjugate pair.
        step: sample step h in s.
        sizes: numbers of features and outputs.
    """
    blocks = []
    for value in eigenvalues:
        pole = complex(np.exp(value * step))
        pair = [[pole.real, pole.imag], [-pole.imag, pole.real]]
        blocks.append(np.array(pair if value.imag != 0 else [[pole.real]]))
    a = torch.from_numpy(scipy.linalg.block_diag(*blocks))

    def random(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    scale = 1 / math.sqrt(len(a))
    return _pulled_inside(a, scale * random(len(a), sizes[0]), scale * random(sizes[1], len(a)))


def from_turned_pairs(
    eigenvalues: NDArray[np.complex128],
    step: float,
    sizes: tuple[int, int, int, int],
    generator: torch.Generator,
) -> LinearModel:
    """A linear model whose first states are pairs that turn with the system about the z axis.

    Two neighbouring oscillations that are nearly as fast are one that may go any way across the
    axis, with their mean eigenvalue: two pairs. Further states are the next oscillations, and
    short memories. Drive and outputs are vectors (x, y, z), one after the other: pairs are moved
    by x and y alone, and move nothing else.

    Args:
        eigenvalues: as for ``from_eigenvalues``; none are needed.
        step: sample step h in s.
        sizes: numbers of states, of pairs among them, of drives and of outputs.

    Raises:
        ValueError: drive or outputs are no vectors.
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
    return _pulled_inside(a, scale * b, (scale * c).contiguous())


def _turning_modes(
    eigenvalues: NDArray[np.complex128],
) -> tuple[list[complex], list[complex]]:
    """Means of neighbouring oscillations that belong together, and those left, lowest first."""
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
    """The 2 x 2 block of an oscillation."""
    pole = complex(np.exp(eigenvalue * step))
    return torch.tensor([[pole.real, pole.imag], [-pole.imag, pole.real]], dtype=torch.float64)


def _memories(count: int) -> list[float]:
    """Poles of short memories."""
    return [float(pole) for pole in np.linspace(*MEMORIES, count)]


def _turning_matrix(
    shape: tuple[int, int], pairs: tuple[int, int], generator: torch.Generator
) -> torch.Tensor:
    """Random coefficients between states and vectors that turn alike: (order, 3 m).

    Args:
        pairs: number of pairs among the states, and of states that they are.
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


def _pulled_inside(a: torch.Tensor, b: torch.Tensor, c: torch.Tensor) -> LinearModel:
    """A linear model with its poles pulled inside the circle."""
    values, vectors = torch.linalg.eig(a)
    radius = values.abs()
    if float(radius.max()) > LARGEST_POLE:
        kept = values * (LARGEST_POLE / radius).clamp_max(1.0)
        a = torch.linalg.solve(vectors, kept * vectors, left=False).real.contiguous()
    return LinearModel(a, b, c)
