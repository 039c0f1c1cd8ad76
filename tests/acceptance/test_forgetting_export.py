"""Whether a network forgets is tested at its export; one that does not is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.scaling import Affine
from slide_fmu.core.window import Window
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.state_space.cell import Cell
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.pipeline.job import Job, open_job, versions
from slide_fmu.pipeline.run_folder import TrainedSurrogate
from slide_fmu.pipeline.stages import STABILITY_REPORT
from slide_fmu.recipe.case import case_of
from slide_fmu.surrogate.surrogate import Surrogate
from tests.acceptance.conftest import SMALL_LINEAR, invoke
from tests.progress import no_stages

NEVER_FORGETS, FORGETS = 0.9999, 0.5


def surrogate_of(job: Job, pole: float = NEVER_FORGETS) -> Surrogate:
    """A state-space network of the job's signals: y -> pole y + u."""
    one, zero = np.ones((1, 1), np.float32), np.zeros((1, 1), np.float32)
    cell = Cell(
        np.float32(pole) * one,
        one,
        zero[:, :0],
        np.zeros((0, 3), np.float32),
        one,
        zero,
        zero[:, 0],
    )
    system, table = case_of(job.recipe).system, job.recipe.window
    scaling = Affine.of_channels([0.0], [1.0])
    window = Window(table.step, table.n_in, table.n_out)
    signals = system.inputs, system.outputs
    network = StateSpace(cell, table.n_in, table.n_out, FeatureMap(Differences(1)))
    return Surrogate(job.recipe.name, window, *signals, scaling, scaling, network)


@pytest.mark.parametrize("allowed", [False, True])
def test_export_refuses_a_network_that_does_not_forget(tmp_path: Path, allowed: bool) -> None:
    text = SMALL_LINEAR[: SMALL_LINEAR.index("[network]")]
    text += "[stability]\nallow_unstable = true\n" if allowed else ""
    recipe, runs, out = tmp_path / "recipe.toml", tmp_path / "runs", tmp_path / "out.fmu"
    recipe.write_text(text, encoding="utf-8")
    job = open_job(recipe, runs, no_stages)
    job.folder.path.mkdir(parents=True)
    job.folder.save_training(
        TrainedSurrogate(surrogate_of(job), {}, versions(job.recipe)), job.recipe
    )
    result = invoke("export", recipe, "--runs", runs, "-o", out)
    page = job.folder.path / STABILITY_REPORT
    assert "two runs from different states" in page.read_text(encoding="utf-8")
    assert out.exists() is allowed
    assert result.exit_code == (0 if allowed else 1), result.output
    if not allowed:
        message = result.output
        assert "surrogate 'small_linear' is not exported: at 1 times" in message
        assert "two runs from different states still differ by" in message
        assert "stability.allow_unstable = true" in message
        assert str(page) in result.output
        assert "Traceback" not in result.output


def test_changed_stability_limits_need_no_new_training_and_old_charts_vanish(
    tmp_path: Path,
) -> None:
    text = SMALL_LINEAR[: SMALL_LINEAR.index("[network]")]
    recipe, runs = tmp_path / "recipe.toml", tmp_path / "runs"
    recipe.write_text(text, encoding="utf-8")
    job = open_job(recipe, runs, no_stages)
    job.folder.path.mkdir(parents=True)
    job.folder.save_training(
        TrainedSurrogate(surrogate_of(job), {}, versions(job.recipe)), job.recipe
    )
    page = job.folder.path / STABILITY_REPORT
    export = ("export", recipe, "--runs", runs)
    assert invoke(*export).exit_code == 1
    assert page.exists()
    remedy = "\n[stability]\nallow_unstable = true\n[validation]\ntrajectories = 3\n"
    recipe.write_text(text + remedy, encoding="utf-8")
    result = invoke(*export)
    assert result.exit_code == 0, result.output
    assert page.exists()  # it failed all the same
    recipe.write_text(text.replace("seed = 8", "seed = 9") + remedy, encoding="utf-8")
    result = invoke(*export)
    assert result.exit_code == 1
    assert "was trained from other values" in result.output
    recipe.write_text(text + remedy.replace("= true", "= false"), encoding="utf-8")
    job.folder.save_training(
        TrainedSurrogate(surrogate_of(job, FORGETS), {}, versions(job.recipe)), job.recipe
    )
    result = invoke(*export)
    assert result.exit_code == 0, result.output
    assert not page.exists()
