"""What a network sees where its recipe leaves that open."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.scaling import range_scaling
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.window import Window
from slide_fmu.data.trajectories import Split
from slide_fmu.features.base import FeatureOffer
from slide_fmu.features.serial_chain import SerialChain
from slide_fmu.fitting import feature_search
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.feature_search import STAGE, Trials, choices, search_features
from slide_fmu.fitting.history import History, explanations_of
from slide_fmu.fitting.problem import FittedNetwork, Problem
from slide_fmu.recipe.learning import LeastSquaresExpert, LeastSquaresRecipe, StateSpaceRecipe
from tests.fitting.plants import ARM, STEP
from tests.progress import no_stages
from tests.refusals import refused

FORCE = Signal("force", "N", -1.0, 1.0)
ANGLE = Signal("angle", "rad", -3.0, 3.0)
JOINTS = (Signal("one", "rad", -3.0, 3.0), Signal("two", "rad", -1.0, 1.0))
OPEN = StateSpaceRecipe()


def offered(*signals: Signal, chain: SerialChain | None = None) -> FeatureOffer:
    return FeatureOffer(signals, range_scaling(signals), STEP, chain)


def drives(tables: list[StateSpaceRecipe]) -> list[tuple[str, ...] | None]:
    return [table.drive for table in tables]


DIRECTORS = ("direction", "turn", "turn_change")


def test_forces_leave_nothing_to_choose() -> None:
    assert drives(choices(OPEN, offered(FORCE), 1)) == [("inputs",)]


def test_angles_are_taken_as_directors_first() -> None:
    assert drives(choices(OPEN, offered(ANGLE), 1)) == [DIRECTORS, ("inputs",)]
    mixed = choices(OPEN, offered(ANGLE, FORCE), 1)
    assert drives(mixed) == [(*DIRECTORS, "others"), ("inputs",)]


def test_features_that_a_recipe_names_are_kept() -> None:
    for table in ({"drive": ["changes"]}, {"static": ["inputs"]}, {"readout": ["inputs"]}):
        network = StateSpaceRecipe.model_validate(table)
        (kept,) = choices(network, offered(ANGLE), 1)
        assert kept.roles() == network.roles()
    gated = StateSpaceRecipe(units="gated", schedule=("inputs",))
    assert choices(gated, offered(ANGLE), 1)[0].roles() == gated.roles()


def test_odd_networks_see_the_inputs() -> None:
    assert drives(choices(StateSpaceRecipe(bias=False), offered(ANGLE), 1)) == [("inputs",)]


def test_loads_of_a_chain_are_tried_the_richest_last() -> None:
    found = choices(OPEN, offered(*JOINTS, chain=ARM), 3)
    loads = ("wrench_change",)
    assert drives(found) == [DIRECTORS, ("inputs",), loads, loads, loads, loads]
    assert [table.units for table in found] == ["tanh"] * 3 + ["gated"] * 3
    assert [table.readout for table in found[3:]] == [(), ("position",), ("position",)]
    assert [table.turned_pairs for table in found] == [0, 0, 0, 0, 0, 4]
    assert found[-1].order == 12
    small = choices(StateSpaceRecipe(order=4), offered(*JOINTS, chain=ARM), 3)[-1]
    assert (small.order, small.turned_pairs) == (4, 2)


def test_pairs_turn_only_with_vectors_and_a_first_joint_that_turns() -> None:
    assert len(choices(OPEN, offered(*JOINTS, chain=ARM), 2)) == 5
    sliding = SerialChain(**{**vars(ARM), "prismatic": np.array([1.0, 0.0])})
    assert len(choices(OPEN, offered(*JOINTS, chain=sliding), 3)) == 5


def trials(folder: Path, *signals: Signal, seed: int = 0) -> Trials:
    """A lag behind the sine of the first input."""
    rng = np.random.default_rng(seed)

    def values(count: int) -> tuple[FloatArray, FloatArray]:
        steps = rng.uniform(-0.4, 0.4, (count, 300, len(signals)))
        inputs = np.cumsum(steps, axis=1) - np.cumsum(steps, axis=1).mean(1, keepdims=True)
        outputs = np.zeros((count, 301, 1))
        for k in range(300):
            outputs[:, k + 1, 0] = 0.7 * outputs[:, k, 0] + np.sin(3.0 * inputs[:, k, 0])
        return inputs, outputs

    window = Window(STEP, 40, 10)
    made = offered(*signals)

    def split(count: int) -> Split:
        inputs, outputs = values(count)
        in_units = inputs * made.scaling.scale + made.scaling.offset
        return Split(in_units, outputs, np.zeros(count, np.int64))

    return Trials(made, window, (split(8), split(3)), None, folder)


SHORT = LeastSquaresRecipe(expert=LeastSquaresExpert(segment=50))


@pytest.mark.extended
def test_sine_of_an_angle_is_seen_by_its_direction(tmp_path: Path) -> None:
    taken, histories = search_features(OPEN, SHORT, trials(tmp_path, ANGLE), no_stages)
    assert taken.drive == DIRECTORS
    assert (taken.order, taken.hidden) == ("auto", "auto")
    plain, directors = f"{STAGE}: drive inputs", f"{STAGE}: drive direction, turn, turn_change"
    assert list(histories) == [directors, plain]
    best = {name: history.validation_error for name, history in histories.items()}
    assert best[directors][0] < 0.3 * best[plain][0]


@pytest.mark.extended
def test_trials_that_were_done_are_not_done_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A search that was killed goes on with the checkpoints of its trials."""
    made = trials(tmp_path, ANGLE)
    first = search_features(OPEN, SHORT, made, no_stages)
    assert len(list(tmp_path.glob("choice-*.pt"))) == 2

    def fail(*_: Any) -> None:
        raise AssertionError("an iteration was done again")

    name = "slide_fmu.fitting.state_space.levenberg_marquardt.advance"
    monkeypatch.setattr(name, fail)
    assert search_features(OPEN, SHORT, made, no_stages) == first


