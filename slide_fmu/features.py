"""Features: what a network sees of the newest inputs, as named signals, and what each is for.

A set of features is a pure function of the newest input and the three before it. Its signals
have names; a network picks those it needs by their roles. All are formed in float64: differences
cancel.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from slide_fmu.serial_chain import SerialChain
from slide_fmu.signals import FloatArray

BEFORE = 3
"""Inputs before the newest that features may depend on."""

MAX_DIFFERENCES = 2
"""Highest order of the differences of inputs."""


@dataclass(frozen=True)
class Roles:
    """Which signals a state-space network uses, and for what: indices of its features.

    Attributes:
        drive: f, what moves the states.
        static: w, what the values follow at once.
        gated: g, what gated units multiply beside the states.
        schedule: s, what opens and closes gated units.
        readout: r, factors of the values beside the constant one.
        turn: cosine and sine of the angle of the frame in which gated units act; or none.
    """

    drive: tuple[int, ...]
    static: tuple[int, ...]
    gated: tuple[int, ...] = ()
    schedule: tuple[int, ...] = ()
    readout: tuple[int, ...] = ()
    turn: tuple[int, ...] = ()

    def highest(self) -> int:
        """The highest index used; -1 if there is none."""
        return max((i for field in fields(self) for i in getattr(self, field.name)), default=-1)


class Features(abc.ABC):
    """A set of features of scaled inputs. Interface; implementations are final.

    Attributes:
        n_channels: number of input channels.
        blocks: names of the signals in their order, with the number of each.
        centred: names of those whose mean is removed before they are scaled.
        bounded: names of those that lie within -1 and 1 anyway and are left as they are.
    """

    n_channels: int
    blocks: dict[str, int]
    centred: frozenset[str] = frozenset()
    bounded: frozenset[str] = frozenset()

    @abc.abstractmethod
    def of(self, inputs: FloatArray) -> FloatArray:
        """Signals at every sample that has ``BEFORE`` samples before it.

        Args:
            inputs: scaled inputs, shape (B, N + BEFORE, n_channels).

        Returns:
            Shape (B, N, n_signals).
        """

    @property
    def n_signals(self) -> int:
        """Number of all signals."""
        return sum(self.blocks.values())

    def along(self, sequences: NDArray[Any]) -> FloatArray:
        """Signals along sequences; inputs before a sequence count as equal to its first.

        Args:
            sequences: scaled inputs, shape (B, N, n_channels).

        Returns:
            Shape (B, N, n_signals).
        """
        inputs = np.asarray(sequences, dtype=np.float64)
        return self.of(np.pad(inputs, ((0, 0), (BEFORE, 0), (0, 0)), mode="edge"))

    def indices(self, names: tuple[str, ...]) -> tuple[int, ...]:
        """Indices of the signals of some names, in their order.

        Raises:
            ValueError: there are no signals of a name.
        """
        unknown = [name for name in names if name not in self.blocks]
        if unknown:
            raise ValueError(f"no features named {unknown}; expected some of {list(self.blocks)}")
        ends = dict(zip(self.blocks, np.cumsum(list(self.blocks.values())), strict=True))
        return tuple(
            int(i) for name in names for i in range(ends[name] - self.blocks[name], ends[name])
        )


class Differences(Features):
    """The inputs and their backward differences. Final.

    Signals: ``inputs``; from order 1 on ``changes``, u_k - u_(k-1); at order 2
    ``second_changes``, the changes of those.

    Raises:
        ValueError: an order or a number of channels out of range.
    """

    NAMES = ("inputs", "changes", "second_changes")
    bounded = frozenset({"inputs"})

    def __init__(self, n_channels: int, order: int = 0) -> None:
        if not 0 <= order <= MAX_DIFFERENCES or n_channels < 1:
            raise ValueError(
                f"features of {n_channels} inputs with differences = {order}; expected at least "
                f"one input and differences from 0 to {MAX_DIFFERENCES}"
            )
        self.n_channels, self.order = n_channels, order
        self.blocks = dict.fromkeys(self.NAMES[: order + 1], n_channels)

    def of(self, inputs: FloatArray) -> FloatArray:
        """Inputs, first and second differences: (B, N + BEFORE, c) to (B, N, c (order + 1))."""
        parts = [inputs]
        for _ in range(self.order):
            parts.append(np.diff(parts[-1], axis=1))
        count = inputs.shape[1] - BEFORE
        return np.concatenate([part[:, part.shape[1] - count :] for part in parts], axis=2)


class Director(Features):
    """The motion of an angle given by its cosine and sine. Final.

    Signals: ``direction``, cosine and sine of the angle whatever the length of the director;
    ``turn``, the change of the angle in a step, in (-pi, pi]; ``turn_change``, its change.
    """

    n_channels = 2
    bounded = frozenset({"direction"})
    blocks = {"direction": 2, "turn": 1, "turn_change": 1}  # noqa: RUF012 (final, never changed)

    def of(self, inputs: FloatArray) -> FloatArray:
        """(B, N + BEFORE, 2) to (B, N, 4)."""
        angles = np.arctan2(inputs[:, 1:, 1], inputs[:, 1:, 0])
        turns = np.diff(angles, axis=1)
        turns -= 2 * np.pi * np.ceil((turns - np.pi) / (2 * np.pi))
        newest = angles[:, 2:]
        parts = [np.cos(newest), np.sin(newest), turns[:, 1:], np.diff(turns, axis=1)]
        return np.stack(parts, axis=2)


class ChainMotion(Features):
    """What a serial chain does that follows its joint angles: rigid-body loads on its base. Final.

    The inputs are the set points of the joint angles. The joints move on the quadratic B-spline
    through them: with constant acceleration in every step (``mbs_models.set_points``). All signals
    are those at the end of the step. Signals in SI units, in the axes of the base:

    - ``wrench``: force and moment on the base (recursive Newton-Euler); ``wrench_change``: its
      change in the step; ``position``: of the tool point; ``rates``: of the joints;
    - ``frame``: cosine and sine of the first joint's angle, and in the axes that turn with it:
      ``turned_wrench_change``, ``turned_inertia`` (first moment and inertia tensor of the chain
      about the base's origin, ``SerialChain.base_inertia``, 9) and ``turned_momentum`` (linear
      and angular, 6).

    A base on soft ground moves by M(q) xi'' + (...) xi' + K xi = wrench: drive, statics and
    schedule of its response are among the signals.

    Args:
        chain: geometry and masses.
        middle, half_range: of the inputs' ranges in rad, shape (n_joints,): angle = middle +
            half_range * scaled input.
        step: sample step h in s.
    """

    WIDTHS: ClassVar[dict[str, int | None]] = {
        "wrench": 6,
        "wrench_change": 6,
        "position": 3,
        "rates": None,
        "frame": 2,
        "turned_wrench_change": 6,
        "turned_inertia": 9,
        "turned_momentum": 6,
    }
    """Numbers of signals by name; None: one for each joint."""
    centred = frozenset({"wrench", "turned_inertia", "position"})
    bounded = frozenset({"frame"})

    def __init__(
        self, chain: SerialChain, middle: FloatArray, half_range: FloatArray, step: float
    ) -> None:
        n = len(chain.masses)
        if np.shape(middle) != (n,) or np.shape(half_range) != (n,):
            raise ValueError(
                f"chain of {n} joints with {np.size(middle)} inputs; expected one input per joint"
            )
        if not (np.all(np.isfinite(middle)) and np.all(np.isfinite(half_range))):
            raise ValueError("chain: a middle or half range of the inputs is not finite")
        if not (np.isfinite(step) and step > 0):
            raise ValueError(f"chain: step {step} s; expected a positive, finite step")
        self.n_channels = n
        self.chain, self.step = chain, step
        self.middle, self.half_range = np.asarray(middle), np.asarray(half_range)
        self.blocks = {name: width or n for name, width in self.WIDTHS.items()}

    def of(self, inputs: FloatArray) -> FloatArray:
        """(B, N + BEFORE, n_joints) to (B, N, n_signals)."""
        points = self.middle + self.half_range * inputs
        angles = 0.5 * (points[:, 2:] + points[:, 1:-1])
        changes = np.diff(points, axis=1) / self.step
        accelerations = np.diff(changes, axis=1) / self.step
        wrenches = self.chain.base_wrench(angles, changes[:, 1:], accelerations)
        angles, rates = angles[:, 1:], changes[:, 2:]
        wrench, change = wrenches[:, 1:], np.diff(wrenches, axis=1)
        position = self.chain.tool_position(angles)
        turn, angles[..., 0] = angles[..., 0].copy(), 0.0  # as seen from the turned axes
        inertia = self.chain.base_inertia(angles)[..., 1:]
        momentum = self.chain.base_momentum(angles, rates)
        frame = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        turned = [_turned(change, turn), inertia, momentum]
        return np.concatenate([wrench, change, position, rates, frame, *turned], axis=2)


def _turned(vectors: FloatArray, angle: FloatArray) -> FloatArray:
    """Vectors (..., 3 m), three by three, in axes turned about z by an angle (...)."""
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    x, y, z = vectors[..., 0::3], vectors[..., 1::3], vectors[..., 2::3]
    turned = np.stack([c * x + s * y, c * y - s * x, z], axis=-1)
    return turned.reshape(vectors.shape)


class FeatureMap:
    """The features that a network sees: some signals of a set, centred and scaled. Final.

    Args:
        features: the set.
        chosen: indices of its signals, in the order in which the network takes them; all if not
            given.
        offset: subtracted from them, shape (len(chosen),); zeros if not given.
        scale: what they are then divided by, shape (len(chosen),); ones if not given.

    Raises:
        ValueError: an index is out of range, an offset not finite, or a scale not positive.
    """

    def __init__(
        self,
        features: Features,
        chosen: tuple[int, ...] | None = None,
        offset: NDArray[Any] | None = None,
        scale: NDArray[Any] | None = None,
    ) -> None:
        self.features = features
        self.chosen = tuple(range(features.n_signals)) if chosen is None else chosen
        if not self.chosen or not 0 <= min(self.chosen) <= max(self.chosen) < features.n_signals:
            raise ValueError(
                f"chosen features {self.chosen}; expected at least one, each from 0 to "
                f"{features.n_signals - 1}"
            )
        count = len(self.chosen)
        self.offset = np.zeros(count) if offset is None else np.asarray(offset, dtype=np.float64)
        self.scale = np.ones(count) if scale is None else np.asarray(scale, dtype=np.float64)
        fine = np.all(np.isfinite(self.offset)) and np.all(np.isfinite(self.scale))
        if self.offset.shape != (count,) or self.scale.shape != (count,) or not fine:
            raise ValueError(
                f"feature offset of shape {self.offset.shape}, scale of shape "
                f"{self.scale.shape}; expected {count} finite numbers each"
            )
        if not np.all(self.scale > 0):
            raise ValueError(f"feature scale {self.scale.tolist()}; expected positive numbers")

    @property
    def n_channels(self) -> int:
        """Number of input channels."""
        return self.features.n_channels

    @property
    def n_signals(self) -> int:
        """Number of features that the network takes."""
        return len(self.chosen)

    def along(self, sequences: NDArray[Any]) -> NDArray[np.float32]:
        """Features along sequences: (B, N, n_channels) to (B, N, n_signals), float32.

        Inputs before a sequence count as equal to its first.
        """
        signals = self.features.along(sequences)[:, :, list(self.chosen)]
        return ((signals - self.offset) / self.scale).astype(np.float32)
