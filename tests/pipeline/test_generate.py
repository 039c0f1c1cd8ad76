"""Where a command line lets trajectories be made, and what is refused."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from slide_fmu.pipeline.run_folder import StageError
from slide_fmu.pipeline.stages import generate_recipe
from tests.pipeline.test_numbers import opened, with_data
from tests.refusals import refused

WITH_NUMBERS = with_data("train = 2\nvalidation = 1")


@pytest.mark.extended
def test_data_are_made_beside_another_program_that_makes_some_and_not_beside_one_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("slide_fmu.pipeline.run_folder.TOGETHER_PATIENCE", 0.1)
    job = opened(tmp_path, WITH_NUMBERS)
    with job.folder.alone(), refused(StageError, "another program works in"):
        generate_recipe(job, 0, None, overwrite=False)
    with job.folder.together(), pytest.raises(StageError, match=rf"\(process {os.getpid()}\)"):
        generate_recipe(job, 0, None, overwrite=True)
    assert generate_recipe(job, 0, None, overwrite=False).made_now == 3
    assert generate_recipe(job, 0, None, overwrite=True).made_now == 3
