"""The same recipe gives the same FMU, byte by byte, in each run on one machine."""

from __future__ import annotations

import hashlib
import json
import zipfile
from pathlib import Path

from slide_fmu.core.progress import quiet_stages
from slide_fmu.pipeline.job import open_job
from slide_fmu.pipeline.run import TIMES, FinishedRun, run_recipe
from slide_fmu.validation.task import UNSEEN_SEED
from tests.recipes import TINY


def ran(folder: Path) -> FinishedRun:
    """Run the tiny recipe in a folder of its own."""
    folder.mkdir()
    recipe = folder / "tiny.toml"
    recipe.write_text(TINY, encoding="utf-8")
    job = open_job(recipe, folder / "runs", quiet_stages)
    return run_recipe(job, UNSEEN_SEED, trajectories=2, workers=0, threads=1)


def hashes(fmu: Path) -> dict[str, str]:
    """Hash the archive and each of its members, by name."""
    with zipfile.ZipFile(fmu) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    files = {"the archive": fmu.read_bytes(), **members}
    return {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}


def test_two_runs_of_a_recipe_give_the_same_file(tmp_path: Path) -> None:
    one, other = (ran(tmp_path / name) for name in ("one", "other"))
    assert hashes(one.fmu) == hashes(other.fmu)
    for run in (one, other):  # the folder of the run has what differs
        timing = run.figures.in_range.timing
        assert timing is not None
        times = json.loads((run.page.parent / TIMES).read_text("utf-8"))
        assert times["fmu_step_us"] == timing.fmu_step_us
        assert "A step takes" in (run.page.parent / "card.md").read_text("utf-8")
