"""A model that fails on a few inputs is proposed and tried all the same, and the user hears it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from slide_fmu.cli.app import app
from slide_fmu.data import failing_motions, simulation_time
from slide_fmu.memory import motions
from slide_fmu.propose import first_look, trial
from slide_fmu.propose.proposal import InitOptions, propose
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.systems.errors import SimulationError
from tests.progress import silent

FRAGILE = '''
"""A lag that breaks above a force."""

inputs = {"force": {"unit": "N", "range": [-1.0, 1.0]}}
outputs = {"position": "m"}
start = [0.0]


def f(x, u, p):
    if u[0] > LEVEL:
        raise ValueError("the spring breaks")
    return [(u[0] - x[0]) / 0.5]


def g(x, u, p):
    return [x[0]]
'''
TABLES = """
[data]
most_failures = 0.2
train = 4
validation = 2

[[data.excitation]]
kind = "harmonic"
weight = 1.0
amplitude = [0.0, 1.0]
angular_frequency = [0.5, 2.0]
"""


def written(folder: Path, level: float) -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / "fragile.py"
    path.write_text(FRAGILE.replace("LEVEL", repr(level)))
    return path


def recipe_text(folder: Path, level: float) -> str:
    return (
        f'name = "fragile"\ndescription = "breaks"\n\n[system]\nkind = "function"\n'
        f"model = {json.dumps(str(written(folder, level)))}\n\n"
        f"[system.outputs.position]\nrange = [-1.0, 1.0]\n\n[window]\nstep = 0.1\n"
        f"n_in = 60\nn_out = 20\n{TABLES}"
    )


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(first_look, "SAMPLES", 300)
    monkeypatch.setattr(simulation_time, "TIMED", 0.2)
    monkeypatch.setattr(motions, "MOTIONS", 12)
    monkeypatch.setattr(motions, "LINEARIZED_MOTIONS", 4)


@pytest.mark.extended
def test_proposal_draws_other_motions_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """White noise over the whole range breaks the spring for sure; its half shows the step."""
    monkeypatch.setattr(failing_motions, "LEAST", 4)  # motions that may fail, of 16
    monkeypatch.setattr(first_look, "SAMPLES", 1000)  # in fewer, chance may leave out that force
    found = propose(InitOptions(str(written(tmp_path, 0.85)), jumps=False), silent)
    whole = propose(InitOptions(str(written(tmp_path / "whole", 9.0)), jumps=False), silent)
    (alone,) = whole.remarks  # f takes one state alone
    assert "for each motion alone" in alone
    assert found.draft.step == pytest.approx(whole.draft.step, rel=0.3)
    for words in (
        "so a part of them showed the step: ",
        "motions could not be simulated, and others took their place; the first",
        "the model failed at 1 of 6 constant inputs",
    ):
        (told,) = [remark for remark in found.remarks if words in remark]
        assert "the spring breaks" in told
    output = parse_open_recipe(found.text, "proposal").guess.system.outputs["position"]
    assert output.range is not None
    assert -3.0 < output.range[0] < -0.1 < 0.1 < output.range[1] < 3.0


def test_proposal_for_a_model_that_fails_often_says_why(tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match=r"the spring breaks") as raised:
        propose(InitOptions(str(written(tmp_path, 0.02)), step=0.1), silent)
    assert "2 may fail" in str(raised.value)
    assert "narrow the ranges of its inputs" in str(raised.value)


@pytest.mark.extended
@pytest.mark.parametrize("level", [0.9, 0.001])
def test_trial_goes_on_while_few_motions_fail(level: float, tmp_path: Path) -> None:
    recipe = tmp_path / "fragile.toml"
    recipe.write_text(recipe_text(tmp_path, level))
    done = invoke("try", recipe, "--runs", tmp_path, "--json", tmp_path / "figures.json")
    if level < 0.01:
        assert done.exit_code == 1
        assert done.output.count("error: ") == 1
        assert "the spring breaks" in done.output
        return
    assert done.exit_code == 0, done.output
    figures = json.loads((tmp_path / "figures.json").read_text())
    told = figures["window"]["remark"]
    assert "motions could not be simulated, and others took their place; the first" in told
    assert "the spring breaks" in told
    assert told in figures["remarks"]
    assert f"remark: {told}" in done.output


OTHER_KINDS = """
[bound]

