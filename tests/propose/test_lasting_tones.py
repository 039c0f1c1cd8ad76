"""Tones last where systems resonate, so that ranges of outputs hold what users can reach."""

from __future__ import annotations

import math
import time
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.propose import first_look
from slide_fmu.propose.lasting_tones import answers_to, tones_of
from slide_fmu.propose.proposal import InitOptions, propose
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.function.system import FunctionSystem
from tests.marks import first
from tests.progress import silent

OWN, STEP = 20.0, 0.02
RESOLVED = 0.06
"""The gain between samples that are connected by straight lines is this much smaller at most."""


def oscillator(damping: float, hardening: float = 0.0, breaks: float = math.inf) -> FunctionSystem:
    """A mass on a spring, whose base moves and which a force pushes, of so many m/s^2."""

    def f(x: Any, u: Any, p: Any) -> list[float]:
        if abs(x[0]) > breaks:
            raise ValueError("the spring breaks")
        spring = OWN**2 * (x[0] - u[0]) + hardening * x[0] ** 3
        return [x[1], u[1] - spring - 2 * damping * OWN * x[1]]

    return FunctionSystem(
        f,
        lambda x, u, p: [x[0]],
        inputs=[
            Signal("base", "m", -0.01, 0.01, hold="first_order"),
            Signal("push", "m/s^2", 0.0, 8.0, hold="first_order"),
        ],
        outputs=[Signal("place", "m", -1.0, 1.0)],
        start=[0.0, 0.0],
        step=STEP,
    )


def reached(system: FunctionSystem) -> float:
    """Half the width of what the first output reaches under tones at its resonances."""
    outputs = [rows for tone in tones_of(system, 1) for rows in answers_to(system, tone)[0]]
    return float(np.ptp(np.concatenate(outputs)[:, 0])) / 2


@pytest.mark.parametrize("damping", first([0.005, 0.02, 0.1]))
def test_tone_lasts_until_the_resonance_has_grown(damping: float) -> None:
    """Both inputs push in phase: a sine of 4 m/s^2 each, at the frequency where most returns."""
    system = oscillator(damping)
    (tone,) = tones_of(system, 1)
    swing = (OWN**2 * 0.01 + 4.0) / OWN**2
    assert 2 * math.pi * tone.frequency / STEP == pytest.approx(OWN, rel=0.03)
    assert tone.phases == pytest.approx([0.0, 0.0], abs=0.1)
    largest = swing / (2 * damping * math.sqrt(1 - damping**2))
    assert (1 - RESOLVED) * largest < reached(system) < 1.2 * largest


@pytest.mark.extended
def test_sweeps_climb_the_hill_of_a_spring_that_hardens() -> None:
    """It turns the resonance to higher frequencies, where a tone at small motions finds little."""
    system = oscillator(0.02, hardening=1e5)
    (tone,) = tones_of(system, 1)
    lasting, swept = (np.abs(rows - rows.mean()).max() for rows in answers_to(system, tone)[0])
    assert swept > 1.1 * lasting


@pytest.mark.usefixtures("brief")
def test_lag_has_no_resonance() -> None:
    lag = FunctionSystem(
        lambda x, u, p: [(u[0] - x[0]) / 0.3],
        lambda x, u, p: [x[0]],
        inputs=[Signal("drive", "m", -1.0, 1.0)],
        outputs=[Signal("place", "m", -1.0, 1.0)],
        start=[0.0],
        step=0.02,
    )
    assert tones_of(lag, 1) == []


def test_tone_at_which_a_model_fails_is_made_smaller() -> None:
    system = oscillator(0.02, breaks=0.35)
    (tone,) = tones_of(system, 1)
    answers, failure = answers_to(system, tone)
    assert failure is not None
    part, error = failure
    assert isinstance(error, SimulationError)
    assert part == 0.5
    assert all(np.abs(rows).max() < 0.35 for rows in answers)


BEAM = '''
"""A beam of one mode on a base that moves."""

inputs = {"base": {"unit": "m", "range": [-0.001, 0.001]}}
outputs = {"tip": "m", "heat": "K"}
start = [0.0, 0.0, 293.0]


def f(x, u, p):
    return [x[1], -900.0 * (x[0] - u[0]) - 0.6 * x[1], 5.0 * (u[0] + 0.001) - 0.2 * (x[2] - 293.0)]


def g(x, u, p):
    return [x[0], x[2]]
'''


@pytest.fixture
def beam(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr(first_look, "SAMPLES", 300)
    path = tmp_path / "beam.py"
    path.write_text(BEAM)
    return str(path)


@pytest.mark.extended
def test_proposed_range_holds_the_resonance_but_not_what_no_motion_reaches(beam: str) -> None:
    found = propose(InitOptions(beam, step=0.02), silent)
    outputs = parse_open_recipe(found.text, "proposal").guess.system.outputs
    low, high = outputs["tip"].range or (0.0, 0.0)
    assert -0.08 < low < -0.05  # at 30 rad/s, the base moves the tip by 50 times its own motion
    assert 0.05 < high < 0.08
    assert "tones that last at 4.77 Hz" in " ".join(found.text.replace("#", "").split())
    assert outputs["heat"].range == pytest.approx((293.0, 293.05), abs=1e-5)
    assert "The lower end is that at rest" in " ".join(found.text.replace("#", "").split())


@pytest.mark.extended
def test_proposal_is_the_same_to_the_byte_on_a_machine_that_has_no_time(
    beam: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    at_leisure = propose(InitOptions(beam), silent)
    hours = count(1.0, 3600.0)  # every look at a clock takes an hour
    for clock in ("monotonic", "perf_counter", "process_time", "time"):
        monkeypatch.setattr(time, clock, lambda: next(hours))
    in_a_hurry = propose(InitOptions(beam), silent)
    assert in_a_hurry.text.encode() == at_leisure.text.encode()
    assert in_a_hurry.remarks == at_leisure.remarks