@pytest.mark.parametrize("change", ["order", "range"])
def test_trials_of_another_network_or_another_range_are_tried_anew(
    tmp_path: Path, change: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feature_search, "SHORT", {"starts": 1, "iterations": 1})
    once = {"start_iterations": 1, "kept": 1, "kept_iterations": 1, "part": 2}
    monkeypatch.setattr(feature_search, "SHORT_EXPERT", once)

    def errors(folder: Path, network: StateSpaceRecipe, scale: float = 1.0) -> list[float]:
        made = trials(folder, ANGLE)
        wider = replace(made.offered.scaling, scale=scale * made.offered.scaling.scale)
        made = replace(made, offered=replace(made.offered, scaling=wider))
        histories = search_features(network, SHORT, made, no_stages)[1].values()
        return [history.validation_error[0] for history in histories]

    small = StateSpaceRecipe(order=2, hidden=1)
    other = (StateSpaceRecipe(order=3, hidden=1), 1.0) if change == "order" else (small, 2.0)
    errors(tmp_path / "kept", small)
    assert errors(tmp_path / "kept", *other) == errors(tmp_path / "new", *other)


def faked(monkeypatch: pytest.MonkeyPatch, errors: list[float]) -> None:
    """Fits that end with these errors one after the other; infinite: they diverge."""
    left = iter(errors)

    def fit(problem: Problem, table: StateSpaceRecipe, *_: Any) -> FittedNetwork:
        error = next(left)
        if not np.isfinite(error):
            raise TrainingError("diverged")
        history = History((1, 2), (0.5, 0.4), (2 * error, error))
        return FittedNetwork(None, history, table)  # type: ignore[arg-type]

    monkeypatch.setattr(feature_search, "fit_state_space", fit)


@pytest.mark.parametrize(
    ("errors", "drive"),
    [
        ([0.1, 0.09], DIRECTORS),
        ([0.1, 0.07], ("inputs",)),
        ([np.inf, 0.5], ("inputs",)),
        ([0.5, np.inf], DIRECTORS),
    ],
)
def test_later_choice_must_be_worth_it(
    errors: list[float], drive: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    faked(monkeypatch, errors)
    taken, histories = search_features(OPEN, SHORT, trials(tmp_path, ANGLE), no_stages)
    assert taken.drive == drive
    finite = [error for error in errors if np.isfinite(error)]
    assert [history.validation_error for history in histories.values()] == [(e,) for e in finite]
    (explanation,) = explanations_of(histories)
    assert explanation.startswith(f"'drive {', '.join(drive)}': error ")


def test_search_without_a_finite_error_names_the_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    faked(monkeypatch, [np.inf, np.inf])
    with refused(TrainingError, "none of 2 choices", "([network], drive)"):
        search_features(OPEN, SHORT, trials(tmp_path, ANGLE), no_stages)
