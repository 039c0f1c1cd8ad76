"""Windows of systems with physical parameters hold the corner that remembers longest."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from slide_fmu.memory import motions
from slide_fmu.pipeline.job import Job, open_job
from slide_fmu.pipeline.stages import size_recipe
from slide_fmu.recipe.recipe import RecipeError
from tests.marks import needs_app
from tests.progress import no_stages
from tests.refusals import refused

OPEN = """
name = "{name}"
description = "a damped oscillator"
[system]
model = "mbs_models.oscillators:LinearOscillator"
parameters = {{ damping = 40.0, substeps = 6{fixed} }}
{parameters}
[window]
step = 0.015625
[data]
seed = 7
train = 4
validation = 2
[[data.excitation]]
kind = "held_random"
weight = 1.0
"""
MASS = "[parameters.mass]\nrange = [1.0, 3.0]\n"


@pytest.fixture(scope="module", autouse=True)
def few_motions() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(motions, "MOTIONS", 4)
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Holds the recipe whose mass is open, and its run folder with the lengths that were found."""
    return tmp_path_factory.mktemp("corners")


@pytest.fixture(scope="module")
def job(folder: Path) -> Job:
    return opened(folder, "both", MASS)


def opened(folder: Path, name: str, parameters: str = "", fixed: str = "") -> Job:
    place = folder / f"{name}.toml"
    text = OPEN.format(name=name, parameters=parameters, fixed=fixed)
    place.write_text(text, encoding="utf-8")
    return open_job(place, folder / "runs", no_stages)


@pytest.mark.extended
def test_window_is_that_of_the_slowest_corner(job: Job, tmp_path: Path) -> None:
    """Its time constant is 2 m / d: the heaviest mass decays most slowly."""
    light, heavy = (
        opened(tmp_path, f"mass_{mass}", fixed=f", mass = {mass}.0") for mass in (1, 3)
    )
    assert job.resolved == heavy.resolved
    assert job.resolved["window"]["n_in"] > light.resolved["window"]["n_in"]
    assert job.sizing is not None
    assert heavy.sizing is not None
    assert job.sizing.needed == heavy.sizing.needed
    assert size_recipe(job).figures() == size_recipe(heavy).figures()


@needs_app("compare")
def test_models_of_other_kinds_follow_no_parameters(job: Job) -> None:
    from slide_fmu.apps.compare.compare import Terms, compare_recipe

    with refused(RecipeError, "['mass']; expected none", "fixed values"):
        compare_recipe(job, Terms(budget=1.0, seed=0))


@pytest.mark.extended
def test_lengths_are_found_again_for_other_ranges(job: Job, folder: Path) -> None:
    again = opened(folder, "both", MASS)
    assert again.resolved == job.resolved
    assert again.sizing is None  # it was kept
    narrow = opened(folder, "both", MASS.replace("3.0", "1.5"))
    assert narrow.sizing is not None
    assert narrow.resolved["window"]["n_in"] < job.resolved["window"]["n_in"]
