"""What is printed of the plain call is what ``fmpy.simulate_fmu`` gives its user."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy.signal import lfilter

from slide_fmu.bounds.input_forecast import fit_forecast
from slide_fmu.core.measures import percent
from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.core.window import Window
from slide_fmu.excitation.mix import Excitation
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fmu.export import export_fmu, read_fmu
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.pipeline.measurement import IN_RANGE
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.importer_sections import plain_call_sections
from slide_fmu.report.model_card import model_card
from slide_fmu.report.run_figures import released_figures
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation import plain_call
from slide_fmu.validation.error_figures import PlainCallFigures
from slide_fmu.validation.plain_call import (
    TRAJECTORIES,
    band_of,
    cost_of_holding,
    plain_call_figures,
    smooth_inputs,
)
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import Task
from slide_fmu.validation.validate import validate
from tests.fmu.samples import sum_surrogate
from tests.libraries import build_libraries
from tests.progress import silent
from tests.recipes import TINY, merged, whole_recipe
from tests.validation.tiny_validation import figures_of

STEP, LAG, WINDOW = 0.0625, 0.25, 80
FEW = 3
MODEL = f"""
inputs = {{"drive": {{"unit": "N", "range": [-3.0, 5.0]}}}}
outputs = {{"level": {{"unit": "m", "range": [-5.0, 5.0]}}}}
start = [0.0]

def f(x, u, p):
    return [(u[0] - x[0]) / {LAG}]

def g(x, u, p):
    return [x[0]]
"""
Case = tuple[Path, Validation, PlainCallFigures]


def lag_recipe(folder: Path, hold: Hold) -> Recipe:
    """A lag of first order, as a function."""
    (folder / "lag.py").write_text(MODEL, encoding="utf-8")
    tables = tomllib.loads(TINY)
    tables["system"] = {
        "model": str(folder / "lag.py"),
        "kind": "function",
        "inputs": {"drive": {"hold": hold}},
    }
    window = {"step": STEP, "n_in": WINDOW, "n_out": 1}
    data = {"duration": 20.0, "burn_in": 5.0}
    return whole_recipe(merged(tables, {"window": window, "data": data}))


def lag_surrogate(recipe: Recipe, hold: Hold) -> Surrogate:
    """The exact answer to inputs that are held, or move along lines, over a window of 20 lags."""
    system, ratio = case_of(recipe).reference, STEP / LAG
    pole = np.exp(-ratio)
    now, before = 1 - (1 - pole) / ratio, (1 - pole) / ratio - pole
    weights = pole ** np.arange(WINDOW)
    weights = (1 - pole) * weights
    if hold == "first_order":
        weights = now * pole ** np.arange(WINDOW)
        weights[1:] += before * pole ** np.arange(WINDOW - 1)
    layer = Layer(weights[None, ::-1].astype(np.float32), np.zeros(1, np.float32), "identity")
    unit = Affine.of_channels([0.0], [1.0])
    rng = np.random.default_rng(0)
    frequencies, phases = rng.uniform(0.02, 0.4, (2, 12, 4, 1))
    drawn = np.sin(frequencies * np.arange(600) + 10 * phases).sum(axis=1)[:, :, None]
    return replace(
        sum_surrogate(WINDOW, hold),
        name="tiny",
        window=Window(STEP, WINDOW, 1),
        inputs=system.inputs,
        outputs=system.outputs,
        input_scaling=Affine.of_channels([1.0], [4.0]),
        output_scaling=unit,
        network=FeedForward((scaled(layer),), WINDOW, FeatureMap(Differences(1))),
        forecast=fit_forecast(system.inputs, drawn, planned=False),
    )


def scaled(layer: Layer) -> Layer:
    """The same of inputs that are scaled by the middle 1 N and the half range 4 N."""
    total = np.array([layer.weights.sum()], np.float32)
    return Layer(4 * layer.weights, total, "identity")


@pytest.fixture(scope="module")
def few_smooth() -> Iterator[None]:
    """Few trajectories of smooth inputs, which take most of the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plain_call, "TRAJECTORIES", FEW)
        yield


