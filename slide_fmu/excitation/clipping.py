"""This module finds the kinds of excitation of which many values leave their ranges."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from slide_fmu.core.measures import percent
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.excitation.base import Kind
from slide_fmu.excitation.channels import ChannelKind
from slide_fmu.excitation.recorded import Recorded
from slide_fmu.excitation.spectra import BandSines

DRAWS, SAMPLES = 40, 500
"""Number of inputs that are drawn to find the share of clipped values, and samples of each."""

OFTEN, SOME = 0.1, 0.001
"""Shares of clipped values from which drawn and recorded inputs are remarked."""


def clipped(kind: Kind, signals: tuple[Signal, ...], step: float) -> str | None:
    """Say how many values of a kind leave the ranges of the inputs and are clipped; None if few.

    Sines and noise of a large RMS leave their ranges now and then: this is usual.

    Args:
        kind: the kind of excitation, which ``Kind.check`` has accepted.
        signals: the inputs in channel order.
        step: time between samples in s.
    """
    if isinstance(kind, Recorded):
        shares = zip(signals, kind.shares_outside(signals), strict=True)
        clipped_signals = [(signal.name, share) for signal, share in shares if share > SOME]
        return f"{Path(kind.path).name}: {_listed(clipped_signals)}" if clipped_signals else None
    if not isinstance(kind, ChannelKind | BandSines):
        return None
    of_input = kind.in_band(kind.bands[0]) if isinstance(kind, BandSines) else kind
    share = float(np.mean(np.abs(_drawn(of_input, step)) > 1.0))
    if share <= OFTEN:
        return None
    return (
        f"its inputs leave their ranges in {percent(share)} of the samples and are clipped; "
        f"amplitude = [{kind.amplitude[0]:g}, {kind.amplitude[1]:g}] is a factor on half the "
        "range: lower it, or widen the ranges"
    )


def _drawn(kind: ChannelKind, step: float) -> FloatArray:
    """Draw normalised inputs of a kind before they are clipped, (DRAWS, SAMPLES)."""
    rng, time = np.random.default_rng(0), step * np.arange(SAMPLES, dtype=np.float64)
    return np.stack([kind.scaled(time, rng) for _ in range(DRAWS)])


def _listed(signals: Sequence[tuple[str, float]]) -> str:
    """Name inputs with the shares of their samples that are clipped."""
    (name, share), *others = signals
    more = "".join(f", {other} in {percent(part)}" for other, part in others)
    they = "they are" if others else "is"
    return f"{name} leaves its range in {percent(share)} of the time{more}, and {they} clipped"
