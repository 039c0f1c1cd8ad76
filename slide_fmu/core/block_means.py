"""Means over the last samples are formed by blocks, at the cost of a few additions per sample."""

from __future__ import annotations

import math

import numpy as np

from slide_fmu.core.signals import FloatArray

N_BLOCKS = 8
"""Number of whole blocks that a mean covers, besides the block that has begun."""


def block_means(values: FloatArray, block: int) -> FloatArray:
    """Give means over the last whole blocks and the one that has begun, of the same shape.

    Blocks are counted from the first sample of the sequences (B, N, c). Values before it are those
    of the first sample.
    """
    count, length, channels = values.shape
    n_blocks = -(-length // block)
    after = np.zeros((count, n_blocks * block - length, channels))
    parts = np.concatenate([values, after], axis=1).reshape(count, n_blocks, block, channels)
    begun = np.cumsum(parts, axis=2)
    before = np.repeat(block * values[:, :1], N_BLOCKS, axis=1)
    whole = np.concatenate([before, begun[:, :, -1]], axis=1)
    views = np.lib.stride_tricks.sliding_window_view(whole[:, :-1], N_BLOCKS, axis=1)
    sums = views.sum(axis=-1)[:, :, None] + begun
    means = sums / (N_BLOCKS * block + np.arange(1, block + 1))[:, None]
    return np.asarray(means.reshape(count, n_blocks * block, channels)[:, :length])


def block_lengths(step: float, spans: tuple[float, float] = (0.1, 1.0)) -> tuple[int, int]:
    """Give the number of samples in short and in long blocks, for means over these spans in s."""
    short, long = (max(1, math.ceil(span / step / N_BLOCKS)) for span in spans)
    return short, long


def span_samples(block: int) -> int:
    """Return the average number of samples that a mean over such blocks covers."""
    return N_BLOCKS * block + (block + 1) // 2
