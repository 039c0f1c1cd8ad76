"""The modes of a linearized, constrained system have decay times of their own.

The method is in the paper, section "Computation of decay time in linearized multibody systems",
with corrections of its printed formulas: the right singular vectors span the nullspace of the
constraint Jacobian G, and the eigenvalues come from the generalized problem, which also handles
rigid-body modes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import Linearized, StateMatrix

INSTANT = 1e6
"""Eigenvalues above this multiple of the system's rate belong to coordinates without mass."""
UNSTABLE = 1e-6
"""Re(v) above this fraction of |v| is growth; smaller values are rounding of an undamped mode."""


class UnstableModeError(ValueError):
    """A mode grows, so the system never forgets its initial state."""


@dataclass(frozen=True)
class Mode:
    """A Mode decays with the rate of its eigenvalue; a conjugate pair of eigenvalues is one mode.

    Attributes:
        eigenvalue: v in 1/s, with a nonnegative imaginary part.
        decay_time: time in s until only the remaining amplitude is left; infinite for an undamped
            mode.
    """

    eigenvalue: complex
    decay_time: float

    @property
    def natural_frequency(self) -> float:
        """The natural frequency is omega_0 = |v| in rad/s."""
        return abs(self.eigenvalue)

    @property
    def damping_ratio(self) -> float:
        """The damping ratio is D = -Re(v) / |v|, 1 for an overdamped mode."""
        return -self.eigenvalue.real / abs(self.eigenvalue)


@dataclass(frozen=True)
class Spectrum:
    """A Spectrum has all modes of a linearized system.

    Attributes:
        modes: modes other than rigid-body modes, the slowest first.
        rigid: eigenvalues in 1/s of rigid-body modes, which neither decay nor oscillate: two for
            each free direction, one if it is damped.
        n_instant: number of infinite eigenvalues, of coordinates without mass, which follow the
            others at once.
    """

    modes: tuple[Mode, ...]
    rigid: tuple[complex, ...]
    n_instant: int

    @property
    def decay_time(self) -> float:
        """The decay time in s of the slowest mode; 0 without modes; rigid bodies do not count."""
        return self.modes[0].decay_time if self.modes else 0.0


def time_to_decay(rate: float, remaining_amplitude: float) -> float:
    """Return the time t_d = ln(A_rel) / Re(v) in s for a rate in 1/s.

    It is infinite if the rate is not negative.

    Raises:
        ValueError: the remaining amplitude A_rel is not between 0 and 1.
    """
    if not 0.0 < remaining_amplitude < 1.0:
        raise ValueError(
            f"remaining amplitude = {remaining_amplitude}; expected a fraction between 0 and 1, "
            "for example 0.01"
        )
    return math.log(remaining_amplitude) / rate if rate < 0.0 else math.inf


def nullspace(constraints: FloatArray, rank_tolerance: float = 1e-10) -> FloatArray:
    """Return unit directions, (n, n_free), that constraints (n_constraints, n) leave free.

    Redundant rows are allowed: singular values below ``rank_tolerance`` times the largest count as
    zero.
    """
    if len(constraints) == 0:
        return np.eye(constraints.shape[1])
    import scipy.linalg  # showing what was measured does not need it

    _, singular, right = scipy.linalg.svd(constraints)
    rank = int(np.sum(singular > rank_tolerance * singular[0]))
    return np.ascontiguousarray(right[rank:].T)


def spectrum(
    linearization: Linearized, remaining_amplitude: float = 0.01, uncertainty: float = 1e-10
) -> Spectrum:
    """Compute the modes of a system linearized at one state.

    The modes are in the directions that the constraints leave free; initial effects decay to the
    remaining amplitude A_rel. The uncertainty of the stiffness, relative to its norm, comes from
    rounding and numerical differentiation. A mode that the uncertainty alone can explain is a
    rigid-body mode.

    Raises:
        UnstableModeError: a mode has Re(v) > 0.
        ValueError: a matrix is not finite, or a free coordinate has neither mass nor force.
    """
    values, rigid, n_instant = _finite_eigenvalues(linearization, uncertainty)
    _refuse_growth(values)
    one_of_each_pair = values[values.imag >= 0.0].tolist()
    slowest_first = sorted(one_of_each_pair, key=lambda v: (-v.real, v.imag))
    modes = tuple(Mode(v, time_to_decay(_rate(v), remaining_amplitude)) for v in slowest_first)
    return Spectrum(modes, tuple(rigid.tolist()), n_instant)


def slowest_rate(linearization: Linearized, uncertainty: float = 1e-10) -> float:
    """Return Re(v) in 1/s of the mode that decays most slowly, at one instant of a motion.

    The rate is positive if the mode grows. During a motion it may grow for a while, since the
    equations change with time. The rate is 0 for an undamped mode, and if all modes are rigid-body
    modes, as for a rate limiter at its limit. Without modes it is minus infinity.

    Raises:
        ValueError: as for ``spectrum``.
    """
    values, rigid, _ = _finite_eigenvalues(linearization, uncertainty)
    nothing = 0.0 if len(rigid) else -math.inf
    return max((_rate(value) for value in values.tolist()), default=nothing)


