"""What users do by mistake, or in another order, and what they are answered."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.cli.console import errors
from slide_fmu.fmu.export import read_fmu, read_member
from slide_fmu.pipeline.job import open_job, provenance
from slide_fmu.pipeline.run_folder import TrainedSurrogate
from tests.acceptance.conftest import (
    SMALL_DUFFING,
    SMALL_LINEAR,
    Finished,
    invoke,
)
from tests.fmu.samples import sum_surrogate
from tests.limits import HANGS
from tests.marks import needs_app, of_app
from tests.progress import no_stages

CART = '''
import numpy as np
from slide_fmu.core.signals import Signal
from slide_fmu.systems.base import Linearizable, Linearization, RandomStates, State


class Cart(RandomStates, Linearizable):
    """A mass that a damper brakes and nothing holds: where it is depends on its past for ever."""

    def __init__(self, *, step):
        self.step = step
        self.inputs = (Signal("force", "N", -1, 1),)
        self.outputs = (Signal("position", "m", -10, 10),)
        self.state = State(np.zeros(1), np.zeros(1), np.zeros(1))

    def random_state(self, rng, first_input=None):
        return State(rng.uniform(-1, 1, 1), rng.uniform(-1, 1, 1), np.zeros(1))

    def rest_state(self, held_input):
        return State(np.zeros(1), np.zeros(1), held_input)

    def set_state(self, state):
        self.state = state

    def get_state(self):
        return self.state

    def output(self):
        return self.state.coordinates

    def advance(self, inputs):
        fade = np.exp(-2 * self.step)
        end = self.state.velocities * fade + inputs / 2 * (1 - fade)
        moved = self.state.coordinates + self.step * 0.5 * (self.state.velocities + end)
        self.state = State(moved, end, inputs)
        return moved

    def linearize(self, state):
        one = np.eye(1)
        return Linearization(one, 2 * one, 0 * one, np.zeros((0, 1)))
'''


SOFTENED = """
from mbs_models.oscillators import LinearOscillator


class Softened(LinearOscillator):
    def __init__(self, *, step):
        super().__init__(step=step, stiffness={})
"""


LOPSIDED = """
from mbs_models.oscillators import DuffingOscillator
from slide_fmu.core.signals import Signal


class Lopsided(DuffingOscillator):
    def __init__(self, *, step, substeps):
        super().__init__(step=step, substeps=substeps)
        self.outputs = (Signal("position", "m", -1.0, 3.0),)
