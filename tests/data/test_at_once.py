"""Trajectories of a function are simulated at once: the same ones, whatever is made together."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.data import generation
from slide_fmu.data.draws import draw, simulate_draw, split_stream
from slide_fmu.data.failures import kept_failures
from slide_fmu.data.generation import generate, make_trajectories
from slide_fmu.data.parameter_draws import drawn_parameters
from slide_fmu.data.trajectories import Trajectories
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import SPLITS, Recipe
from slide_fmu.systems.errors import SimulationError
from tests.folder_digest import folder_digest
from tests.progress import silent
from tests.recipes import whole_recipe
from tests.refusals import refused

PENDULUM = """
import numpy as np

inputs = {"force": {"unit": "N", "range": [-1.0, 1.0]}, "push": {"unit": "N", "range": [0.0, 1.0]}}
outputs = {"angle": {"unit": "rad", "range": [-1.0, 1.0]}}
parameters = {"gravity": 9.0, "limit": 99.0}
hold = "first_order"
start = [0.0, 0.0]


def f(x, u, p):
    rest = np.where(x[0] > p.limit, np.nan, 0.8)
    return [x[1], u[0] + 0.5 * u[1] - p.gravity * np.sin(x[0]) - rest * x[1]]


def g(x, u, p):
    return [x[0]]
"""
BRANCH = PENDULUM.replace(
    "np.where(x[0] > p.limit, np.nan, 0.8)", "0.8 if x[0] < p.limit else np.nan"
)
KINDS = [
    {"kind": "held_random", "weight": 1.0},
    {"kind": "multisine", "weight": 1.0, "angular_frequency": [1.0, 12.0]},
    {"kind": "steps", "weight": 1.0, "duration": [0.5, 2.0]},
]
SAME = 1e-8
"""Rounding changes the lengths of steps a little, so states may differ by a part of the tolerance,
1e-6: by a hundredth of it where inputs bend at the ends of their ranges."""


def recipe(folder: Path, text: str = PENDULUM, **tables: Any) -> Recipe:
    (folder / "pendulum.py").write_text(text)
    made = {"duration": 6.0, "burn_in": 1.0, "train": 9, "validation": 3, "substeps": 4}
    system = {"model": str(folder / "pendulum.py"), "kind": "function"}
    values: dict[str, Any] = {
        "name": "pendulum",
        "description": "A pendulum.",
        "system": system,
        "window": {"step": 0.1, "n_in": 20, "n_out": 10},
        "data": {**made, "jumps": True, "excitation": KINDS},
    }
    for name, table in tables.items():
        values[name] = {**values.get(name, {}), **table}
    return whole_recipe(values)


def assert_those_alone(wanted: Recipe, folder: Path) -> None:
    """Check trajectories against what the system gives for each draw alone."""
    case = case_of(wanted)
    kept = Trajectories.of(case, folder)
    for name in SPLITS:
        split = kept.read(name) if wanted.count(name) else None
        for index in range(wanted.count(name)):
            assert split is not None
            stream = split_stream(wanted, name, index)
            own = case.at(drawn_parameters(wanted, stream, index)).system
            drawn = draw(wanted, own, stream, index)
            expected = simulate_draw(own, drawn)
            np.testing.assert_array_equal(split.inputs[index], expected.inputs)
            gap = np.abs(split.outputs[index] - expected.outputs)
            assert np.max(gap) <= SAME * np.max(np.abs(expected.outputs))


def test_trajectories_at_once_are_those_alone(tmp_path: Path) -> None:
    wanted = recipe(tmp_path)
    assert case_of(wanted).system.most_at_once() > 1  # type: ignore[attr-defined]
    assert generate(case_of(wanted), tmp_path / "t", None, silent) == 12
    assert_those_alone(wanted, tmp_path / "t")


def test_trajectories_with_parameters_at_once_are_those_alone(tmp_path: Path) -> None:
    wanted = recipe(tmp_path, parameters={"gravity": {"range": [6.0, 12.0], "unit": "N"}})
    generate(case_of(wanted), tmp_path / "t", None, silent)
    assert_those_alone(wanted, tmp_path / "t")


def test_files_do_not_depend_on_what_is_made_together(tmp_path: Path) -> None:
    wanted = recipe(tmp_path)
    generate(case_of(wanted), tmp_path / "whole" / "t", None, silent)
    kept = Trajectories.of(case_of(wanted), tmp_path / "parts" / "t")
    for part in ([("train", 5)], [("train", 0), ("validation", 2)], kept.missing()):
        make_trajectories(kept, part)
    assert folder_digest(tmp_path / "parts") == folder_digest(tmp_path / "whole")


def test_jobs_have_several_trajectories_that_are_simulated_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(generation, "LEAST_AT_ONCE", 5)
    monkeypatch.setattr("os.cpu_count", lambda: 8)
    calls: list[int] = []
    generate(case_of(recipe(tmp_path)), tmp_path / "t", None, lambda done, *_: calls.append(done))
    assert calls == [0, 5, 10, 12]


@pytest.mark.parametrize("text", [PENDULUM, BRANCH])
def test_another_draw_takes_the_place_of_one_that_fails(tmp_path: Path, text: str) -> None:
    limit = {"parameters": {"limit": 0.24}}
    wanted = recipe(tmp_path, text, system=limit, data={"most_failures": 0.9})
    generate(case_of(wanted), tmp_path / "t", None, silent)
    failures = kept_failures(case_of(wanted), tmp_path / "t")
    case, kept = case_of(wanted), Trajectories.of(case_of(wanted), tmp_path / "t")
    assert 0 < len(failures) < 12
    assert all("f gave [" in one.error and "in sample" in one.error for one in failures)
    for one in failures:
        later = [
            other for other in failures if (other.split, other.index) == (one.split, one.index)
        ]
        stream = split_stream(wanted, one.split, one.index)
        drawn = draw(wanted, case.system, stream, one.index, len(later))
        inputs = kept.read(one.split).inputs[one.index]
        np.testing.assert_array_equal(inputs, drawn.inputs[drawn.burn_in :])


def test_too_many_failures_end_the_generation(tmp_path: Path) -> None:
    wanted = recipe(tmp_path, system={"parameters": {"limit": 0.24}})
    with refused(SimulationError, "trajectories could not be simulated, 1 may fail"):
        generate(case_of(wanted), tmp_path / "t", None, silent)
