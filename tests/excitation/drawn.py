"""Joints to move, and motions of them that a kind of excitation draws."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import TypeAdapter

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.excitation.kinds import Excitation

STEP = 1 / 60
TIME = STEP * np.arange(6001)
JOINTS = tuple(
    Signal(f"q{i + 1}", "rad", low, high)
    for i, (low, high) in enumerate([(-2.8, 2.8), (-1.9, 1.9), (0.0, 2.4), (-3.0, -1.0)])
)
LOW, HIGH = (np.array([getattr(joint, end) for joint in JOINTS]) for end in ("low", "high"))


def kind_of(name: str, **extra: object) -> Any:
    return TypeAdapter(Excitation).validate_python({"kind": name, "weight": 1.0, **extra})


def motion(
    kind: Any, signals: tuple[Signal, ...], seed: int, factor: float = 1.0, time: FloatArray = TIME
) -> FloatArray:
    kind.check(signals)
    inputs: FloatArray = kind.inputs(signals, time, factor, np.random.default_rng(seed))
    return inputs
