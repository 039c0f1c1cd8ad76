"""A window that is sized in a limited time is a first estimate, and says so."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mbs_models.oscillators.oscillators import LinearOscillator
from slide_fmu.memory.lengths import find_lengths
from slide_fmu.memory.sizing import size_window
from slide_fmu.memory.time_budget import TimeBudget
from tests.memory.plain_systems import Lag
from tests.memory.test_lengths import of_lag
from tests.memory.test_sizing import oscillator


def test_patience_without_end_leaves_nothing_out() -> None:
    patience = TimeBudget()
    assert not patience.gone("motions")
    assert patience.remark is None


def test_patience_that_is_gone_says_once_what_was_left_out() -> None:
    patience = TimeBudget(0.0)
    assert all(patience.gone("motions") for _ in range(2))
    assert patience.gone("records")
    assert patience.remark is not None
    assert "in 0 s there was no time for motions; records. The window is" in patience.remark


def test_window_of_a_first_estimate_holds_what_was_seen() -> None:
    found = find_lengths(of_lag(), Lag(), TimeBudget(0.0))
    sizing = found.sizing
    assert sizing is not None
    assert len(sizing.measured.rates) == 1
    assert sizing.problem is None
    assert sizing.window.n_in == found.recipe.guess.window.n_in
    assert sizing.window.truncation_time >= 0.5 * math.log(100)
    assert sizing.remark is not None
    assert "no time for" in sizing.remark
    assert "more motions, as long as the window asks for" in sizing.remark


def test_equations_of_a_slow_system_are_linearized_along_a_short_motion() -> None:
    recipe, system = oscillator("LinearOscillator"), LinearOscillator(damping=8.0, step=0.03)
    found = size_window(recipe, system, patience=TimeBudget(0.0))
    assert found.linearized is not None
    whole = size_window(recipe, system, most=1)
    assert found.needed == pytest.approx(whole.needed, rel=0.01)
    assert whole.left_out is None
    assert found.left_out is not None
    assert "motions of more than 2.76 s; further motions to linearize along" in found.left_out


def test_motions_that_have_not_met_yet_come_with_what_was_left_out() -> None:
    recipe, system = oscillator("LinearOscillator"), LinearOscillator(damping=8.0, step=0.03)
    found = size_window(recipe, system, patience=TimeBudget(0.0))
    apart = replace(found.measured, rates=np.abs(found.measured.rates))
    early = replace(found, measured=apart)
    assert early.problem is not None
    assert early.problem.startswith(f"{found.left_out}; so far, motions from different initial")
    whole = replace(early, left_out=None)
    assert whole.problem is not None
    assert whole.problem.startswith("motions from different initial states never meet")
