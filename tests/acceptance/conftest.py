"""Fixtures: small recipes, taken the whole way through the console script."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from slide_fmu.cli.app import app
from slide_fmu.data import pool
from slide_fmu.data.pool import process_pool
from tests.estimates import kept_estimates
from tests.few_motions import few_motions
from tests.libraries import build_libraries, one_process
from tests.recipes import LINEAR_NETWORK

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "build" / "finished_runs"
SMALL_DUFFING = """
name = "small_duffing"
description = "Duffing oscillator, small enough for a test"
equations = "m x'' + d x' + k x + alpha k x^3 = F"

[system]
model = "mbs_models.oscillators:DuffingOscillator"
parameters = { substeps = 6 }

[window]
step = 0.03
n_in = 72
n_out = 32

[data]
seed = 7
duration = 12.0
burn_in = 1.5
train = 12
validation = 2
estimator = 8
estimator_validation = 2

[[data.excitation]]
kind = "held_random"
weight = 3.0

[[data.excitation]]
kind = "multisine"
weight = 1.0
amplitude = [0.05, 0.3]
angular_frequency = [2.0, 60.0]

[network]
family = "feed_forward"
hidden = [32]
activation = "tanh"
linear_skip = true
time_invariant = true

[training]
steps = 500
batch = 256
learning_rate = 5e-3
expert.flip_signs = true
expert.validate_every = 100

[estimator]
beyond = true
expert.amplitude_factor = [1.0, 3.0]

[estimator.network]
family = "feed_forward"
hidden = [24]
activation = "elu"
time_invariant = true

[estimator.training]
steps = 200
batch = 64
learning_rate = 5e-3
expert.validate_every = 50
"""

SMALL_STATE_SPACE = """
name = "small_state_space"
description = "Duffing oscillator, learnt by a small state-space network"
equations = "m x'' + d x' + k x + alpha k x^3 = F"

[system]
model = "mbs_models.oscillators:DuffingOscillator"
parameters = { substeps = 12 }

[window]
step = 0.03
n_in = 112
n_out = 72

[data]
seed = 9
duration = 12.0
burn_in = 1.5
train = 16
validation = 4
estimator = 6
estimator_validation = 2
beyond = 6
beyond_factor = [1.0, 2.0]

[[data.excitation]]
kind = "held_random"
weight = 1.0

[network]
hidden = 8

[training]
expert.part = 2
starts = 2
expert.start_iterations = 8
expert.kept = 1
expert.kept_iterations = 8
iterations = 12

[estimator]
beyond = true
expert.amplitude_factor = [1.0, 2.0]

[estimator.network]
family = "feed_forward"
hidden = [8]

[estimator.training]
steps = 100
batch = 64
learning_rate = 5e-3
expert.validate_every = 50
"""

SMALL_BOUNDED = """
name = "small_bounded"
description = "Duffing oscillator, learnt by a small state-space network with an error bound"

[system]
model = "mbs_models.oscillators:DuffingOscillator"
parameters = { damping = 40.0, substeps = 6 }

[window]
step = 0.015625
n_in = 48
n_out = 8

[data]
seed = 7
duration = 2.5
burn_in = 0.5
train = 6
validation = 2
companion = 6
bound = 20
calibration = 40

[[data.excitation]]
kind = "held_random"
weight = 1.0

[network]
order = 2
hidden = 4

[training]
starts = 1
expert.start_iterations = 5
expert.kept = 1
expert.kept_iterations = 5
iterations = 8

[bound]
estimate_span = 0.25
expert.attempts = 1
expert.short_span = 0.05
expert.long_span = 0.25
expert.hidden = [8]
expert.steps = 500
"""
"""The tables of a recipe that ``slide-fmu init`` writes for a model, with the smallest numbers."""

SMALL_LINEAR = (
    """
name = "small_linear"
description = "Linear oscillator, small enough for a test"

[system]
model = "mbs_models.oscillators:LinearOscillator"

[window]
step = 0.03125
n_in = 72
n_out = 8
remaining_amplitude = 1e-3

[data]
seed = 8
duration = 20.0
burn_in = 3.0
train = 8
validation = 2

