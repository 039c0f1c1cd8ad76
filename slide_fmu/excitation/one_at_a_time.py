"""One input moves alone, while the others rest, as users try a machine: one input at a time."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PrivateAttr

from slide_fmu.core.signals import FloatArray, Signal, by_axis
from slide_fmu.excitation.base import Kind


class OneAtATime(Kind):
    """One random input moves as in another kind of the same mix, and the others rest.

    They rest at their start values, or where the other kind would let them begin.
    Cosine and sine of an angle are one input. The amplitude factor acts as in the other kind.

    Attributes:
        moves_as: name of the kind of the mix as which the input moves, such as ``"harmonic"``; if
            not given, any of the other kinds.
    """

    kind: Literal["one_at_a_time"]
    moves_as: str | None = None
    _like: Kind | None = PrivateAttr(None)

    @property
    def bends(self) -> bool:  # type: ignore[override]  # a constant of most kinds
        """Whether the input that moves is curved between samples, as in the other kind."""
        return self._like is not None and self._like.bends

    @property
    def jumps(self) -> bool:  # type: ignore[override]  # a constant of most kinds
        """Whether the input that moves changes at once, as in the other kind."""
        return self._like is not None and self._like.jumps

    def jumping(self, inputs: FloatArray) -> NDArray[np.bool_]:
        assert self._like is not None  # ``drawing_kind`` has chosen it
        return self._like.jumping(inputs)

    def may_move_as(self, other: Kind) -> bool:
        """Tell whether the input may move as in another kind."""
        return self.moves_as is None or getattr(other, "kind", "") == self.moves_as

    def like(self, other: Kind) -> OneAtATime:
        """Return the kind whose input moves as in another kind; ``inputs`` needs that."""
        kind = self.model_copy()
        kind._like = other
        return kind

    def check(self, signals: tuple[Signal, ...]) -> None:
        """Refuse a single input: it moves alone in all other kinds.

        Raises:
            ValueError: there is one input, or one angle.
        """
        if len(by_axis(signals)) < 2:
            raise ValueError(
                f"kind = 'one_at_a_time' with the input {' and '.join(s.name for s in signals)}; "
                "expected two inputs or more: remove it"
            )

    def described(self, signals: tuple[Signal, ...], step: float) -> str:
        like = self.moves_as or "the other kinds"
        return f"one input alone moves, as in {like}, and the others rest"

    def inputs(
        self,
        signals: tuple[Signal, ...],
        time: FloatArray,
        factor: float,
        rng: np.random.Generator,
    ) -> FloatArray:
        assert self._like is not None  # ``drawing_kind`` has chosen it
        inputs = self._like.inputs(signals, time, factor, rng).copy()
        moved = {
            signal.name
            for signal, extent in zip(signals, np.ptp(inputs, axis=0), strict=True)
            if extent > 0.0
        }
        axes, at_start = by_axis(signals), rng.random() < 0.5
        moving = [axis for axis in axes if moved & {signal.name for signal in axis}] or axes
        alone = moving[int(rng.integers(len(moving)))]
        for index, signal in enumerate(signals):
            if signal not in alone:
                start = at_start and signal.angle is None  # zero and zero are no angle
                inputs[:, index] = signal.start_value if start else inputs[0, index]
        return inputs
