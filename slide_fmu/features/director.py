"""Features of an angle that is given by its cosine and sine."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.byte_reader import Reader
from slide_fmu.core.signals import FloatArray, cosines_of
from slide_fmu.features.base import BEFORE, Features, Offered, PullBack
from slide_fmu.features.differences import add_differences


class Director(Features):
    """The motion of an angle given by its cosine and sine. Final.

    Signals: ``direction``, cosine and sine of the angle whatever the length of the director;
    ``turn``, the change of the angle in a step, in (-pi, pi]; ``turn_change``, its change.
    """

    TITLE = "director"
    NUMBER = 2
    NAMES = ("direction", "turn", "turn_change")
    n_before = 2
    n_channels = 2
    of_angle = True
    bounded = frozenset({"direction"})
    blocks = {"direction": 2, "turn": 1, "turn_change": 1}  # noqa: RUF012 (final, never changed)

    @classmethod
    def of_system(cls, names: tuple[str, ...], offered: Offered) -> Director:
        """Make the set on cosine and sine of an angle, which must be the only two inputs."""
        if cosines_of(offered.inputs) != (0,) or len(offered.inputs) != cls.n_channels:
            raise ValueError(
                f"features {list(names)} of {len(offered.inputs)} inputs "
                f"{[signal.name for signal in offered.inputs]}; expected two, the cosine and sine "
                'of an angle: say so with angle = "cosine" and angle = "sine" in the system\'s '
                "signals, or use other features"
            )
        return cls()

    @classmethod
    def read(cls, section: Reader, n_inputs: int) -> Director:
        """Read nothing: there are no parameters."""
        if n_inputs != cls.n_channels:
            raise ValueError(f"director of {n_inputs} inputs; expected {cls.n_channels}")
        return cls()

    def parameters(self) -> bytes:
        """Write nothing: there are no parameters."""
        return b""

    def of(self, inputs: FloatArray) -> FloatArray:
        """Form the signals: (B, N + BEFORE, 2) to (B, N, 4)."""
        angles = np.arctan2(inputs[:, 1:, 1], inputs[:, 1:, 0])
        turns = np.diff(angles, axis=1)
        turns -= 2 * np.pi * np.ceil((turns - np.pi) / (2 * np.pi))
        newest = angles[:, 2:]
        parts = [np.cos(newest), np.sin(newest), turns[:, 1:], np.diff(turns, axis=1)]
        return np.stack(parts, axis=2)

    def pull_back(self, inputs: FloatArray) -> PullBack:
        """Prepare the reverse mode in closed form.

        An angle moves with its director across it, over its length squared.
        """
        angles, squares = np.arctan2(inputs[..., 1], inputs[..., 0]), np.sum(inputs**2, axis=2)
        across = np.stack([-inputs[..., 1], inputs[..., 0]], axis=2)
        newest = angles[:, BEFORE:]

        def pull_back(weights: FloatArray) -> FloatArray:
            of_angles = np.zeros(angles.shape)
            of_newest = weights[..., 1] * np.cos(newest) - weights[..., 0] * np.sin(newest)
            for order, part in enumerate((of_newest, weights[..., 2], weights[..., 3])):
                add_differences(part, order, of_angles)
            return np.asarray(across * (of_angles / squares)[..., None])

        return pull_back