def _finite_eigenvalues(
    linearization: Linearized, uncertainty: float
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], int]:
    """Return eigenvalues in 1/s of modes, of rigid-body modes, and the number of infinite ones."""
    if isinstance(linearization, StateMatrix):
        return _of_first_order(linearization.matrix, uncertainty)
    free = nullspace(linearization.constraints)
    mass, damping, stiffness = (
        free.T @ matrix @ free
        for matrix in (linearization.mass, linearization.damping, linearization.stiffness)
    )
    values, shapes, n_instant = _eigenvalues(mass, damping, stiffness)
    unresolved = uncertainty * float(np.linalg.norm(stiffness))
    rigid = np.abs(values) <= _rigid_limits(mass, damping, unresolved, shapes)
    return values[~rigid], values[rigid], n_instant


def _of_first_order(
    matrix: FloatArray, uncertainty: float
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], int]:
    """Return the same for x' = A x; a rigid-body mode is then an integrator of its input."""
    if not np.isfinite(matrix).all():
        raise ValueError("linearization: the state matrix is not finite")
    values = np.asarray(np.linalg.eigvals(matrix), dtype=np.complex128)
    rigid = np.abs(values) <= uncertainty * float(np.linalg.norm(matrix))
    return values[~rigid], values[rigid], 0


def _rigid_limits(
    mass: FloatArray, damping: FloatArray, stiffness: float, shapes: NDArray[np.complex128]
) -> FloatArray:
    """Return |v| in 1/s, (n_modes,), up to which a small stiffness k alone explains a mode.

    A stiffness of either sign moves v by at most the positive root of v^2 m + v d - k = 0, with
    the mass m and the damping d of the mode's shape, a column of unit length. The formula avoids
    cancellation.
    """
    m, d = (np.abs(np.sum(shapes.conj() * (matrix @ shapes), 0)) for matrix in (mass, damping))
    root = d + np.sqrt(d**2 + 4 * m * stiffness)
    return np.asarray(np.divide(2 * stiffness, root, out=np.zeros_like(root), where=root > 0))


def _eigenvalues(
    mass: FloatArray, damping: FloatArray, stiffness: FloatArray
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], int]:
    """Return finite v of v^2 M + v D + K, their shapes of unit length, and the number of others.

    The linear problem is A z = -v B z for z = [q, q'] with A = [[K, D], [0, -I]] and B = [[0, M],
    [I, 0]]. It is the paper's form with I for M in the second row, so that a singular M gives
    infinite eigenvalues instead of undetermined ones.
    """
    for name, matrix in (("mass", mass), ("damping", damping), ("stiffness", stiffness)):
        if not np.isfinite(matrix).all():
            raise ValueError(f"linearization: {name} matrix is not finite")
    n = len(mass)
    if n == 0:
        nothing = np.zeros(0, dtype=np.complex128)
        return nothing, nothing[:, None], 0
    size, stiff, damped = (float(np.linalg.norm(m)) for m in (mass, stiffness, damping))
    if size == 0.0:
        raise ValueError("linearization: mass matrix is zero; expected mass in some coordinate")
    # time is scaled by the system's rate: all blocks have the same order of magnitude
    rate = max(math.sqrt(stiff / size), damped / size) or 1.0
    one, zero = np.eye(n), np.zeros((n, n))
    a = np.block([[stiffness / (size * rate**2), damping / (size * rate)], [zero, -one]])
    b = np.block([[zero, mass / size], [one, zero]])
    import scipy.linalg

    (alpha, beta), vectors = scipy.linalg.eig(a, -b, homogeneous_eigvals=True)
    scale = np.maximum(np.abs(alpha), np.abs(beta))
    if np.any(scale < 1e-12):  # 0 / 0: the pencil is singular
        raise ValueError(
            "linearization: a free coordinate has neither mass nor stiffness nor damping; "
            "expected one of them: fix it, or give it a constraint"
        )
    finite = np.abs(alpha) < INSTANT * np.abs(beta)
    shapes = vectors[:n, finite]
    shapes /= np.maximum(np.linalg.norm(shapes, axis=0), np.finfo(np.float64).tiny)
    return rate * alpha[finite] / beta[finite], shapes, int(np.sum(~finite))


def _refuse_growth(values: NDArray[np.complex128]) -> None:
    """Raise UnstableModeError with the fastest growing mode, if any grows."""
    growing = values[values.real > UNSTABLE * np.abs(values)]
    if len(growing):
        worst = growing[np.argmax(growing.real)]
        raise UnstableModeError(
            f"mode with v = {worst:.6g} 1/s ({abs(worst) / (2 * math.pi):.4g} Hz) grows; expected "
            "Re(v) <= 0: check signs of damping and control gains, and linearize at a state that "
            "the system really takes (all spring offsets and set points of that instant)"
        )


def _rate(eigenvalue: complex) -> float:
    """Return Re(v) in 1/s; rounding of an undamped mode does not count as damping."""
    return 0.0 if abs(eigenvalue.real) <= UNSTABLE * abs(eigenvalue) else eigenvalue.real
