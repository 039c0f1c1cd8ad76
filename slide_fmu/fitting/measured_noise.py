"""The noise of measured outputs, as a fit weights its residuals by it."""

from __future__ import annotations

import hashlib

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.systems.base import Source

ScaledNoise = tuple[FloatArray, ...]
"""Stretches of the outputs' noise in scaled units, shape (N, n_outputs) each."""


def noise_of(source: Source, scaling: Affine) -> ScaledNoise | None:
    """Return the noise of outputs in the units of their scaling; None where it is not known."""
    if not isinstance(source, MeasuredRecords) or source.noise is None:
        return None
    return tuple(stretch / scaling.scale for stretch in source.noise.stretches)


def digests_of(noise: ScaledNoise | None) -> list[str]:
    """Return what a checkpoint's key has of the noise: nothing where there is none."""
    return [hashlib.sha256(stretch.tobytes()).hexdigest() for stretch in noise or ()]
