"""What a comparison keeps is read again, and named where it is damaged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.apps.compare.compare import KeptComparison
from slide_fmu.apps.compare.model_figures import ModelFigures
from slide_fmu.core.result_cache import DamagedFileError
from slide_fmu.data.unseen import UnseenMotion
from tests.refusals import refused

MODEL = ModelFigures(title="FIR", linear=True, structure="9 lags", cpu_seconds=1.0)
MOTION = UnseenMotion(np.ones((3, 1)), np.zeros((4, 1)), 1, 0)


def never() -> None:
    """Stand for what is not looked for again."""
    raise AssertionError


def test_what_was_found_is_not_looked_for_again(tmp_path: Path) -> None:
    kept = KeptComparison(tmp_path)
    kept.figures("fir", "key", lambda: MODEL)
    kept.motions("key", lambda: [MOTION])
    assert kept.figures("fir", "key", never) == MODEL  # type: ignore[arg-type]
    (again,) = kept.motions("key", never)  # type: ignore[arg-type]
    assert np.array_equal(again.inputs, MOTION.inputs)


@pytest.mark.parametrize("part", [0.0, 0.5, 0.95])
def test_damaged_files_of_a_comparison_are_named(tmp_path: Path, part: float) -> None:
    kept = KeptComparison(tmp_path)
    kept.figures("fir", "key", lambda: MODEL)
    kept.motions("key", lambda: [MOTION])
    for path in tmp_path.iterdir():
        whole = path.read_bytes()
        path.write_bytes(whole[: int(part * len(whole))])
    with refused(DamagedFileError, ".json is damaged", "remove it"):
        kept.figures("fir", "key", lambda: MODEL)
    with refused(DamagedFileError, ".npz is damaged", "remove it"):
        kept.motions("key", lambda: [MOTION])