"""


def test_model_beside_the_recipe_is_found_and_its_free_direction_refused(tmp_path: Path) -> None:
    (tmp_path / "my_cart.py").write_text(CART, encoding="utf-8")
    recipe = tmp_path / "cart.toml"
    text = SMALL_LINEAR.replace("mbs_models.oscillators:LinearOscillator", "my_cart:Cart")
    recipe.write_text(text, encoding="utf-8")
    result = invoke("window", recipe, "--json", "-")
    assert result.exit_code == 1
    assert "an integral or a free direction" in result.output
    figures = json.loads(result.stdout)
    assert figures["measured_decay_time_s"]["mean"] is None
    assert figures["rigid_body_eigenvalues"] == 1
    assert figures["sufficient"] is False


def test_training_refuses_data_of_another_recipe(duffing: Finished, tmp_path: Path) -> None:
    other = tmp_path / "other.toml"
    other.write_text(SMALL_DUFFING.replace("step = 0.03\n", "step = 0.035\n"), encoding="utf-8")
    result = invoke("train", other, "--runs", duffing.runs)
    assert result.exit_code == 1
    assert "are missing for the values of this recipe and its model" in result.output


@pytest.mark.extended
def test_training_refuses_a_window_that_was_made_too_short(
    duffing: Finished, tmp_path: Path
) -> None:
    """Data do not depend on the window: they are still there, and fit."""
    other = tmp_path / "other.toml"
    other.write_text(SMALL_DUFFING.replace("n_in = 72", "n_in = 40"), encoding="utf-8")
    before = (duffing.runs / duffing.name / "surrogate.slide").read_bytes()
    result = invoke("train", other, "--runs", duffing.runs)
    assert result.exit_code == 1
    assert "n_in >= 71" in result.output
    assert (duffing.runs / duffing.name / "surrogate.slide").read_bytes() == before


@pytest.mark.extended
@pytest.mark.parametrize(
    "table", ["training", "estimator.expert.pretraining", "estimator.training"]
)
def test_flipped_signs_need_symmetric_ranges_in_every_training(tmp_path: Path, table: str) -> None:
    # a process keeps the module that it has imported, so each case has one of its own
    module = f"lopsided_in_{table.replace('.', '_')}"
    (tmp_path / f"{module}.py").write_text(LOPSIDED, encoding="utf-8")
    text = SMALL_DUFFING.replace("expert.flip_signs = true\n", "")
    for few in (("train = 12", "train = 1"), ("estimator = 8", "estimator = 1")):
        text = text.replace(*few)
    text = text.replace("validation = 2", "validation = 1")
    text = text.replace("mbs_models.oscillators:DuffingOscillator", f"{module}:Lopsided")
    pretraining = "[estimator.expert.pretraining]\nsteps = 5\nbatch = 4\nlearning_rate = 1e-3\n"
    text = text.replace("[estimator.training]", f"{pretraining}\n[estimator.training]")
    text = text.replace(f"[{table}]", f"[{table}]\nexpert.flip_signs = true")
    recipe = tmp_path / "lopsided.toml"
    recipe.write_text(text, encoding="utf-8")
    runs = tmp_path / "runs"
    made = invoke("generate", recipe, "--runs", runs, "--workers", 1)
    assert made.exit_code == 0, made.output
    result = invoke("train", recipe, "--runs", runs)
    assert result.exit_code == 1
    assert "the range of 'position' is -1.0 .. 3.0 m" in result.output


@pytest.mark.extended
def test_training_waits_for_data_of_a_model_that_has_changed(tmp_path: Path) -> None:
    model = tmp_path / "softening.py"
    recipe, runs = tmp_path / "softening.toml", tmp_path / "runs"
    text = SMALL_LINEAR.replace("mbs_models.oscillators:LinearOscillator", "softening:Softened")
    recipe.write_text(text, encoding="utf-8")

    def slide_fmu(subcommand: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "slide_fmu", subcommand, str(recipe), "--runs", str(runs)]
        return subprocess.run(command, capture_output=True, text=True, timeout=HANGS)

    model.write_text(SOFTENED.format(1600.0), encoding="utf-8")
    assert slide_fmu("generate").returncode == 0
    model.write_text(SOFTENED.format(1500.0), encoding="utf-8")
    refused = slide_fmu("train")
    assert refused.returncode == 1
    assert "are missing for the values of this recipe and its model" in refused.stderr
    assert slide_fmu("generate").returncode == 0
    assert slide_fmu("train").returncode == 0


def test_provenance_is_the_recipe_that_was_read(tmp_path: Path) -> None:
    recipe = tmp_path / "recipe.toml"
    recipe.write_text(SMALL_LINEAR, encoding="utf-8")
    job = open_job(recipe, tmp_path / "runs", no_stages)
    recipe.unlink()
    assert provenance(job, TrainedSurrogate(sum_surrogate(), {}, {}))["recipe"] == SMALL_LINEAR


def test_export_of_a_finished_recipe_keeps_report_and_measured_error(duffing: Finished) -> None:
    before = duffing.fmu.read_bytes()
    assert invoke("export", duffing.recipe, "--runs", duffing.runs).exit_code == 0
    assert duffing.fmu.read_bytes() == before
    _, provenance = read_fmu(duffing.fmu)
    assert provenance is not None
    assert provenance["measured"] == duffing.released
    assert read_member(duffing.fmu, "documentation/index.html") is not None


@pytest.mark.extended
def test_seed_of_the_training_reaches_the_provenance_of_the_fmu(
    linear: Finished, tmp_path: Path
) -> None:
    runs = tmp_path / "runs"
    shutil.copytree(linear.runs, runs)
    assert invoke("train", linear.recipe, "--runs", runs, "--seed", 5).exit_code == 0
    assert invoke("export", linear.recipe, "--runs", runs).exit_code == 1
    out = tmp_path / "seeded.fmu"
    call = ("export", linear.recipe, "--runs", runs, "--seed", 5, "-o", out)
    assert invoke(*call).exit_code == 0
    _, provenance = read_fmu(out)
    assert provenance is not None
    assert provenance["seeds"]["training"] == 5


@pytest.mark.extended
@pytest.mark.usefixtures("few_motions")
def test_run_fails_where_the_surrogate_errs_by_more_than_the_recipe_requires(
    duffing: Finished, tmp_path: Path
) -> None:
    runs, recipe = tmp_path / "runs", tmp_path / duffing.recipe.name
    shutil.copytree(duffing.runs, runs)
    gate = "\n[validation]\ntrajectories = 1\nduration = 4.0\nrequire = 1e-6\n"
    recipe.write_text(SMALL_DUFFING + gate, encoding="utf-8")
    result = invoke("run", recipe, "--runs", runs, "--workers", 1)
    assert result.exit_code == 1
    assert (
        "surrogate 'small_duffing' is not accurate enough: output 'position' has an error of"
        in (result.output)
    )
    assert "(validation.require = 1e-06)" in result.output
    assert "report  " in result.output


EARLY = {
    "duration": ("duration = 12.0", "duration = 1.0", "data.duration = 1 s; expected at least"),
    "validation": ("[network]", "[validation]\nduration = 0.3\n[network]", "validation.duration"),
}


@pytest.mark.parametrize("case", EARLY)
def test_times_that_hold_no_window_are_refused_at_once(tmp_path: Path, case: str) -> None:
    old, new, message = EARLY[case]
    recipe = tmp_path / "short.toml"
    recipe.write_text(SMALL_DUFFING.replace(old, new, 1), encoding="utf-8")
    result = invoke("run", recipe, "--runs", tmp_path / "runs")
    assert result.exit_code == 1
    assert message in result.output
    assert not (tmp_path / "runs").exists()


def test_place_for_figures_is_checked_before_the_work(duffing: Finished, tmp_path: Path) -> None:
    result = invoke("validate", duffing.fmu, "--json", tmp_path / "nowhere" / "figures.json")
    assert result.exit_code == 2
    assert "expected a file in a folder" in result.output


@pytest.mark.parametrize("duration", ["0", "inf"])
@pytest.mark.parametrize("subcommand", ["validate", of_app("ssp", "reference")])
def test_duration_that_is_no_positive_time_is_refused(
    duffing: Finished, tmp_path: Path, subcommand: str, duration: str
) -> None:
    more = {"validate": ("--trajectories", 1), "ssp": ("-o", tmp_path / "beside.ssp")}[subcommand]
    result = invoke(subcommand, duffing.fmu, "--duration", duration, *more)
    assert result.exit_code == 1
    assert "expected a positive, finite time" in result.output


@needs_app("reference")
@pytest.mark.parametrize("duration", ["0.001", "1e10", "1e300"])
def test_duration_of_too_many_samples_is_refused(
    duffing: Finished, tmp_path: Path, duration: str
) -> None:
    result = invoke("ssp", duffing.fmu, "--duration", duration, "-o", tmp_path / "beside.ssp")
    assert result.exit_code == 1
    assert "expected 1 to 100000000 samples, 0.03 s apart" in result.output


def test_too_little_memory_is_reported_without_a_traceback(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit), errors():
        np.zeros(2**55)
    assert "error: not enough memory: Unable to allocate 256. PiB" in capsys.readouterr().err


WITHOUT_MEANING = {
    "seed": ("--seed", 3),
    "data seed": ("--data-seed", 4),
    "runs": ("--runs", "runs"),
}


@pytest.mark.parametrize("option", WITHOUT_MEANING)
def test_export_of_an_fmu_refuses_options_of_recipes(
    duffing: Finished, tmp_path: Path, option: str
) -> None:
    name, value = WITHOUT_MEANING[option]
    result = invoke("export", duffing.fmu, "-o", tmp_path / "again.fmu", name, value)
    assert result.exit_code == 1
    message = f"{name} {value} was given; expected it for recipes only, not for FMUs: leave it out"
    assert message in result.output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", [".pt", ".pt2", ".onnx"])
def test_export_of_a_network_of_others_points_to_from_torch(tmp_path: Path, ending: str) -> None:
    result = invoke("export", tmp_path / f"network{ending}", "-o", tmp_path / "network.fmu")
    assert result.exit_code == 1
    assert "slide_fmu.from_torch" in result.output


def test_export_has_no_backends_any_more(tmp_path: Path) -> None:
    result = invoke("export", tmp_path / "network.pt", "--backend", "python")
    assert result.exit_code == 2
    assert "No such option" in result.output


def test_fmu_may_log_through_fmpy_after_a_run_of_ours(duffing: Finished) -> None:
    """fmpy keeps one logger for the whole process: ours must not stay in it when it is gone."""
    script = """
import gc, sys, fmpy, numpy as np
from pathlib import Path
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.importer.file import unpacked
path = sys.argv[1]
with unpacked(Path(path)) as fmu:
    run_fmu(fmu, {"force": np.zeros(5)}, ["position"])
gc.collect()
try:
    fmpy.simulate_fmu(path, stop_time=0.3, start_values={"force": float("nan")})
except Exception as error:
    print("refused:", error)
"""
    command = [sys.executable, "-c", script, str(duffing.fmu)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=HANGS)
    assert result.returncode == 0, result.stderr
    assert "refused:" in result.stdout


@pytest.mark.parametrize("seed", [2**31, 99999999999, -1])
def test_seed_that_no_recipe_may_have_is_a_mistake_of_the_call(tmp_path: Path, seed: int) -> None:
    recipe = tmp_path / "recipe.toml"
    recipe.write_text(SMALL_LINEAR, encoding="utf-8")
    for subcommand in ("train", "run", "export"):
        result = invoke(subcommand, recipe, "--runs", tmp_path / "runs", "--seed", seed)
        assert result.exit_code == 2
        output = result.output
        assert "Invalid value for '--seed'" in output
        assert "validation error" not in output
        assert "Traceback" not in output
    assert not (tmp_path / "runs").exists()
