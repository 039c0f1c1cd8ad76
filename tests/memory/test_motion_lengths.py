"""How long measured motions are, and what counts as meeting, at the limits of both."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.window import Window
from slide_fmu.memory import motions
from slide_fmu.memory.decay import Decay
from slide_fmu.memory.motions import Motions, measure_motions, motions_of
from slide_fmu.memory.sizing import Sizing, size_window
from slide_fmu.memory.time_budget import TimeBudget
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from tests.recipes import tiny_recipe

MODEL, STEP = "mbs_models.oscillators:LinearOscillator", 0.03


def recipe() -> Recipe:
    return tiny_recipe(
        system={
            "model": "mbs_models.oscillators:LinearOscillator",
            "parameters": {"damping": 8.0},
        },
        data={"duration": 4.0},
        window={"step": STEP, "n_in": 92, "n_out": 53},
    )


def decay(met: int, apart: int, rate: float = -4.0) -> Decay:
    """Pairs of motions of which some meet and others never do."""
    return Decay(np.array([rate] * met + [1.0] * apart), 0.01)


def of_time(seconds: float) -> Motions:
    """Motions of the recipe, which may take a time in all."""
    return motions_of(recipe(), case_of(recipe()).system, None, None, TimeBudget(seconds))


def measured_lengths(
    monkeypatch: pytest.MonkeyPatch, found: list[Decay], of: Motions, grow: bool = True
) -> list[int]:
    """Numbers of samples that are measured, one after the other, if these decays are found."""
    lengths: list[int] = []

    def measure(_: Any, count: int) -> Decay:
        lengths.append(count)
        return found[min(len(lengths), len(found)) - 1]

    monkeypatch.setattr(motions, "_measure", measure)
    measure_motions(of, 100, grow)
    return lengths


def test_motions_are_doubled_until_half_of_the_pairs_meet(monkeypatch: pytest.MonkeyPatch) -> None:
    found = [decay(1, 3), decay(2, 2)]
    # three decay times of 1.1513 s are 115.1 samples, less than 200
    assert measured_lengths(monkeypatch, found, of_time(math.inf)) == [100, 200]


def test_single_pairs_that_do_not_meet_ask_for_three_decay_times(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lengths = measured_lengths(monkeypatch, [decay(2, 2)], of_time(math.inf))
    assert lengths == [100, 116]  # 115.1 samples, rounded up


def test_motions_are_not_lengthened_if_the_time_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    of = of_time(math.inf)
    late = replace(of, patience=TimeBudget(-1.0))
    assert measured_lengths(monkeypatch, [decay(0, 4)], late) == [100]
    assert late.patience.left_out == ["longer motions"]
    assert measured_lengths(monkeypatch, [decay(0, 4)], of, grow=False) == [100]
    assert measured_lengths(monkeypatch, [decay(0, 4)], of)[-1] == 3200  # 32 times as long


@pytest.mark.parametrize(("samples", "allowed"), [(10.0, 92), (120.0, 120), (1e9, 4.0 / STEP)])
def test_limited_time_shortens_motions_down_to_the_window(
    monkeypatch: pytest.MonkeyPatch, samples: float, allowed: float
) -> None:
    monkeypatch.setattr(TimeBudget, "samples", lambda *_: samples)
    found = of_time(100.0)
    assert found.stream.duration == pytest.approx(allowed * STEP)
    assert bool(found.patience.left_out) == (samples < 1e9)


def sizing(measured: Decay) -> Sizing:
    return Sizing(Window(STEP, 92, 53), 0.01, None, measured)


def test_half_of_the_pairs_are_enough_to_recommend_a_window() -> None:
    half, less = sizing(decay(2, 2, -40.0)), sizing(decay(1, 3, -40.0))
    assert half.forgets
    assert half.figures().recommended_n_in is not None
    assert less.figures().recommended_n_in is None
    assert less.problem is not None
    assert "(3 of 4 measured pairs)" in less.problem


def test_figures_count_rigid_body_modes_only_of_equations() -> None:
    assert sizing(decay(2, 2)).figures().rigid_body_eigenvalues is None
    found = size_window(recipe(), case_of(recipe()).system, most=2)
    assert found.figures().rigid_body_eigenvalues == 0
