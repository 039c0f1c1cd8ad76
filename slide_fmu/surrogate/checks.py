"""What the parts of a surrogate must have in common: checked once, when it is made."""

from __future__ import annotations

import math

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import Signal, check_inputs, cosines_of
from slide_fmu.core.window import MAX_WINDOW, Window
from slide_fmu.network.base import Network
from slide_fmu.network.state_space import StateSpace

START_TOLERANCE = 1e-12
"""How far a start may lie outside offset -+ scale, relative to |offset| + scale: rounding."""


def check_signals(
    inputs: tuple[Signal, ...], outputs: tuple[Signal, ...], scaling: Affine
) -> None:
    """Refuse inputs that do not belong together, and angles that are scaled off the circle.

    Args:
        inputs: in channel order.
        outputs: in channel order; they have neither hold nor angle.
        scaling: of the inputs.

    Raises:
        ValueError: with the signal and what was expected of it.
    """
    check_inputs(inputs)
    for signal in outputs:
        if (signal.hold, signal.angle) != ("zero_order", None):
            raise ValueError(
                f"output {signal.name!r} with hold {signal.hold!r} and angle {signal.angle!r}; "
                "expected neither: only inputs act between samples"
            )
    for index in cosines_of(inputs):
        pair = slice(index, index + 2)
        offset, scale = scaling.offset[pair].tolist(), scaling.scale[pair].tolist()
        if offset != [0.0, 0.0] or scale[0] != scale[1]:
            raise ValueError(
                f"inputs {index} and {index + 1} are cosine and sine of an angle with offsets "
                f"{offset} and scales {scale}; expected offsets of 0 and one scale for both"
            )


def check_starts(scaling: Affine, inputs: tuple[Signal, ...]) -> None:
    """Refuse start values of inputs that do not lie in offset -+ scale, the scaled range.

    Raises:
        ValueError: with the input.
    """
    rows = zip(scaling.offset.tolist(), scaling.scale.tolist(), inputs, strict=True)
    for index, (offset, scale, signal) in enumerate(rows):
        allowed = scale + START_TOLERANCE * (abs(offset) + scale)
        start = signal.start_value
        if not (math.isfinite(start) and abs(start - offset) <= allowed):
            raise ValueError(
                f"input {index} starts at {start:g}, but its scaling covers {offset - scale:g} to "
                f"{offset + scale:g}; scale the input by its range"
            )


def check_block_sizes(window: Window, network: Network, n_outputs: int) -> None:
    """Refuse a surrogate network that does not fit its window.

    Raises:
        ValueError: neither one sample per evaluation nor one block per evaluation, or a window
            that is too long.
    """
    if window.n_in > MAX_WINDOW:
        raise ValueError(f"n_in {window.n_in} out of range; expected at most {MAX_WINDOW}")
    if isinstance(network, StateSpace):
        found = (network.n_samples, network.n_out, network.n_values)
        expected = (window.n_in, window.n_out, n_outputs)
        if found != expected:
            raise ValueError(
                f"state-space network with n_samples, n_out, n_values = {found}; "
                f"expected {expected}, those of the window and the outputs"
            )
        return
    one = (window.receptive_field, n_outputs)
    block = (window.n_in, window.n_out * n_outputs)
    if (network.n_samples, network.n_values) not in (one, block):
        raise ValueError(
            f"surrogate network maps {network.n_samples} samples to {network.n_values} values; "
            f"expected {one[0]} to {one[1]} or {block[0]} to {block[1]}"
        )
