"""Measuring an FMU: against a finer reference, and by several processes."""

from __future__ import annotations

import re
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from slide_fmu.core.window import Window
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.excitation.mix import names_of
from slide_fmu.fmu.export import export_fmu
from slide_fmu.pipeline.preparation import check_recipe
from slide_fmu.pipeline.side_by_side import write_reference
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.recipe.systems import recipe_system, reference_system
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import simulate
from slide_fmu.systems.loading import LoadError
from slide_fmu.validation import figures
from slide_fmu.validation import validate as validation
from slide_fmu.validation.comparison import Comparison, Task, Validation
from slide_fmu.validation.model_card import model_card
from slide_fmu.validation.report import validation_sections
from slide_fmu.validation.validate import validate
from tests.fmu.samples import sum_surrogate
from tests.libraries import build_libraries
from tests.progress import silent
from tests.recipes import tiny_recipe

MODEL = {"damping": 40.0, "substeps": 1}
PLAIN = tiny_recipe(system={"parameters": MODEL})
FINER = tiny_recipe(system={"parameters": MODEL, "reference": {"substeps": 24}})
TASK = Task(seed=3, trajectories=3)


@pytest.fixture(scope="module")
def surrogate() -> Surrogate:
    """The sum of eight inputs: what it says does not matter here."""
    system = recipe_system(PLAIN)
    return replace(
        sum_surrogate(8),
        name="tiny",
        window=Window(PLAIN.window.step, 8, 1),
        inputs=system.inputs,
        outputs=system.outputs,
    )


@pytest.fixture(scope="module")
def fmu(surrogate: Surrogate, tmp_path_factory: pytest.TempPathFactory) -> Path:
    build_libraries()
    return export_fmu(surrogate, tmp_path_factory.mktemp("fmu") / "tiny.fmu")


def measured(fmu: Path, surrogate: Surrogate, recipe: Recipe, **more: Any) -> Validation:
    return validate(fmu, surrogate, recipe, TASK, silent, **more)


@pytest.fixture(scope="module")
def finer(fmu: Path, surrogate: Surrogate) -> Validation:
    return measured(fmu, surrogate, FINER)


def same(one: Comparison, other: Comparison) -> bool:
    names = ("kind", "time", "inputs", "reference", "surrogate")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def test_an_fmu_is_measured_against_the_finer_model(finer: Validation) -> None:
    """All of it against a computation from the models themselves."""
    reference, model = reference_system(FINER), recipe_system(FINER)
    true, rough, scored = [], [], []
    for index, comparison in enumerate(finer.comparisons):
        stream = Stream(TEST, 3, (1.0, 1.0), 2.0)
        drawn = draw(FINER, reference, stream, index)
        assert np.array_equal(drawn.inputs, draw(FINER, model, stream, index).inputs)
        first = len(drawn.inputs) + 1 - len(comparison.time)
        true.append(simulate(reference, drawn.inputs, drawn.initial).outputs[first:])
        rough.append(simulate(model, drawn.inputs, drawn.initial).outputs[first:])
        scored.append(comparison)
        assert comparison.reference == pytest.approx(true[-1], abs=1e-12)
        assert comparison.model == pytest.approx(rough[-1], abs=1e-12)
    difference = np.concatenate(rough) - np.concatenate(true)
    relative = np.linalg.norm(difference) / np.linalg.norm(np.concatenate(true))
    (output,) = finer.figures()["outputs"]
    assert 1e-6 < relative < 0.5
    assert output["model_relative_rmse"] == pytest.approx(relative, rel=1e-9)
    error = np.concatenate([c.surrogate - c.reference for c in scored])
    assert output["rmse"] == pytest.approx(np.sqrt(np.mean(error**2)))


def test_recipe_without_a_reference_of_its_own_has_no_model_error(
    fmu: Path, surrogate: Surrogate, finer: Validation
) -> None:
    plain = measured(fmu, surrogate, PLAIN)
    assert "model_relative_rmse" not in plain.figures()["outputs"][0]
    assert all(comparison.model is None for comparison in plain.comparisons)
    for one, other in zip(plain.comparisons, finer.comparisons, strict=True):
        assert one.reference == pytest.approx(other.model, abs=1e-12)
    assert len(validation_sections({"in range": plain})[0].rows[0]) == 7


