"""Subcommands as public functions: ``learn``, ``run``, ``export`` and ``validate``."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu import RunResult, learn, validate
from slide_fmu.core.signals import FloatArray, Hold, Signal
from slide_fmu.fmu.export import load, read_fmu
from slide_fmu.pipeline.run_folder import StageError
from slide_fmu.propose.object_recipe import recipe_tables
from slide_fmu.recipe.default_excitation import default_excitation
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.function.system import FunctionSystem
from tests.few_motions import few_motions
from tests.recipes import TINY
from tests.refusals import refused
from tests.systems.function_models import specifications as models

ROOT = Path(__file__).parents[2]
LINEAR = ROOT / "fmus" / "linear" / "linear.fmu"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recipe of the quickest training that there is."""
    place = tmp_path_factory.mktemp("calls")
    (place / "tiny.toml").write_text(TINY, encoding="utf-8")
    return place


@pytest.mark.usefixtures("few_motions")
def test_run_of_a_recipe_gives_surrogate_fmu_report_and_errors(folder: Path) -> None:
    result = slide.run(folder / "tiny.toml", runs=folder / "runs", trajectories=1, workers=0)
    assert result.fmu == folder / "runs" / "tiny" / "tiny.fmu"
    assert result.surrogate.to_bytes() == read_fmu(result.fmu)[0].to_bytes()
    assert list(result.errors) == ["position"]
    assert result.figures["command"] == "slide-fmu run tiny.toml"


def test_run_of_a_missing_recipe_names_it(folder: Path) -> None:
    with refused(slide.RecipeError, "nothere.toml' cannot be read"):
        slide.run(folder / "nothere.toml", runs=folder / "runs")


@pytest.mark.usefixtures("few_motions")
def test_validate_measures_on_the_trajectories_that_it_is_told() -> None:
    figures = slide.validate(LINEAR, trajectories=1, duration=5.0, workers=0)
    assert figures["trajectories"] == 1
    (output,) = figures["outputs"]
    assert output["relative_rmse"] < 1e-3
    with refused(ValueError, "expected a positive, finite time"):
        slide.validate(LINEAR, duration=float("nan"))


@pytest.mark.parametrize("kind", ["surrogate", "surrogate file", "fmu"])
def test_export_takes_a_surrogate_or_the_path_of_one(kind: str, tmp_path: Path) -> None:
    surrogate = slide.load(LINEAR)
    surrogate.save(tmp_path / "linear.slide")
    source = {"surrogate": surrogate, "surrogate file": tmp_path / "linear.slide", "fmu": LINEAR}
    path = slide.export(source[kind], tmp_path / "again.fmu", fmi=3)  # type: ignore[arg-type]
    again, origin = read_fmu(path)
    assert again.to_bytes() == surrogate.to_bytes()
    assert (origin is not None) == (kind == "fmu")


def test_export_of_something_else_is_refused() -> None:
    with refused(slide.FmuError, "expected a surrogate", "the path"):
        slide.export(3, "x.fmu")  # type: ignore[arg-type]


SMALL = {
    "window": {"n_in": 90, "n_out": 30},
    "data": {"train": 8, "validation": 2, "duration": 4.0, "burn_in": 1.0},
    "network": {"order": 2, "hidden": 4},
    "training": {
        "starts": 1, "iterations": 20,
        "expert": {"start_iterations": 3, "kept": 1, "kept_iterations": 3, "part": 1},
    },
    "validation": {"trajectories": 2},
}  # fmt: skip
"""Tables that learn a small oscillator in seconds."""


def oscillator(stiffness: float = 100.0, hold: Hold = "zero_order") -> FunctionSystem:
    """A system of functions that no other process can have."""
    return FunctionSystem(
        lambda x, u, p: [x[1], u[0] - 10.0 * x[1] - p.stiffness * (x[0] + 20 * x[0] ** 3)],
        lambda x, u, p: x[0],
        inputs=[Signal("force", "N", -10.0, 10.0, hold=hold)],
        outputs=[Signal("position", "m", -0.3, 0.3)],
        start=[0.0, 0.0],
        parameters={"stiffness": stiffness},
        step=0.02,
    )


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="module")
def learnt(runs: Path) -> RunResult:
    with few_motions():
        return learn(oscillator(), "oscillator", runs=runs, **SMALL)