"""
    + LINEAR_NETWORK
    + """
[training]
steps = 1200
batch = 256
learning_rate = 1e-2
expert.precision = "float64"
expert.validate_every = 300
"""
)


@dataclass(frozen=True)
class Finished:
    """A recipe after ``slide-fmu run``: where its files lie and what it printed as JSON."""

    recipe: Path
    runs: Path
    name: str
    figures: dict[str, Any]

    @property
    def fmu(self) -> Path:
        """The FMU of the run."""
        return self.runs / self.name / f"{self.name}.fmu"

    @property
    def released(self) -> dict[str, Any]:
        """The figures that the FMU carries: those of the run without times."""
        untimed = {
            name: {key: value for key, value in one.items() if key != "timing"}
            for name, one in self.figures["validation"].items()
        }
        return {**self.figures, "validation": untimed}


def invoke(*arguments: object) -> Result:
    """Call the console script in this process; errors stay visible."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def run_recipe(folder: Path, name: str, text: str, workers: int = 1) -> Finished:
    """Take a recipe the whole way, once for all test processes and for the same sources.

    A second worker takes longer to start than it saves. With 0 workers this process simulates.

    What was finished is kept in ``build/finished_runs``, and every test process gets a copy.
    """
    kept = KEPT / name / _key(text)
    kept.parent.mkdir(parents=True, exist_ok=True)
    with one_process(KEPT / f"{name}.lock"):
        if not kept.exists():
            made = Path(tempfile.mkdtemp(dir=KEPT))
            _run(made, name, text, workers)
            shutil.rmtree(kept.parent)
            kept.parent.mkdir()
            made.rename(kept)
        shutil.copytree(kept, folder, dirs_exist_ok=True)
    figures = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    return Finished(folder / f"{name}.toml", folder / "runs", name, figures)


def _run(folder: Path, name: str, text: str, workers: int) -> None:
    build_libraries()  # else an FMU may get those of other sources, which lie there
    recipe, figures = folder / f"{name}.toml", folder / f"{name}.json"
    recipe.write_text(text, encoding="utf-8")
    with few_motions(), pytest.MonkeyPatch.context() as patch:
        if workers == 0:  # the console script asks for one at least
            patch.setattr(pool, "process_pool", lambda _: process_pool(0))
        result = invoke(
            *("run", recipe, "--runs", folder / "runs"),
            *("--trajectories", 4, "--workers", max(1, workers), "--json", figures),
        )
    assert result.exit_code == 0, result.output


@cache
def _sources() -> bytes:
    """A hash of all that a run depends on, but for its recipe."""
    ends = {".py", ".c", ".h", ".js", ".css", ".html", ".md", ".xsd", ".lock"}
    total = hashlib.sha256()
    for part in ("slide_fmu", "mbs_models", "requirements.lock"):
        for path in sorted([ROOT / part, *(ROOT / part).rglob("*")]):
            if path.is_file() and path.suffix in ends:
                total.update(str(path.relative_to(ROOT)).encode() + path.read_bytes())
    return total.digest()


def _key(text: str) -> str:
    return hashlib.sha256(_sources() + text.encode()).hexdigest()[:16]


@pytest.fixture(scope="session")
def duffing(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """The small Duffing recipe, finished."""
    with kept_estimates():
        return run_recipe(tmp_path_factory.mktemp("duffing"), "small_duffing", SMALL_DUFFING)


@pytest.fixture(scope="session")
def state_space(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """The small state-space recipe, finished."""
    folder = tmp_path_factory.mktemp("state_space")
    with kept_estimates():
        return run_recipe(folder, "small_state_space", SMALL_STATE_SPACE)


@pytest.fixture(scope="session")
def bounded(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """The small state-space recipe with an error bound, finished."""
    folder = tmp_path_factory.mktemp("bounded")
    with kept_estimates():
        return run_recipe(folder, "small_bounded", SMALL_BOUNDED, workers=0)


@pytest.fixture(scope="session")
def linear(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """The small linear recipe, finished."""
    return run_recipe(tmp_path_factory.mktemp("linear"), "small_linear", SMALL_LINEAR, workers=2)
