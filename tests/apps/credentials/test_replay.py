"""The experiment of an FMU is repeated, here and by a plain importer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv

from slide_fmu.apps.credentials import members
from slide_fmu.apps.credentials.experiment import Experiment, experiment_members, read_experiment
from slide_fmu.apps.credentials.replay import Replay, replay
from slide_fmu.apps.credentials.tables import rounded
from slide_fmu.cosim.bound_check import BOUND_TOLERANCE, NOVELTY_TOLERANCE
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fmu.export import export_fmu, read_member
from slide_fmu.importer.file import unpacked
from slide_fmu.surrogate.surrogate import Surrogate
from tests.apps.credentials.conftest import LINEAR, Changed
from tests.bounded import bounded_surrogate
from tests.fmu.samples import CellShape, Shape

FMUS = LINEAR.parents[1]
OF_BOUND = ["y0_error_bound", "y1_error_bound", "novelty", "in_domain"]


def test_replay_of_a_released_fmu_differs_by_rounding_alone(released: Surrogate) -> None:
    repeated = replay(LINEAR, released)
    assert repeated is not None
    assert repeated.problems() == []
    assert repeated.differences["position"] < repeated.allowed["position"]
    assert repeated.steps == 557
    assert 0 < repeated.errors["position"] < 1e-5


def test_replay_of_an_fmu_without_experiment_is_none(released: Surrogate, tmp_path: Path) -> None:
    assert replay(export_fmu(released, tmp_path / "plain.fmu"), released) is None


def test_other_results_are_a_problem_of_the_replay(released: Surrogate, changed: Changed) -> None:
    content = read_member(LINEAR, members.RESULTS)
    assert content is not None
    lines = content.splitlines()
    time, position, filled = lines[300].split(b",")
    lines[300] = b",".join([time, repr(float(position) + 0.01).encode(), filled])
    repeated = replay(changed(members.RESULTS, b"\n".join(lines)), released)
    assert repeated is not None
    (problem,) = repeated.problems()
    assert problem.startswith("position: the replayed experiment differs by 0.01 from the stored")


@pytest.fixture
def bounded(tmp_path: Path) -> tuple[Surrogate, Experiment]:
    """A released with an error bound, and a run in which it leaves and enters its domain."""
    released = bounded_surrogate(Shape(n_in=6, n_out=2, n_outputs=2, cell=CellShape()))
    assert released.bound is not None
    inputs = rounded(np.random.default_rng(3).uniform(-1, 2, (60, 1)))
    middle = np.median(released.trust(inputs).novelty) ** 2
    bound = replace(released.bound, limits=middle * released.bound.limits)
    released = replace(released, bound=bound)
    names = [*OF_BOUND, "window_filled", "error_bound_filled", "y0", "y1"]
    columns, step = {released.inputs[0].name: inputs[:, 0]}, released.window.step
    with unpacked(export_fmu(released, tmp_path / "bounded.fmu")) as files:
        values = run_fmu(files, columns, names, step=step).values
    results = dict(zip(names, values.T, strict=True))
    reference = {"y0": results["y0"][-9:], "y1": results["y1"][-9:]}
    return released, Experiment(step, columns, results, reference)


def replayed(released: Surrogate, experiment: Experiment, path: Path) -> Replay:
    extra = {
        name.removeprefix("extra/"): content
        for name, content in experiment_members(experiment).items()
    }
    repeated = replay(export_fmu(released, path, extra=extra), released)
    assert repeated is not None
    return repeated


def test_replay_repeats_bounds_novelty_and_domain(
    bounded: tuple[Surrogate, Experiment], tmp_path: Path
) -> None:
    released, experiment = bounded
    assert 0 < experiment.results["in_domain"].sum() < experiment.steps
    repeated = replayed(released, experiment, tmp_path / "m.fmu")
    assert repeated.problems() == []
    assert repeated.differences.keys() == experiment.results.keys()
    assert {name: repeated.allowed[name] for name in OF_BOUND} == {
        **{"y0_error_bound": BOUND_TOLERANCE, "y1_error_bound": BOUND_TOLERANCE},
        **{"novelty": NOVELTY_TOLERANCE, "in_domain": 0.0},
    }


@pytest.mark.parametrize(
    ("name", "factor"), [("y1_error_bound", 1.02), ("novelty", 1.02), ("in_domain", 0.0)]
)
def test_other_bounds_novelties_and_domains_are_problems_of_the_replay(
    bounded: tuple[Surrogate, Experiment], name: str, factor: float, tmp_path: Path
) -> None:
    released, experiment = bounded
    results = {**experiment.results, name: factor * experiment.results[name]}
    repeated = replayed(released, replace(experiment, results=results), tmp_path / "m.fmu")
    (problem,) = repeated.problems()
    assert problem.startswith(f"{name}: the replayed experiment differs by")


@pytest.mark.parametrize("name", sorted(path.parent.name for path in FMUS.glob("*/*.fmu")))
def test_plain_importer_repeats_the_experiment_of_a_released_fmu(
    name: str, tmp_path: Path
) -> None:
    """FMPy takes the tables as they are, and holds nothing of this project."""
    path = FMUS / name / f"{name}.fmu"
    experiment = read_experiment(path)
    content = read_member(path, members.INPUTS)
    assert experiment is not None
    assert content is not None
    (tmp_path / "inputs.csv").write_bytes(content)
    simulated = fmpy.simulate_fmu(
        str(path),
        stop_time=experiment.step * experiment.steps,
        output_interval=experiment.step,
        input=read_csv(str(tmp_path / "inputs.csv")),
        output=list(experiment.results),
        start_values=dict(experiment.parameters),
    )
    for variable, values in experiment.results.items():
        allowed = 1e-5 * np.abs(values).max()
        np.testing.assert_allclose(simulated[variable], values, rtol=0, atol=allowed)