def test_system_of_a_session_is_learnt_to_a_small_error(learnt: RunResult) -> None:
    assert set(learnt.errors) == {"position"}
    assert learnt.errors["position"] < 0.03
    assert learnt.report.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert f"<td>position</td><td>{100 * learnt.errors['position']:.3g} %" in learnt._repr_html_()


def test_learnt_surrogate_is_that_of_the_fmu_and_is_exported_again(
    learnt: RunResult, tmp_path: Path
) -> None:
    again = learnt.export(tmp_path / "again.fmu", fmi=3)
    assert load(again).to_bytes() == learnt.surrogate.to_bytes()
    # the oscillator at rest under 5 N
    (position,) = learnt.surrogate.predict(np.full((120, 1), 5.0))[-1]
    assert position + 20 * position**3 == pytest.approx(0.05, rel=0.05)


@pytest.mark.extended
def test_functions_whose_inputs_move_are_learnt_as_these_bend(tmp_path: Path) -> None:
    """Then simulate takes samples as they are: nothing has to make up for straight lines."""
    tables = {**SMALL, "stability": {"allow_unstable": True}}  # so small a training may be so
    result = learn(oscillator(hold="first_order"), "bending", runs=tmp_path, **tables)
    forecast = load(result.fmu).forecast
    assert forecast is not None
    assert forecast.sampled
    straight = {**tables, "data": {**SMALL["data"], "substeps": 1}}
    other = load(learn(oscillator(hold="first_order"), "straight", runs=tmp_path, **straight).fmu)
    assert other.forecast is not None
    assert not other.forecast.sampled


@pytest.mark.usefixtures("few_motions")
def test_fmu_of_an_object_is_measured_again_with_the_object(learnt: RunResult) -> None:
    with refused(LoadError, "Python session", "system="):
        validate(learnt.fmu, trajectories=1, workers=0)
    figures = validate(learnt.fmu, trajectories=2, workers=0, system=oscillator())
    assert figures["outputs"][0]["relative_rmse"] == learnt.errors["position"]


def test_object_that_the_fmu_was_not_learnt_from_is_refused(learnt: RunResult) -> None:
    linear = Path(__file__).parents[2] / "fmus" / "linear" / "linear.fmu"
    with refused(StageError, "expected no system", "leave it out"):
        validate(linear, system=oscillator())
    with refused(StageError, "system = 3", "a System"):
        validate(learnt.fmu, system=3)  # type: ignore[arg-type]
    with refused(StageError, "first_order", "give the object"):
        validate(learnt.fmu, system=oscillator(hold="first_order"))