def test_fmus_of_fmi_2_and_fmi_3_give_the_same_comparison(
    surrogate: Surrogate, finer: Validation, tmp_path: Path
) -> None:
    fmu = export_fmu(surrogate, tmp_path / "tiny.fmu", fmi=3)
    three = measured(fmu, surrogate, FINER)
    for one, other in zip(three.comparisons, finer.comparisons, strict=True):
        assert same(one, other)


def test_report_and_card_show_the_error_of_the_model(finer: Validation) -> None:
    percent = f"{100 * finer.figures()['outputs'][0]['model_relative_rmse']:.3g} %"
    section = validation_sections({"in range": finer, "beyond": finer})[0]
    assert "finer model" in section.text
    assert [row[-1] for row in section.rows] == [
        "relative RMSE of the data's model",
        *[percent] * 2,
    ]
    assert len({len(row) for row in section.rows}) == 1
    assert table_of(finer, FINER)[-1].endswith(f" | {percent} |")
    assert len({row.count("|") for row in table_of(finer, FINER)}) == 1
    plain = table_of(finer, PLAIN)
    assert {row.count("|") for row in plain} == {8}


def figures_of(found: Validation) -> dict[str, Any]:
    """What a card is written from."""
    decay = {"mean": 0.1, "worst": 0.1}
    window = {"decay_time_s": decay, "measured_decay_time_s": decay}
    figures = {"validation": {"in range": found.figures()}, "window": window}
    return {**figures, "parameters": 41, "versions": {}}


def table_of(found: Validation, recipe: Recipe) -> list[str]:
    """Lines of the card's table of measured errors."""
    text = model_card(found.surrogate, recipe, figures_of(found), "picture.png")
    assert ("The reference is a finer model (substeps 24)" in text) == bool(
        recipe.system.reference
    )
    lines = text.split("## Measured error")[1].split("By excitation")[0].splitlines()
    return [line for line in lines if line.startswith("|")]


def test_card_shows_the_settings_of_every_kind(finer: Validation) -> None:
    kinds = [
        {"kind": "moving_average_random", "weight": 1.0, "coefficients": [0.1, 0.9]},
        {"kind": "speed_ramps", "weight": 1.0, "speed": 8.0, "acceleration": 20.0},
        {"kind": "point_to_point", "weight": 1.0, "speed": [1.5, 2.0]},
    ]
    recipe = tiny_recipe(data={"excitation": kinds})
    average, ramps, points = (kind.settings() for kind in recipe.data.excitation)
    assert average == {"amplitude": "1.0 .. 1.0", "coefficients": "0.1, 0.9"}
    assert ramps["speed"] == "8.0"
    assert ramps["samples"] == "20 .. 60"
    assert (points["speed"], points["acceleration"]) == ("1.5, 2.0", "none")
    assert points["random_start"] == "yes"
    text = model_card(finer.surrogate, recipe, figures_of(finer), "picture.png")
    assert "| moving_average_random | 1.0 | amplitude 1.0 .. 1.0; coefficients 0.1, 0.9 |" in text
    assert "| speed_ramps | 1.0 | speed 8.0; acceleration 20.0; samples 20 .. 60; " in text


TWO_OF_A_KIND: list[dict[str, Any]] = [
    {"kind": "held_random", "weight": 1.0, "amplitude": [0.1, 0.2]},
    {"kind": "sweep", "weight": 1.0, "angular_frequency": [1.0, 9.0]},
    {"kind": "held_random", "weight": 2.0},
]


