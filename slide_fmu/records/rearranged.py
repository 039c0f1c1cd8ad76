"""This module makes other inputs of a record out of its own, within its ranges and its band.

A network may have states that it does not leave again, where a record never led it. Inputs in
another order, mirrored, backwards and about other levels lead it to more places, and stay what the
machine may see: within the ranges that were measured, as fast, and as smooth.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slide_fmu.core.signals import FloatArray

SHORTEST, LONGEST = 0.25, 2.0
"""Shortest and longest stretch that is cut out, in windows."""
FADED = 0.05
"""Part of a window over which one stretch fades into the next."""


def rearranged(
    blocks: Sequence[FloatArray], window: int, samples: int, seed: int = 0
) -> FloatArray:
    """Return about ``samples`` other inputs, shape (n, n_inputs), made of the blocks of a record.

    Args:
        blocks: inputs of its pieces, (N, n_inputs) each.
        window: samples of a window.
        samples: wanted number of samples.
        seed: of the random numbers.
    """
    rng, whole = np.random.default_rng(seed), np.concatenate(list(blocks))
    low, high = whole.min(axis=0), whole.max(axis=0)
    fade = max(1, int(FADED * window))
    lengths = np.array([len(block) for block in blocks], dtype=float)
    made, count = list[FloatArray](), 0
    while count < samples:
        block = blocks[rng.choice(len(blocks), p=lengths / lengths.sum())]
        length = min(len(block), int(rng.uniform(SHORTEST, LONGEST) * window) + 2 * fade)
        first = rng.integers(len(block) - length + 1)
        stretch = block[first : first + length]
        if rng.random() < 0.5:
            stretch = stretch[::-1]
        if rng.random() < 0.5:
            stretch = low + high - stretch
        # another level, as far as the range allows
        room = np.stack([low - stretch.min(axis=0), high - stretch.max(axis=0)])
        stretch = stretch + room[0] + rng.random(len(low)) * (room[1] - room[0])
        made.append(_joined(made[-1], stretch, fade) if made else stretch)
        count += len(stretch)
    return np.concatenate(made)


def _joined(before: FloatArray, stretch: FloatArray, fade: int) -> FloatArray:
    """Return a stretch that begins where the one before it ends."""
    share = np.clip(np.arange(1, len(stretch) + 1) / fade, 0.0, 1.0)[:, None]
    return np.asarray((1 - share) * before[-1] + share * stretch)
