"""Kinds of input as users drive machines are drawn by their names, reproducibly and alone."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.systems.base import State, System

MODERATE, HARSH = "moderate", "harsh"
LEVELS = MODERATE, HARSH

Generator = Callable[[np.random.Generator, FloatArray, bool], FloatArray]
"""Gives inputs at times in s, (N,) to (N, n_inputs), in their units; harsh ones if True."""


@dataclass(frozen=True)
class Machine:
    """A machine is a model with the kinds of input by which users drive it.

    Attributes:
        lead: time in s before the samples that are measured: all windows are then full, and
            initial states have decayed.
        kinds: its kinds by name.
        only: the level of kinds that have one: slow ones, or such as the training knows.
        states: gives initial states, of which the first is the truth's.
    """

    lead: float
    kinds: Mapping[str, Generator]
    only: Mapping[str, str]
    states: Callable[[System, np.random.Generator, FloatArray], list[State]]

    def cases(self) -> list[tuple[str, str]]:
        """Return all names of kinds, each with its levels."""
        return [
            (name, level)
            for name in self.kinds
            for level in LEVELS
            if self.only.get(name, level) == level
        ]

    def inputs(
        self, case: tuple[str, str], times: FloatArray, rng: np.random.Generator
    ) -> FloatArray:
        """Draw the inputs of a kind and a level, (N, n_inputs) at N times in s."""
        name, level = case
        return self.kinds[name](rng, times, level == HARSH)


def rng_of(seed: int, case: tuple[str, str], index: int, attempt: int) -> np.random.Generator:
    """Return the generator of a trajectory; other kinds, also new ones, do not change it."""
    own = [zlib.crc32(text.encode()) for text in case]
    key = (*own, index, attempt)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
