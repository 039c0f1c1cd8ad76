"""The window that a recipe needs, computed and measured, and the refusal of a shorter one."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from mbs_models.oscillators.oscillators import LinearOscillator
from slide_fmu.cli.app import app
from slide_fmu.core.figures import plain
from slide_fmu.core.window import Window
from slide_fmu.memory import motions
from slide_fmu.memory.decay import DECAY_MARGIN, Decay
from slide_fmu.memory.decay_figures import SystemSizing
from slide_fmu.memory.modes import UnstableModeError
from slide_fmu.memory.sizing import (
    ShortWindowError,
    Sizing,
    require_window,
    size_window,
)
from slide_fmu.pipeline import stages
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import load_recipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.learning_sections import sizing_section
from slide_fmu.report.learning_tables import decay_table
from slide_fmu.systems.base import Linearization, Motion, State
from slide_fmu.systems.simulation import states_along
from tests.figures import filled
from tests.marks import first
from tests.recipes import TINY, tiny_recipe
from tests.refusals import refused

DECAY = 1.1513
"""s to 1 %, for m = 1 kg and d = 8 N s/m: ln(100) / 4."""
RATE = 4.0
"""Of that decay in 1/s: d / 2m."""

AGREEMENT = 0.15
"""Between linearized and measured: the most that the two may differ on the oscillators."""


CLOSE = 0.02
"""The same for a linear system, where only the samples and zero crossings blur it."""

DUFFING = Path(__file__).parents[2] / "training" / "duffing.toml"


@pytest.fixture
def few_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motions, "MOTIONS", 10)


def duffing() -> Recipe:
    """The released recipe with its own excitations, but short trajectories."""
    recipe = load_recipe(DUFFING)
    return recipe.model_copy(update={"data": recipe.data.model_copy(update={"duration": 8.0})})


def eigenvalues(found: Sizing) -> Decay:
    """The decay that the linearized equations have."""
    assert found.linearized is not None
    return found.linearized.decay


def oscillator(model: str, train: int = 40, **window: Any) -> Recipe:
    return tiny_recipe(
        system={"model": f"mbs_models.oscillators:{model}", "parameters": {"damping": 8.0}},
        data={"duration": 4.0, "train": train},
        window={"step": 0.03, "n_in": 92, "n_out": 53, **window},
    )


@pytest.mark.parametrize(
    ("recipe", "agreement"),
    first(
        [
            (duffing(), AGREEMENT),
            (oscillator("LinearOscillator"), CLOSE),
            (oscillator("DuffingBaseMotion"), AGREEMENT),
        ]
    ),
    ids=["duffing", "linear", "base_motion"],
)
def test_measured_and_linearized_decay_times_agree(recipe: Recipe, agreement: float) -> None:
    found = size_window(recipe, case_of(recipe).system)
    expected = -math.log(recipe.window.remaining_amplitude) / RATE
    assert eigenvalues(found).mean == pytest.approx(expected, rel=1e-3)
    assert eigenvalues(found).worst == pytest.approx(expected, rel=1e-3)
    assert found.measured.mean == pytest.approx(eigenvalues(found).mean, rel=agreement)
    assert found.problem is None
    require_window(recipe, found)


@pytest.mark.parametrize(("train", "motions", "pairs"), [(1, 4, 4), (10, 5, 7)])
def test_few_data_are_sized_by_few_motions(train: int, motions: int, pairs: int) -> None:
    """They have half as many samples as the data, but there are at least four of them."""
    recipe = oscillator("LinearOscillator", train)
    found = size_window(recipe, case_of(recipe).system)
    assert len(eigenvalues(found).times) == motions
    assert len(found.measured.times) == pairs


@pytest.mark.usefixtures("few_motions")
def test_figures_of_a_linear_oscillator_are_those_of_its_one_mode() -> None:
    recipe = oscillator("LinearOscillator")
    found = size_window(recipe, case_of(recipe).system)
    assert len(eigenvalues(found).times) == 10  # motions of 4.25 s, shorter than two windows
    assert len(found.measured.times) == 10
    figures = json.loads(json.dumps(plain(found.figures())))
    assert figures["decay_time_s"] == pytest.approx(
        {"mean": DECAY, "worst": DECAY, "local_worst": DECAY}, rel=1e-3
    )
    assert figures["recommended_n_in"] == 92
    assert figures["sufficient"]
    assert figures["modes_at_rest"][0]["decay_time_s"] == pytest.approx(DECAY, rel=1e-3)
    assert figures["modes_at_rest"][0]["frequency_rad_s"] == pytest.approx(40.0, rel=1e-3)


@pytest.mark.usefixtures("few_motions")
def test_motions_depend_on_the_seed() -> None:
    recipe = oscillator("DuffingOscillator")
    system = case_of(recipe).system
    first, again, other = (size_window(recipe, system, seed) for seed in (None, 7, 8))
    assert first.figures() == again.figures()  # 7 is the recipe's own
    assert first.measured.mean != other.measured.mean


@pytest.mark.usefixtures("few_motions")
def test_smaller_remaining_amplitude_needs_a_longer_window() -> None:
    recipe = oscillator("LinearOscillator", remaining_amplitude=1e-4)
    found = size_window(recipe, case_of(recipe).system)
    assert eigenvalues(found).mean == pytest.approx(2 * math.log(100) / 4, rel=1e-3)
    assert found.measured.mean == pytest.approx(eigenvalues(found).mean, rel=CLOSE)


@pytest.mark.usefixtures("few_motions")
def test_too_short_window_is_refused_with_the_numbers() -> None:
    recipe = oscillator("LinearOscillator", n_in=80)
    found = size_window(recipe, case_of(recipe).system)
    with pytest.raises(ShortWindowError) as caught:
        require_window(recipe, found)
    parts = ("'tiny'", "80 - 53 = 27 samples", "0.81 s", "39 samples", "1.151 s", "n_in >= 92")
    margin = 'n_in = 101 has a margin for motions of any other seed, and n_in = "auto" finds'
    for part in (*parts, margin, "window.allow_short = true"):
        assert part in str(caught.value)
    assert type(caught.value) is ShortWindowError  # the system forgets
    assert not found.figures().sufficient


@pytest.mark.usefixtures("few_motions")
def test_proposed_window_has_a_margin_above_the_slowest_of_the_measured_motions() -> None:
    recipe = oscillator("LinearOscillator", n_in=80)
    found = size_window(recipe, case_of(recipe).system)
    spread = Decay(math.log(0.01) / np.array([1.0, 3.0]), 0.01)
    with refused(ShortWindowError, f"n_in = {53 + math.ceil(DECAY_MARGIN * 3.0 / 0.03)} has a"):
        require_window(recipe, replace(found, measured=spread))


REMARK = (
    r"^the slowest of 10 measured pairs of motions takes {} s to meet, but the window truncates "
    r"1\.17 s, though the eigenvalues ask for 1\.151 s alone\. Raise window\.n_in from 92 to {} "
    r"to hold that one too; n_in = \"auto\" leaves a margin for motions of any other seed$"
)


@pytest.mark.usefixtures("few_motions")
def test_longer_measured_decay_is_a_remark(tmp_path: Path) -> None:
    """The eigenvalues fit: it is no mistake, but it is said wherever the decay times are."""
    recipe = oscillator("LinearOscillator")
    found = size_window(recipe, case_of(recipe).system)
    shorter = replace(found, measured=replace(found.measured, rates=np.full(10, -5.0)))
    assert shorter.remark is None
    assert shorter.figures().remark is None
    assert "Remark" not in sizing_section(shorter).text
    rates = np.array([-2.0, *np.full(9, -4.0)])
    longer = replace(found, measured=replace(found.measured, rates=rates))
    require_window(recipe, longer)
    assert longer.problem is None
    assert longer.remark is not None
    assert re.search(REMARK.format(r"2\.303", 53 + 77), longer.remark)
    assert longer.figures().remark == longer.remark
    assert longer.figures().sufficient
    assert sizing_section(longer).text.endswith(f" Remark: {longer.remark}.")
    never = replace(found, measured=replace(found.measured, rates=np.array([0.0, *rates[1:]])))
    assert never.remark is not None
    assert "10 measured pairs of motions did not meet within" in never.remark
    assert json.dumps(plain(never.figures()), allow_nan=False)
    short = replace(longer, window=replace(found.window, n_in=80))
    assert short.problem is not None
    assert short.remark is None  # that it is too short is enough


@pytest.mark.usefixtures("few_motions")
def test_measured_decay_that_the_window_just_holds_is_no_remark() -> None:
    recipe = oscillator("LinearOscillator")
    decay = Decay(np.array([-RATE]), 0.01)
    sized = size_window(recipe, case_of(recipe).system)
    assert sized.linearized is not None
    found = replace(
        sized,
        linearized=replace(sized.linearized, decay=decay),
        measured=decay,
        window=Window(decay.worst, 2, 1),  # truncates one step
    )
    assert found.window.truncation_time == decay.worst
    assert (found.problem, found.remark) == (None, None)


def test_worst_instant_is_that_of_all_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    rates = [[-4.0, -5.0], [-2.0, -7.0], [-3.0, -6.0]]
    along = [Decay(np.array(row), 0.01) for row in rates]
    monkeypatch.setattr(motions, "_decay_along_motions", lambda *work: along)
    monkeypatch.setattr(motions, "measured_decay", lambda *work: along[0])
    recipe = oscillator("LinearOscillator")
    found = size_window(recipe, case_of(recipe).system)
    assert found.linearized is not None
    assert found.linearized.local_worst == pytest.approx(math.log(100) / 2)


@pytest.mark.usefixtures("few_motions")
def test_subcommand_window_prints_the_remark(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = oscillator("LinearOscillator")
    found = size_window(recipe, case_of(recipe).system)
    longer = replace(found, measured=replace(found.measured, rates=np.full(10, -2.0)))
    monkeypatch.setattr(stages, "size_recipe", lambda job, seed: longer)
    place = tmp_path / "tiny.toml"
    place.write_text(TINY, encoding="utf-8")
    result = CliRunner().invoke(app, ["window", str(place), "--json", "-"])
    assert result.exit_code == 0
    assert f"remark: {longer.remark}" in result.output
    assert json.loads(result.stdout)["remark"] == longer.remark


@pytest.mark.usefixtures("few_motions")
def test_short_window_is_accepted_with_allow_short() -> None:
    recipe = oscillator("LinearOscillator", n_in=80, allow_short=True)
    found = size_window(recipe, case_of(recipe).system)
    assert found.problem is not None
    require_window(recipe, found)


@pytest.mark.usefixtures("few_motions")
def test_motion_that_never_ends_is_refused_with_a_remedy() -> None:
    recipe = tiny_recipe(system={"parameters": {"damping": 0.0}})
    with refused(ValueError, "decay time = inf s", "give the system damping"):
        size_window(recipe, case_of(recipe).system)


class Swaying(LinearOscillator):
    """Decays with 4 1/s in the mean, but every other instant it seems to grow with 12 1/s."""

    def linearize(self, state: State) -> Linearization:
        found, self.instants = super().linearize(state), getattr(self, "instants", -1) + 1
        factor = -3.0 if self.instants % 2 else 5.0
        return Linearization(
            found.mass, factor * found.damping, found.stiffness, found.constraints
        )


@pytest.mark.usefixtures("few_motions")
def test_growth_for_a_moment_is_accepted_and_reported() -> None:
    """The first instant is the state at rest."""
    recipe = oscillator("LinearOscillator", n_in=96)
    found = size_window(recipe, Swaying(damping=8.0, step=0.03))
    figures = found.figures()
    assert figures.decay_time_s is not None
    assert figures.decay_time_s.local_worst is None
    assert figures.decay_time_s.mean == pytest.approx(DECAY, rel=0.3)
    assert figures.decay_time_s.worst is not None
    assert decay_table(figures).rows[0][-1] == "without end"


class Pushed(LinearOscillator):
    """At rest only it decays."""

    def linearize(self, state: State) -> Linearization:
        found, sign = super().linearize(state), -1.0 if np.any(state.velocities) else 1.0
        return Linearization(found.mass, sign * found.damping, found.stiffness, found.constraints)


@pytest.mark.usefixtures("few_motions")
def test_growth_in_the_mean_is_refused_with_the_motion() -> None:
    message = r"motion 0 of 10: initial effects grow along the motion: .* Re\(v\) = 4 1/s in the"
    with pytest.raises(UnstableModeError, match=message):
        size_window(oscillator("LinearOscillator"), Pushed(damping=8.0, step=0.03))


class Unstable(LinearOscillator):
    """Grows at rest."""

    def linearize(self, state: State) -> Linearization:
        found = super().linearize(state)
        return Linearization(found.mass, -found.damping, found.stiffness, found.constraints)


@pytest.mark.usefixtures("few_motions")
def test_growth_at_rest_is_refused() -> None:
    with refused(UnstableModeError, "mode with v =", "grows", "signs of damping"):
        size_window(oscillator("LinearOscillator"), Unstable(damping=8.0, step=0.03))


RATES = np.array([-1.0, -9.0, -1.0, -9.0, -5.0, -5.0, -5.0, -5.0])
"""In 1/s, at eight instants of a motion; -5 in the mean, over two or four instants too."""


@pytest.mark.parametrize(
    ("n_in", "step", "stretch"),
    [
        (4, 0.5, 2),  # the window is longer than the decay: 4 of 2 samples between instants
        (1, 0.5, 1),  # the decay is longer: 0.92 s are 1.8 samples
        (1, 0.231, 2),  # 3.99 samples
        (1, 0.1, 5),  # 9.2 samples
        (8, 0.231, 4),
        (9, 0.231, 5),  # a part of an instant counts as a whole one
        (5, 0.231, 3),  # so that eight instants hold two stretches, not three
    ],
)
def test_stretch_is_as_long_as_the_window_or_the_decay_whichever_is_longer(
    n_in: int, step: float, stretch: int
) -> None:
    along = [Decay(RATES, 0.01), Decay(RATES[::-1] * 1.0, 0.01)]
    assert along[0].mean == pytest.approx(math.log(100) / 5)
    found = motions._decay_over_windows(along, Window(step, n_in, 1), 2)
    parts = [
        part
        for motion in along
        for part in np.array_split(motion.rates, max(1, len(motion.rates) // stretch))
    ]
    assert found.rates == pytest.approx([np.mean(part) for part in parts])
    assert found.remaining_amplitude == 0.01
    alone = motions._decay_over_windows(along[:1], Window(step, n_in, 1), 2)
    assert alone.rates == pytest.approx(found.rates[: len(alone.rates)])


@pytest.mark.extended
@pytest.mark.parametrize(
    ("damping", "duration", "followed", "measured"),
    [
        (8.0, 50.0, 920, [116] * 40),  # ten windows of 92; three decays of 1.151 s are 115.1 steps
        (8.0, 4.0, 133, [116] * 24),  # shorter motions: half of the data's samples hold 24 pairs
        (16.0, 4.0, 133, [92] * 30),  # three decays of 0.576 s are shorter than the window
        (0.1, 4.0, 133, [9211] * 4),  # 92 s: four pairs at least, though 20 000 samples hold two
        (0.6, 50.0, 920, [1536] * 13),  # 15.35 s: as many pairs as 20 000 samples hold
    ],
)
def test_motions_are_as_many_and_as_long_as_window_and_decay_ask(
    monkeypatch: pytest.MonkeyPatch,
    damping: float,
    duration: float,
    followed: int,
    measured: list[int],
) -> None:
    """Twenty motions are linearized at every twelfth sample, an eighth of a window of 92."""
    recipe = oscillator("LinearOscillator").model_copy(deep=True)
    recipe = recipe.model_copy(
        update={"data": recipe.data.model_copy(update={"duration": duration, "burn_in": 0.0})}
    )
    linearized: list[tuple[int, int, int]] = []
    lengths: list[int] = []
    drawn_for: list[float] = []
    original, draw = motions._decay_along_motions, motions.draw

    def draw_and_note(recipe: Recipe, system: Any, stream: Any, index: int, attempt: int) -> Any:
        assert attempt == 0
        assert stream.factors == (1.0, 1.0)  # the recipe's own amplitude
        drawn_for.append(stream.duration / 0.03)
        return draw(recipe, system, stream, index, attempt)

    def decay_along_motions(found: Any, draws: list[Any], stride: int) -> list[Decay]:
        linearized.extend((len(draws), len(drawn.inputs), stride) for drawn in draws)
        return original(found, draws, stride)

    def decay_of_pairs(
        system: Any, records: list[np.ndarray], rng: Any, amplitude: float, patience: Any
    ) -> Decay:
        lengths.extend(len(record) for record in records)
        return Decay(np.full(len(records), -RATE), amplitude)

    monkeypatch.setattr(motions, "draw", draw_and_note)
    monkeypatch.setattr(motions, "_decay_along_motions", decay_along_motions)
    monkeypatch.setattr(motions, "measured_decay", decay_of_pairs)
    size_window(recipe, LinearOscillator(damping=damping, step=0.03))
    assert linearized == [(20, followed, 12)] * 20
    assert lengths == measured
    assert drawn_for[:20] == pytest.approx([followed] * 20, abs=0.5)
    assert drawn_for[20:] == pytest.approx([max(followed, n) for n in measured], abs=0.5)


def test_states_along_a_motion_are_those_after_every_stride_th_sample() -> None:
    system, inputs = LinearOscillator(damping=8.0, step=0.03), np.full((7, 1), 900.0)
    start = system.rest_state(np.zeros(1))
    (found,) = states_along(system, [Motion(inputs, start)], 3)
    system.set_state(start)
    states = []
    for row in inputs:
        system.advance(row)
        states.append(system.get_state())
    assert [float(state.coordinates[0]) for state in found] == [
        float(states[k].coordinates[0]) for k in (2, 5)
    ]


def test_table_of_decay_times_has_their_numbers_and_says_where_there_is_no_end() -> None:
    decay = {"mean": 1.0, "worst": 2.34567}
    figures = filled(
        SystemSizing,
        decay_time_s={**decay, "local_worst": None},
        measured_decay_time_s={"mean": 3.0, "worst": None},
    )
    assert decay_table(figures).rows == (
        ("linearized", "1 s", "2.346 s", "without end"),
        ("measured", "3 s", "without end", ""),
    )
