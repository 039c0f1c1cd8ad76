"""The experiment of an FMU is repeated, here and by a plain importer."""

from __future__ import annotations

from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv

from slide_fmu.credentials import members
from slide_fmu.credentials.experiment import read_experiment
from slide_fmu.credentials.replay import replay
from slide_fmu.fmu.export import export_fmu, read_member
from slide_fmu.surrogate.surrogate import Surrogate
from tests.credentials.conftest import LINEAR, Changed


def test_replay_of_a_released_fmu_differs_by_rounding_alone(surrogate: Surrogate) -> None:
    found = replay(LINEAR, surrogate)
    assert found is not None
    assert found.problems() == []
    assert found.differences["position"] < found.allowed["position"]
    assert found.steps == 557
    assert 0 < found.errors["position"] < 1e-5


def test_replay_of_an_fmu_without_experiment_is_none(surrogate: Surrogate, tmp_path: Path) -> None:
    assert replay(export_fmu(surrogate, tmp_path / "plain.fmu"), surrogate) is None


def test_other_results_are_a_problem_of_the_replay(surrogate: Surrogate, changed: Changed) -> None:
    content = read_member(LINEAR, members.RESULTS)
    assert content is not None
    lines = content.splitlines()
    time, position, filled = lines[300].split(b",")
    lines[300] = b",".join([time, repr(float(position) + 0.01).encode(), filled])
    found = replay(changed(members.RESULTS, b"\n".join(lines)), surrogate)
    assert found is not None
    (problem,) = found.problems()
    assert problem.startswith("position: the replayed experiment differs by 0.01 from the stored")


@pytest.mark.parametrize("name", ["linear", "duffing", "mass_chain", "slider_crank", "robot_6r"])
def test_plain_importer_repeats_the_experiment_of_a_released_fmu(
    name: str, tmp_path: Path
) -> None:
    """FMPy takes the tables as they are, and holds nothing of this project."""
    path = LINEAR.parents[1] / name / f"{name}.fmu"
    experiment = read_experiment(path)
    content = read_member(path, members.INPUTS)
    assert experiment is not None
    assert content is not None
    (tmp_path / "inputs.csv").write_bytes(content)
    found = fmpy.simulate_fmu(
        str(path),
        stop_time=experiment.step * experiment.steps,
        output_interval=experiment.step,
        input=read_csv(str(tmp_path / "inputs.csv")),
        output=list(experiment.results),
    )
    for variable, values in experiment.results.items():
        allowed = 1e-5 * np.abs(values).max()
        np.testing.assert_allclose(found[variable], values, rtol=0, atol=allowed)
