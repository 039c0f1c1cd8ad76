"""Networks that come to rest elsewhere after each motion are told from those that forget."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.records.remarks import apart_at_rest, on_spread
from tests.own_records import write_record
from tests.records.small_surrogates import scalar_surrogate
from tests.records.test_segments import recipe_of, source_of

FORGOTTEN = 1e-5


def apart(folder: Path, pole: float, effect: float) -> FloatArray | None:
    """What is found of x -> pole x + 5 u + effect tanh(x), under the force of a record."""
    recipe = recipe_of(write_record(folder / "bench.csv"))
    source = source_of(recipe)
    return apart_at_rest(scalar_surrogate(recipe, source, pole, effect), recipe, source)


def test_network_that_forgets_comes_to_rest_at_one_place(tmp_path: Path) -> None:
    assert apart(tmp_path, 0.9, 0.05) == pytest.approx([0.0], abs=FORGOTTEN)


def test_network_with_two_places_of_rest_stays_apart(tmp_path: Path) -> None:
    """With 0.2 x = 0.4 tanh(x) there are two; motion goes to and fro between them."""
    found = apart(tmp_path, 0.8, 0.4)
    assert found is not None
    assert found > 0.05


def test_network_with_a_memory_longer_than_the_window_stays_apart(tmp_path: Path) -> None:
    """After 240 samples 0.995 to this power is left, 0.3, of what differed before."""
    found = apart(tmp_path, 0.995, 0.0)
    assert found is not None
    assert np.all((found > 0.1) & (found < 1.0))


@pytest.mark.parametrize(
    ("blocks", "median", "p90", "said"),
    [(5, 0.03, 0.17, True), (5, 0.03, 0.059, False), (1, 0.03, 0.17, False)],
)
def test_error_that_rare_events_decide_is_remarked(
    blocks: int, median: float, p90: float, said: bool
) -> None:
    spread = SimpleNamespace(median=median, p10=0.0, p90=p90)
    output = SimpleNamespace(name="travel", relative_rmse_of_trajectories=spread)
    figures = SimpleNamespace(outputs=(output,))
    validation: Any = SimpleNamespace(comparisons=(None,) * blocks, figures=lambda: figures)
    remarks = on_spread(validation)
    assert bool(remarks) == said
    if said:
        assert "of the 5 tested blocks, the median one has an error of 3 %" in remarks[0]
        assert "one in ten 17 %" in remarks[0]