[[bound.excitation]]
kind = "steps"
weight = 1.0
amplitude = [AMPLITUDE, AMPLITUDE]
duration = [0.1, 0.3]

[[validation.excitation]]
kind = "multisine"
weight = 1.0
amplitude = [0.05, 0.1]
angular_frequency = [0.5, 2.0]
"""


def remarks_on_other_kinds(folder: Path, amplitude: str) -> str:
    """What a trial remarks where networks learn from small motions alone."""
    recipe = folder / "fragile.toml"
    text = recipe_text(folder, 0.7).replace("[0.0, 1.0]", "[0.0, 0.3]")
    recipe.write_text(text + OTHER_KINDS.replace("AMPLITUDE", amplitude))
    done = invoke("try", recipe, "--runs", folder, "--json", folder / "figures.json")
    assert done.exit_code == 0, done.output
    return " ".join(json.loads((folder / "figures.json").read_text())["remarks"])


@pytest.mark.extended
@pytest.mark.parametrize("amplitude", ["0.1", "1.0"])
def test_trial_tells_kinds_that_no_network_learns_from_and_that_fail(
    amplitude: str, tmp_path: Path
) -> None:
    told = remarks_on_other_kinds(tmp_path, amplitude)
    of_steps = "a motion of the kind 'steps' of bound.excitation could not be simulated: "
    assert (of_steps in told) is (amplitude == "1.0")
    assert ("the spring breaks" in told) is (amplitude == "1.0")
    assert ("give it smaller amplitudes or lower frequencies there" in told) is (
        amplitude == "1.0"
    )
    assert "multisine" not in told


@pytest.mark.extended
def test_trial_without_time_says_what_becomes_of_the_other_kinds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trial, "MOST_TIME", -1.0)
    told = remarks_on_other_kinds(tmp_path, "0.1")
    assert (
        "no time to simulate 3 of the kinds of motions that the run needs: nothing to do" in told
    )


@pytest.mark.extended
def test_trial_tells_of_motions_beyond_the_range_that_fail(tmp_path: Path) -> None:
    """The spring breaks outside of the declared range, where the estimator shall learn too."""
    recipe, told = tmp_path / "fragile.toml", dict[bool, str]()
    data = "train = 4\nestimator = 4\nestimator_validation = 2"
    text = recipe_text(tmp_path, 1.0).replace("train = 4", data).replace("[0.0, 1", "[1.0, 1")
    for beyond in (True, False):
        recipe.write_text(f"{text}\n[estimator]\nbeyond = {str(beyond).lower()}\n")
        figures = tmp_path / "figures.json"
        done = invoke("try", recipe, "--runs", tmp_path, "--json", figures)
        assert done.exit_code == 0, done.output
        told[beyond] = " ".join(json.loads(figures.read_text())["remarks"])
    assert (
        "1 of 1 kinds of motions could not be simulated at 3 times the amplitude, for" in told[1]
    )
    assert "estimator.beyond asks; trajectories that fail beyond the range are left out" in told[1]
    assert "lies outside of its range -1..1, where the model may fail: in sample " in told[1]
    assert "f raised" in told[1]
    assert "could not be simulated" not in told[0]


@pytest.mark.extended
def test_trial_says_so_where_no_time_is_left_for_kinds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trial, "MOST_TIME", -1.0)
    told = remarks_on_other_kinds(tmp_path, "1.0")
    assert "there was no time to simulate 3 of the kinds of motions that the run needs" in told
    assert "the spring breaks" not in told