@pytest.mark.extended
def test_what_was_learnt_is_not_learnt_again(
    learnt: RunResult, runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    again = learn(oscillator(), "oscillator", runs=runs, **SMALL)
    assert again.errors == learnt.errors
    said = capsys.readouterr().err
    assert "trajectories: 10 of 10" in said
    assert "trajectories: 0 of 10" not in said
    assert "simulating in this process alone: the system has parts that this session" in said


@pytest.mark.extended
def test_changed_function_is_noticed_and_learnt_anew(learnt: RunResult, runs: Path) -> None:
    anew = learn(oscillator(120.0), "oscillator", runs=runs, **SMALL)
    (position,) = anew.surrogate.predict(np.full((120, 1), 5.0))[-1]
    assert 120 * (position + 20 * position**3) == pytest.approx(5.0, rel=0.05)


class Still(System):
    """A system whose inputs are what a test wants."""

    def __init__(self, *inputs: Signal) -> None:
        self.inputs, self.outputs, self.step = inputs, (Signal("y", "1", -1.0, 1.0),), 0.1

    def simulate(self, inputs: FloatArray) -> FloatArray:
        raise NotImplementedError


def test_excitation_of_an_object_follows_from_its_inputs() -> None:
    road = Signal("road", "m", -0.1, 0.1, hold="first_order")
    pair = (
        Signal("x", "1", -1.0, 1.0, angle="cosine"),
        Signal("y", "1", -1.0, 1.0, angle="sine"),
    )
    cases = {
        "held": (Signal("force", "N", -1.0, 1.0),),
        "moving": (road,),
        "angle": pair,
    }
    for kind, inputs in cases.items():
        kinds = recipe_tables(Still(*inputs), "still", {})["data"]["excitation"]
        assert kinds == default_excitation(0.1, kind)  # type: ignore[arg-type]
    given = {"data": {"excitation": [{"kind": "held_random"}]}}
    assert recipe_tables(Still(road), "still", given)["data"] == given["data"]


def test_mistake_in_a_table_is_named_as_in_a_recipe(tmp_path: Path) -> None:
    with refused(RecipeError, "slide.learn of 'car'", "windows is not a known key"):
        learn(oscillator(), "car", runs=tmp_path, windows={"n_in": 3})
    with refused(RecipeError, "data", "expected numbers, texts, lists"):
        learn(oscillator(), "car", runs=tmp_path, data={"train": {1, 2}})


@pytest.mark.parametrize(
    ("given", "found"),
    [(np.sin, "ufunc sin"), (FunctionSystem, "FunctionSystem"), (3.0, "float 3.0")],
)
def test_what_is_no_system_is_refused_with_how_to_make_one(given: object, found: str) -> None:
    message = rf"slide\.learn of 'x': system = .*{found}; expected .*FunctionSystem\(f, g, inputs="
    with pytest.raises(RecipeError, match=message):
        learn(given, "x", window={"step": 0.1})  # type: ignore[arg-type]


def test_system_is_also_taken_as_the_table_of_a_recipe(tmp_path: Path) -> None:
    system = {"kind": "function", "model": str(models.HERE / "absent.py")}
    with refused(LoadError, "absent.py"):
        learn(system, "lag", runs=tmp_path, **{**SMALL, "window": {"step": 0.02}})


SCRIPT = """
from slide_fmu import learn
from mbs_models.oscillators import LinearOscillator
from tests.cli.test_python_calls import SMALL
print("here")
system = SYSTEM


def main():
    print(learn(system, "lin", runs=RUNS, WORKERS**SMALL).errors)


CALL
"""
OBJECT = "LinearOscillator(step=0.02, damping=20.0)"
GUARDED = """if __name__ == "__main__":
    main()"""


def run_script(
    folder: Path, call: str, system: str = OBJECT, workers: str = ""
) -> subprocess.CompletedProcess[str]:
    """Run a script that learns."""
    script = folder / "script.py"
    text = SCRIPT.replace("SYSTEM", system).replace("RUNS", repr(str(folder)))
    text = text.replace("WORKERS", workers).replace("CALL", call)
    script.write_text(text, encoding="utf-8")
    return subprocess.run(
        [sys.executable, str(script)],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parents[2],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )


@pytest.mark.extended
def test_script_without_a_guard_simulates_in_its_own_process(tmp_path: Path) -> None:
    """A worker would run the script again, and never end."""
    done = run_script(tmp_path, "main()")
    assert done.returncode == 0, done.stderr
    first, errors = done.stdout.splitlines()
    assert first == "here"
    assert ast.literal_eval(errors)["position"] < 0.02
    assert "would run this script again (script.py, line 13)" in done.stderr
    assert 'if __name__ == "__main__"' in done.stderr


@pytest.mark.extended
def test_script_with_a_guard_simulates_in_workers(tmp_path: Path) -> None:
    done = run_script(tmp_path, GUARDED, workers="workers=1, ")
    assert done.returncode == 0, done.stderr
    *heres, errors = done.stdout.splitlines()
    assert heres == ["here"] * len(heres)
    assert len(heres) > 1  # a worker runs what the guard does not keep from it
    assert ast.literal_eval(errors)["position"] < 0.02
    assert "remark: simulating in this process alone" not in done.stderr


@pytest.mark.extended
@pytest.mark.parametrize(
    "system",
    [OBJECT, '{"kind": "fmu", "model": "pump.fmu"}', '{"kind": "function", "model": "pump.py"}'],
)
def test_workers_of_a_script_without_a_guard_are_refused_at_once(
    system: str, tmp_path: Path
) -> None:
    done = run_script(tmp_path, "main()", system, "workers=2, ")
    assert done.returncode == 1
    assert done.stdout == "here\n"
    (message,) = [line for line in done.stderr.splitlines() if line.startswith("ValueError")]
    assert "slide.learn with workers = 2 stands in script.py, line 13, outside of" in message
    assert "or say workers = 0" in message
