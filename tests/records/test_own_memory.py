"""An FMU that does not forget where its records lead it contradicts its card."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slide_fmu.memory.stability import UnstableSurrogateError
from slide_fmu.records.own_memory import (
    OTHERS,
    OTHERS_IN_WORDS,
    effect_of_restarts,
    require_own_memory,
)
from tests.own_records import STEP, write_record
from tests.records.bench import smooth, write
from tests.records.small_surrogates import scalar_surrogate
from tests.records.test_segments import recipe_of, source_of
from tests.refusals import refused

CARD = 0.07


def validation_of(
    folder: Path, pole: float, effect: float, error: float = CARD, record: Path | None = None
) -> Any:
    """A validation of x -> pole x + 5 u + effect tanh(x), whose card prints this error."""
    recipe = recipe_of(record or write_record(folder / "bench.csv"))
    source = source_of(recipe)
    surrogate = scalar_surrogate(recipe, source, pole, effect)
    size = float(surrogate.predict_newest(source.pieces[0].trajectory.inputs).std())
    output = SimpleNamespace(name="travel", relative_rmse=error, rms_reference_about_mean=size)
    figures = SimpleNamespace(outputs=(output,))
    return SimpleNamespace(surrogate=surrogate, recipe=recipe, figures=lambda: figures)


def test_network_that_forgets_agrees_with_its_card(tmp_path: Path) -> None:
    found = validation_of(tmp_path, 0.9, 0.05, error=1e-4)
    source = source_of(found.recipe)
    effects = effect_of_restarts(source, found)
    assert effects is not None
    assert effects.shape == (2, 1)
    assert effects.max() < 1e-4
    require_own_memory(source, found)


def test_network_of_a_long_memory_is_refused_with_the_figures_of_both(tmp_path: Path) -> None:
    """After 240 samples 0.3 is left of what was before."""
    found = validation_of(tmp_path, 0.995, 0.0)
    source = source_of(found.recipe)
    effects = effect_of_restarts(source, found)
    assert effects is not None
    assert effects.max() > 3 * CARD
    own, inputs = found.surrogate, source.pieces[0].trajectory.inputs
    size = found.figures().outputs[0].rms_reference_about_mean
    apart = own.predict(inputs) - own.predict_newest(inputs)
    assert effects[1, 0] == pytest.approx(float(np.sqrt(np.mean(apart**2))) / size)
    with refused(
        UnstableSurrogateError, "error of 7 %, but", "truncation error is", "raise window.n_in"
    ):
        require_own_memory(source, found)


def test_effect_below_twice_the_error_contradicts_nothing(tmp_path: Path) -> None:
    found = validation_of(tmp_path, 0.995, 0.0)
    source = source_of(found.recipe)
    effects = [effect_of_restarts(source, found, others) for others in (0, OTHERS)]
    poor = validation_of(tmp_path, 0.995, 0.0, error=0.51 * float(np.max(effects)))
    require_own_memory(source_of(poor.recipe), poor)


def test_effect_along_other_inputs_is_relative_to_how_far_these_lead(tmp_path: Path) -> None:
    """A linear network forgets as slowly wherever it is; inputs about other levels lead it far."""
    found = validation_of(tmp_path, 0.995, 0.0)
    source = source_of(found.recipe)
    along, elsewhere = (effect_of_restarts(source, found, others) for others in (0, OTHERS))
    assert along is not None
    assert elsewhere is not None
    assert (elsewhere < 1.3 * along).all()


def test_lasting_state_beside_the_record_is_refused(tmp_path: Path) -> None:
    """Two states last without an input; the record holds the network in one of them."""
    force = 1 + 0.2 * smooth(4000)
    force[2000:2003] = -1.0
    columns = {"time [s]": STEP * np.arange(4000), "force [N]": force}
    record = write(tmp_path / "bench.csv", **columns, **{"travel [m]": smooth(4000, 1)})
    found = validation_of(tmp_path, 0.9, 2.0, record=record)
    source = source_of(found.recipe)
    effects = effect_of_restarts(source, found)
    assert effects is not None
    assert effects.max() < CARD
    with refused(UnstableSurrogateError, f"along {OTHERS_IN_WORDS}the records"):
        require_own_memory(source, found)


def test_user_may_allow_it(tmp_path: Path) -> None:
    found = validation_of(tmp_path, 0.995, 0.0)
    allowed = found.recipe.stability.model_copy(update={"allow_unstable": True})
    found.recipe = found.recipe.model_copy(update={"stability": allowed})
    require_own_memory(source_of(found.recipe), found)
