"""The step that init proposes follows from the working frequencies, where a user gives them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from slide_fmu.propose import first_look, lasting_tones
from slide_fmu.propose import working_step as working_steps
from slide_fmu.propose.frequencies import near_resonances
from slide_fmu.propose.proposal import InitOptions, propose
from slide_fmu.propose.working_step import LOST, WorkingStep, working_step
from slide_fmu.recipe.default_excitation import highest_frequency
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.systems.base import System
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification
from tests.progress import silent

SPRING = '''
"""A mass on a spring, with its resonance at 1.59 Hz / SLOWER; OUTPUT of its position."""

import numpy as np

inputs = {"force": {"unit": "N", "range": [-2.0, 2.0]}}
outputs = {"position": "m"}
start = [0.0, 0.0]


def f(x, u, p):
    return [x[1] / SLOWER, (100.0 * u[0] - 4.0 * x[1] - 100.0 * x[0]) / SLOWER]


def g(x, u, p):
    return [OUTPUT]
'''


@pytest.fixture(autouse=True)
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(working_steps, "LASTS", 100)


def spring(folder: Path, output: str = "x[0]", slower: float = 1.0) -> Path:
    path = folder / "spring.py"
    path.write_text(SPRING.replace("OUTPUT", output).replace("SLOWER", f"{slower}"))
    return path


def step_for(path: Path, highest: float) -> WorkingStep:
    inputs = {"force": SignalTable(range=(-2.0, 2.0), hold="first_order")}
    known = Specification(
        str(path), {}, 0.01, "function", inputs, {"position": SignalTable(range=(-1.0, 1.0))}
    )

    def make(step: float) -> System:
        return load_system(replace(known, step=step))

    return working_step(make, make(0.01), [highest])


def test_step_for_a_linear_machine_has_twenty_samples_in_the_shortest_period(
    tmp_path: Path,
) -> None:
    for highest, step in ((0.4, 0.1), (3.0, 0.01)):
        found = step_for(spring(tmp_path), highest)
        assert (found.step, found.for_inputs) == (step, step)
        assert found.lost is not None
        assert found.lost < LOST


def test_step_is_finer_where_a_machine_makes_its_outputs_faster(tmp_path: Path) -> None:
    found = step_for(spring(tmp_path, "np.tanh(20.0 * x[0])"), 0.4)
    assert (found.step, found.for_inputs) == (0.01, 0.1)
    assert found.lost is not None
    assert found.lost < LOST


def test_machine_for_which_no_step_suffices_has_that_for_the_inputs_and_what_it_loses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jumping = spring(tmp_path, "np.sign(x[0])")
    found = step_for(jumping, 0.4)
    assert (found.step, found.for_inputs) == (0.1, 0.1)
    assert found.lost is not None
    monkeypatch.setattr(working_steps, "LOST", 1.0)  # the first step that is tried
    assert step_for(jumping, 0.4) == found


def test_model_of_its_own_step_has_the_step_for_the_inputs(tmp_path: Path) -> None:
    system = load_system(
        Specification(
            str(spring(tmp_path)),
            {},
            0.01,
            "function",
            {"force": SignalTable(range=(-2.0, 2.0), hold="zero_order")},
            {"position": SignalTable(range=(-1.0, 1.0))},
        )
    )

    def make(step: float) -> System:
        raise LoadError("its own step")

    assert working_step(make, system, [0.4]) == WorkingStep(0.2, 0.2, None)


@pytest.mark.parametrize("slower", [100.0, pytest.param(1.0, marks=pytest.mark.extended)])
def test_proposal_has_the_step_of_the_band_and_frequencies_that_it_carries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, slower: float
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(first_look, "SAMPLES", 200)
    monkeypatch.setattr(lasting_tones, "LINES", 512)
    band = 0.1 / slower, 0.4 / slower
    found = propose(InitOptions(str(spring(tmp_path, slower=slower)), bands={"": band}), silent)
    step = found.draft.step
    assert step == pytest.approx(0.1 * slower)
    words = " ".join(found.text.replace("#", "").split())
    begin = f"The step follows from the working frequencies, up to {band[1]:g} Hz. A step of"
    assert f"{begin} {step:g} s takes 25 samples in such a period." in words
    assert ("parts or multiples of it: 10 ms." in words) is (slower == 1.0)  # of usual ones
    kinds = parse_open_recipe(found.text, "proposal").guess.data.excitation
    ends = [getattr(kind, "angular_frequency", (0.0,)) for kind in kinds]
    assert all(end <= highest_frequency(step) for pair in ends for end in pair)


def test_resonances_that_a_step_cannot_carry_are_left_out(tmp_path: Path) -> None:
    nothing = first_look.np.empty(0)
    seen = first_look.FirstLook(
        0.1, "", nothing, nothing, nothing, 0, (), nothing, nothing, (1.0, 20.0)
    )
    near = near_resonances(seen, 0.1)
    assert near == pytest.approx((2 * math.pi * 0.7, 2 * math.pi * 1.4))
    assert near_resonances(replace(seen, resonances=(20.0,)), 0.1) is None