def test_excitations_of_one_kind_have_names_of_their_own(finer: Validation) -> None:
    recipe = tiny_recipe(data={"excitation": TWO_OF_A_KIND})
    assert names_of(recipe.data.excitation) == ["held_random 1", "sweep", "held_random 3"]
    found = figures_of(finer)
    text = model_card(finer.surrogate, recipe, found, "picture.png")
    assert "| held_random 1 | 1.0 | amplitude 0.1 .. 0.2" in text
    assert "| sweep | 1.0 |" in text
    assert "| held_random 3 | 2.0 | " in text
    row = found["validation"]["in range"]["excitations"][0]
    names = names_of(recipe.data.excitation)
    rows = [{**row, "name": names[i], "relative_rmse": [(i + 1) / 100]} for i in range(3)]
    found["validation"]["in range"]["excitations"] = rows
    text = model_card(finer.surrogate, recipe, found, "picture.png")
    assert "By excitation, in range: held_random 1 1 %, sweep 2 %, held_random 3 3 %.\n" in text


def test_bars_of_excitations_of_one_kind_lie_beside_each_other(
    finer: Validation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the same name one would hide the other."""
    recipe = tiny_recipe(data={"excitation": TWO_OF_A_KIND})
    kinds = (0, 2, 2)
    comparisons = [replace(c, kind=k) for c, k in zip(finer.comparisons, kinds, strict=True)]
    drawn: list[Figure] = []
    monkeypatch.setattr(figures, "_png", drawn.append)
    figures.excitation_bars(replace(finer, recipe=recipe, comparisons=tuple(comparisons)))
    labels = [label.get_text() for label in drawn[0].axes[0].get_yticklabels()]
    assert labels == ["held_random 1 (1)", "held_random 3 (2)"]


@pytest.mark.parametrize(("error", "factor", "warned"), [(0.3, 2, 1), (0.1, 2, 0), (0.3, 1, 0)])
def test_card_warns_of_amplitudes_that_the_surrogate_does_not_know(
    finer: Validation, error: float, factor: float, warned: int
) -> None:
    found = figures_of(finer)
    main = found["validation"]["in range"]
    output = {**main["outputs"][0], "relative_rmse": error}
    beyond = {**main, "outputs": [output], "amplitude": [1.0, float(factor)]}
    found["validation"]["beyond the range"] = beyond
    text = model_card(finer.surrogate, FINER, found, "picture.png")
    sentence = "**Do not use the surrogate there:** at 1.0 to 2.0 times the amplitude its error is"
    assert text.count("Do not use") == warned
    assert text.count(f"{sentence} up to 30 % of the output's RMS.") == warned


def test_card_begins_with_the_range_whatever_the_order_of_the_figures(finer: Validation) -> None:
    """An FMU keeps its figures with sorted keys, where "beyond the range" is the first one."""
    found = figures_of(finer)
    main = found["validation"]["in range"]
    excitations = [{**row, "relative_rmse": [0.5]} for row in main["excitations"]]
    beyond = {**main, "excitations": excitations, "amplitude": [1.0, 3.0]}
    cards = []
    for order in ({"in range": main, "beyond the range": beyond}, {"beyond the range": beyond}):
        found["validation"] = {**order, "in range": main}
        cards.append(model_card(finer.surrogate, FINER, found, "picture.png"))
    assert cards[0] == cards[1]
    rows = [line for line in cards[1].splitlines() if line.startswith(("| in r", "| beyond"))]
    assert [row.split(" | ")[0] for row in rows[:2]] == [
        "| in range",
        "| beyond the range (1.0 to 3.0 times the amplitude)",
    ]
    (by_kind,) = [line for line in cards[1].splitlines() if line.startswith("By excitation")]
    assert "50 %" not in by_kind


def test_card_shows_the_system_under_its_name_if_there_is_a_picture(finer: Validation) -> None:
    plain = model_card(finer.surrogate, PLAIN, figures_of(finer), "picture.png")
    drawn = model_card(finer.surrogate, PLAIN, figures_of(finer), "picture.png", "mechanism.png")
    shown = "![tiny: the system in motion](mechanism.png)\n\n"
    assert drawn.count(shown) == 1
    assert drawn.replace(shown, "") == plain
    assert drawn.index("# tiny.fmu") < drawn.index(shown) < drawn.index("| variable |")


def test_validation_by_several_processes_measures_the_same(
    fmu: Path, surrogate: Surrogate, finer: Validation, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(validation, "WORTH_PROCESSES", 0.0)
    calls: list[tuple[int, int]] = []
    found = validate(
        fmu, surrogate, FINER, TASK, lambda *numbers: calls.append(numbers), workers=2
    )
    assert calls == [(done, 3) for done in range(4)]
    assert len(found.comparisons) == 3
    for one, other in zip(found.comparisons, finer.comparisons, strict=True):
        assert same(one, other)
        assert np.array_equal(one.model, other.model)


def test_validation_with_little_work_starts_no_processes(
    fmu: Path, surrogate: Surrogate, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(validation, "process_pool", None)
    assert len(measured(fmu, surrogate, PLAIN, workers=None).comparisons) == 3


def test_exported_reference_is_the_one_that_is_measured_against(tmp_path: Path) -> None:
    from slide_fmu.cosim.run import run_fmu, unpacked

    path = write_reference(FINER, tmp_path / "reference.fmu")
    system = reference_system(FINER)
    force = np.random.default_rng(0).uniform(-1000, 1000, 40)
    expected = simulate(system, force[:, None], system.rest_state(force[:1])).outputs
    with unpacked(path) as files:
        names = [system.inputs[0].name], [system.outputs[0].name]
        found = run_fmu(files, {names[0][0]: force}, names[1])
    assert found.values == pytest.approx(expected, abs=1e-12)


def reference_refused(**system: Any) -> str:
    """What is said about a reference, before data and before a validation."""
    recipe = tiny_recipe(system=system)
    with pytest.raises(RecipeError) as caught:
        reference_system(recipe)
    for other in (check_recipe, lambda recipe: write_reference(recipe, Path("never.fmu"))):
        with pytest.raises(RecipeError, match=re.escape(str(caught.value))):
            other(recipe)
    return str(caught.value)


def test_reference_with_other_signals_is_refused() -> None:
    said = reference_refused(reference={"force_limit": 1.0})
    assert "recipe 'tiny': system.reference = {'force_limit': 1.0} changes the inputs to [" in said
    assert "expected, as with system.parameters, [('force', 'N', -2000.0, 2000.0)]: " in said
    said = reference_refused(reference={"position_limit": 9.0})
    assert "changes the outputs to [('position', 'm', -9.0, 9.0)]; expected, as with" in said
    with pytest.raises(LoadError, match=r"unknown parameters \['substep'\]"):
        reference_system(tiny_recipe(system={"reference": {"substep": 3}}))


def test_reference_with_another_tool_is_refused() -> None:
    """Its outputs have the same names, units and ranges, but they are about another point."""
    move = {"kind": "point_to_point", "weight": 1.0}
    model = {"model": "mbs_models.robot_6r:Robot6R", "parameters": {"tool_length": 0.1}}
    data = {"excitation": [move]}
    robot = tiny_recipe(system=model, data=data)
    robot.system.parameters.pop("damping")
    robot.system.reference["authors_gains"] = True
    assert reference_system(robot).chain is not None
    robot.system.reference["tool_length"] = 0.2
    with pytest.raises(RecipeError, match=r"changes the geometry of the serial chain to .*0\.2\]"):
        reference_system(robot)


@pytest.mark.parametrize("table", ["parameters", "reference"])
def test_recipe_with_a_step_of_its_own_for_the_system_is_refused(table: str) -> None:
    said = reference_refused(**{table: {"step": 1.0}})
    assert said == (
        f"recipe 'tiny': system.{table}.step = 1.0; expected no step there: samples are "
        "window.step = 0.015625 s apart; remove it"
    )


def test_validation_of_few_trajectories_needs_no_second_one(
    fmu: Path, surrogate: Surrogate
) -> None:
    task = replace(TASK, trajectories=1)
    found = validate(fmu, surrogate, FINER, task, silent, workers=None)
    assert len(found.comparisons) == 1


def test_task_without_numbers_takes_those_of_the_recipe(fmu: Path, surrogate: Surrogate) -> None:
    recipe = tiny_recipe(
        system={"parameters": MODEL}, validation={"trajectories": 2, "duration": 1.5}
    )
    found = validate(fmu, surrogate, recipe, Task(seed=3), silent)
    assert [comparison.time[-1] for comparison in found.comparisons] == [1.75, 1.75]  # burn-in too
    given = validate(fmu, surrogate, recipe, Task(3, trajectories=1, duration=1.25), silent)
    assert [comparison.time[-1] for comparison in given.comparisons] == [1.5]
    plain = tiny_recipe(system={"parameters": MODEL}, validation={"trajectories": 1})
    (alone,) = validate(fmu, surrogate, plain, Task(seed=3), silent).comparisons
    assert alone.time[-1] == 0.25 + plain.data.duration


def test_progress_of_a_validation_counts_every_trajectory(fmu: Path, surrogate: Surrogate) -> None:
    calls: list[tuple[int, int]] = []
    found = validate(fmu, surrogate, PLAIN, TASK, lambda *numbers: calls.append(numbers))
    assert calls == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert len({comparison.reference.tobytes() for comparison in found.comparisons}) == 3


@pytest.mark.parametrize(("missing", "fits"), [(0.4, True), (0.6, False)])
def test_duration_may_be_short_of_the_least_by_less_than_half_a_step(
    fmu: Path, surrogate: Surrogate, missing: float, fits: bool
) -> None:
    step = PLAIN.window.step
    task = Task(3, trajectories=1, duration=PLAIN.shortest_validation() - missing * step)
    if fits:
        assert len(validate(fmu, surrogate, PLAIN, task, silent).comparisons) == 1
    else:
        with pytest.raises(
            ValueError, match=r"expected at least 0\.5 s, so that the FMU's windows"
        ):
            validate(fmu, surrogate, PLAIN, task, silent)


@pytest.mark.parametrize(
    ("workers", "cores", "expected"),
    [(7, 1, 2), (None, 2, 2), (None, 8, 2), (None, None, 1), (1, 8, 1), (2, 1, 2)],
)
def test_worker_processes_are_at_most_the_trajectories_after_the_first(
    fmu: Path,
    surrogate: Surrogate,
    monkeypatch: pytest.MonkeyPatch,
    workers: int | None,
    cores: int | None,
    expected: int,
) -> None:
    """Of three trajectories the first one is measured before; one worker is this process."""
    started: list[int] = []

    monkeypatch.setattr(validation, "WORTH_PROCESSES", 0.0)
    monkeypatch.setattr(validation.os, "cpu_count", lambda: cores)
    monkeypatch.setattr(validation, "process_pool", lambda n, *_: nullcontext(started.append(n)))
    monkeypatch.setattr(validation, "in_parallel", lambda *work: [])
    measured(fmu, surrogate, PLAIN, workers=workers)
    assert started == ([] if expected == 1 else [expected])


@pytest.mark.parametrize(("seconds", "starts"), [(4.9, 0), (5.1, 1)])
def test_worker_processes_start_where_the_rest_of_the_work_is_long(
    fmu: Path,
    surrogate: Surrogate,
    monkeypatch: pytest.MonkeyPatch,
    seconds: float,
    starts: int,
) -> None:
    """Two trajectories of so many seconds each are left, and ten seconds are worth processes."""
    started: list[int] = []
    clock = iter([100.0, 100.0 + seconds])
    monkeypatch.setattr(validation, "WORTH_PROCESSES", 10.0)
    monkeypatch.setattr(validation, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    monkeypatch.setattr(validation, "process_pool", lambda *_: nullcontext())
    monkeypatch.setattr(
        validation, "in_parallel", lambda *work: started.append(len(work[2])) or []
    )
    found = measured(fmu, surrogate, PLAIN, workers=2)
    assert started == [2] * starts
    assert len(found.comparisons) == (1 if starts else 3)