@pytest.fixture(scope="module", params=["zero_order", "first_order"])
def case(
    few_smooth: None, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Case:
    build_libraries()
    folder = tmp_path_factory.mktemp("plain")
    recipe = lag_recipe(folder, request.param)
    fmu = export_fmu(lag_surrogate(recipe, request.param), folder / "tiny.fmu")
    surrogate, _ = read_fmu(fmu)
    validation = validate(fmu, surrogate, case_of(recipe), Task(3, trajectories=2), silent)
    found = plain_call_figures(fmu, validation, case_of(validation.recipe))
    assert found is not None
    return fmu, validation, found


def user_call(fmu: Path, surrogate: Surrogate, times: FloatArray, rows: FloatArray) -> FloatArray:
    """``fmpy.simulate_fmu(fmu, input=table)``, as it stands in any script: (N + 1, n_outputs)."""
    names, step = [signal.name for signal in surrogate.inputs], surrogate.window.step
    table = np.zeros(len(times), dtype=[("time", float), *((name, float) for name in names)])
    table["time"] = times
    for index, name in enumerate(names):
        table[name] = rows[:, index]
    outputs = [signal.name for signal in surrogate.outputs]
    stop = step * round(times[-1] / step)
    found = fmpy.simulate_fmu(
        str(fmu), stop_time=stop, output_interval=step, input=table, output=outputs
    )
    return np.stack([found[name] for name in outputs], axis=1)


def relative(errors: list[FloatArray], truths: list[FloatArray]) -> FloatArray:
    error, truth = np.concatenate(errors), np.concatenate(truths)
    return np.asarray(np.sqrt(np.mean(error**2, axis=0)) / truth.std(axis=0))


@pytest.mark.extended
def test_printed_figure_of_smooth_inputs_is_what_a_user_gets(case: Case) -> None:
    """The truth is that of the lag under the sines themselves, by a filter of 32 parts a step."""
    fmu, validation, found = case
    surrogate, hz = validation.surrogate, band_of(validation.recipe)
    errors, truths = [], []
    for index in range(FEW):
        fine = STEP / 32 * np.arange(32 * 900 + 1)
        drive = smooth_inputs(surrogate.inputs, fine, hz, index)
        pole = np.exp(-STEP / 32 / LAG)
        level = lfilter([(1 - pole) / 2, (1 - pole) / 2], [1, -pole], drive[:, 0])[::32, None]
        got = user_call(fmu, surrogate, fine[::32], drive[::32])
        errors.append((got - level)[WINDOW:])
        truths.append(level[WINDOW:])
    (output,) = found.outputs
    key = "smooth_if_held" if found.hold == "zero_order" else "smooth"
    assert float(relative(errors, truths)[0]) == pytest.approx(getattr(output, key), rel=0.2)


@pytest.mark.extended
def test_held_inputs_are_late_and_moving_ones_are_not(case: Case) -> None:
    _, _, found = case
    (output,) = found.outputs
    if found.hold == "zero_order":
        assert found.late_s == STEP / 2
        assert output.smooth is output.known_to_step_end is None
        assert output.rough < 1e-5  # the surrogate is exact for inputs that are held
        assert 0.02 < output.smooth_if_held < 0.2
        late = f"{100 * output.smooth_if_held:.3g} %"
        assert found.sentence == f"a smooth input is late by 0.03125 s: {late} at 0.032 to 1 Hz"
    else:
        assert found.late_s is output.smooth_if_held is None
        assert output.known_to_step_end < 1e-5 < output.smooth < 0.02
        assert output.smooth < output.smooth_worst < 0.05
        assert output.rough > output.smooth


@pytest.mark.extended
def test_cost_of_holding_is_known_before_anything_is_trained(case: Case) -> None:
    """The exact surrogate errs by the same in its FMU's plain call."""
    _, validation, found = case
    cost = cost_of_holding(case_of(validation.recipe))
    if found.hold == "first_order":
        assert cost is None
        return
    assert cost is not None
    late = re.search(r"late by 0.03125 s: ([\d.]+) %", cost)
    assert late is not None
    assert float(late[1]) == pytest.approx(100 * found.outputs[0].smooth_if_held, rel=0.3)


@pytest.mark.extended
def test_figures_come_first_in_report_and_card(case: Case) -> None:
    _, validation, found = case
    (section,) = plain_call_sections(found)
    assert section.title == "Plain call"
    figures = figures_of(validation, plain_call=found)
    card = model_card(validation.surrogate, validation.recipe, figures, "picture.png")
    error = card.split("## Measured error")[1]
    key = "smooth_if_held" if found.late_s else "smooth"
    assert (
        f"{100 * getattr(found.outputs[0], key):.3g} %"
        in error.split("Compared with the reference system")[0]
    )
    without = figures_of(validation)
    assert "simulate_fmu(fmu, input=table)" not in model_card(
        validation.surrogate, validation.recipe, without, "picture.png"
    )


def test_smooth_inputs_are_no_faster_than_wide_motions_of_the_training(case: Case) -> None:
    """A kind that is fast, but small, says nothing about sines through a third of the range."""
    recipe = case[1].recipe
    tables = [
        {"kind": "multisine", "weight": 1.0, "amplitude": [0.1, 0.5],
         "angular_frequency": [0.1, 2.0]},
        {"kind": "multisine", "weight": 1.0, "amplitude": [0.01, 0.1],
         "angular_frequency": [2.0, 60.0]},
    ]  # fmt: skip
    kinds = TypeAdapter(tuple[Excitation, ...]).validate_python(tables)
    assert band_of(recipe.with_kinds(kinds))[1] == pytest.approx(2.0 / (2 * np.pi))
    assert band_of(recipe.with_kinds(kinds[1:]))[1] == pytest.approx(1 / (16 * STEP))


def test_an_input_that_moves_alone_moves_no_faster_than_the_other_kinds(case: Case) -> None:
    recipe = case[1].recipe
    tables = [
        {"kind": "multisine", "weight": 1.0, "amplitude": [0.01, 0.1],
         "angular_frequency": [0.1, 2.0]},
        {"kind": "alone", "weight": 1.0},
    ]  # fmt: skip
    kinds = TypeAdapter(tuple[Excitation, ...]).validate_python(tables)
    assert band_of(recipe.with_kinds(kinds))[1] == pytest.approx(2.0 / (2 * np.pi))


def test_reference_without_a_finer_step_leaves_smooth_inputs_unmeasured(
    case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    fmu, validation, measured = case
    coarse = case_of(validation.recipe).reference
    monkeypatch.setattr("slide_fmu.recipe.case.load_system", lambda _: coarse)
    found = plain_call_figures(fmu, validation, case_of(validation.recipe))
    assert found is not None
    assert found.sentence.startswith("smooth inputs were not measured: system")
    (output,) = found.outputs
    assert output.smooth is output.smooth_if_held is found.smooth_hz is None
    assert output.rough == measured.outputs[0].rough


def test_inputs_without_smooth_ones_have_a_sentence_of_the_kinds_of_the_training(
    case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Angles and planned motions, held or moving."""
    fmu, validation, _ = case
    monkeypatch.setattr(Surrogate, "planned", True)
    found = plain_call_figures(fmu, validation, case_of(validation.recipe))
    assert found is not None
    assert found.smooth_hz is None
    rough = percent(found.outputs[0].rough)
    assert found.sentence.startswith(f"the plain call has errors of up to {rough}")


def test_model_that_names_its_step_runs_as_its_importer_would(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its moving inputs are held over its own step."""
    recipe = lag_recipe(tmp_path, "first_order")
    monkeypatch.setattr(System, "own_step", STEP / 4)
    assert case_of(recipe).reference.inputs[0].hold == "first_order"
    system = case_of(recipe).reference_as_it_runs()
    assert system.inputs[0].hold == "zero_order"
    assert system.step == STEP / 4


def test_model_that_holds_its_inputs_over_the_step_makes_nothing_late(
    case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside itself it would cost 0 %, and what the FMU errs by is no delay."""
    fmu, validation, before = case
    monkeypatch.setattr(System, "own_step", STEP)
    assert cost_of_holding(case_of(validation.recipe)) is None
    found = plain_call_figures(fmu, validation, case_of(validation.recipe))
    assert found is not None
    (output,) = found.outputs
    assert found.late_s is output.smooth_if_held is None
    assert found.sentence.startswith("the plain call has errors of up to")
    if before.hold == "zero_order":
        assert output.known_to_step_end is None
        assert output.smooth < 1e-5  # the surrogate is exact for inputs that are held


@pytest.mark.extended
@pytest.mark.parametrize(("name", "trajectories"), [("duffing", 100), ("slider_crank", 20)])
def test_released_fmus_err_by_what_is_printed(name: str, trajectories: int) -> None:
    """Smooth forces that are held for a step; planned motions of the recipe's own kinds.

    Kinds differ in their errors, so few trajectories would say little.
    """
    fmu = Path(__file__).parents[2] / "fmus" / name / f"{name}.fmu"
    surrogate, provenance = read_fmu(fmu)
    recipe = recipe_of_provenance(provenance, str(fmu))
    measured = released_figures(provenance)
    assert measured is not None
    printed = measured.plain_call
    assert printed is not None
    assert IN_RANGE in measured.validation
    validation = validate(
        fmu, surrogate, case_of(recipe), Task(77, trajectories=trajectories), silent
    )
    errors, truths = [], []
    for c in validation.comparisons:
        errors.append((c.surrogate if c.plain is None else c.plain) - c.reference)
        truths.append(c.reference)
    rough = [output.rough for output in printed.outputs]
    assert relative(errors, truths) == pytest.approx(rough, rel=0.2)
    if printed.smooth_hz:
        smooth = [output.smooth_if_held for output in printed.outputs]
        assert under_smooth_forces(fmu, surrogate, recipe) == pytest.approx(smooth, rel=0.2)


def under_smooth_forces(fmu: Path, surrogate: Surrogate, recipe: Recipe) -> FloatArray:
    """By ``fmpy.simulate_fmu``, and the model at a step 16 times finer."""
    step, hz = recipe.window.step, band_of(recipe)
    made = case_of(recipe).systems.reference_specification
    system = load_system(replace(made, step=step / 16))
    errors, truths = [], []
    for index in range(TRAJECTORIES):
        times = step * np.arange(1200)
        rows = smooth_inputs(surrogate.inputs, times, hz, index)
        middles = step / 16 * (np.arange(16.0 * 1199) + 0.5)
        fine = smooth_inputs(surrogate.inputs, middles, hz, index)
        truth = simulate(system, fine).outputs[::16][400:]
        truths.append(truth)
        errors.append(user_call(fmu, surrogate, times, rows)[400:] - truth)
    return relative(errors, truths)
