"""Outputs at given times from inputs at these times, on FMUs whose answers are known."""

from __future__ import annotations

import copy
import dataclasses
from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.cosim.between import even_out, refine
from slide_fmu.fmu.export import export_fmu
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import n_phases
from tests.fmu.moving_inputs import MovingOracle, forecasting, moving_inputs
from tests.fmu.plain import ResamplingOracle
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate, sum_surrogate
from tests.libraries import build_libraries
from tests.refusals import refused

TOLERANCE = 4e-5
"""Of single precision, for outputs of a few units."""

BETWEEN = 2e-4
"""Of outputs between phases, which are interpolated, where inputs are rough."""

SHAPES = {
    "layers": Shape(n_inputs=2, n_outputs=2),
    "cell": Shape(n_inputs=2, n_outputs=2, cell=CellShape(contraction=0.3)),
    "director": Shape(n_inputs=2, n_outputs=2, features="director"),
}


@pytest.fixture(scope="module", autouse=True)
def _binaries() -> None:
    build_libraries()


def exported(surrogate: Surrogate, folder: Path, fmi: int = 2) -> Path:
    return export_fmu(surrogate, folder / "one.fmu", fmi=3 if fmi == 3 else 2)


def taken(window: ResamplingOracle, length: float, row: FloatArray) -> ResamplingOracle:
    """A window after a step to a row of the inputs."""
    if isinstance(window, MovingOracle):
        return window.step(length, row)
    window.append(length, row)
    return window


def plain_outputs(surrogate: Surrogate, t: FloatArray, u: FloatArray) -> FloatArray:
    """Before the first time, inputs were what they are there.

    Outputs follow the inputs; the window keeps those that make up for its straight lines, if its
    inputs are no planned motions. Both have their oracles in tests/cosim/test_between.py.
    """
    cosines = (0,) if surrogate.inputs[0].angle == "cosine" else ()
    t, u, places = refine(t, u, cosines, STEP)
    kept = u if surrogate.planned else even_out(t, u, cosines, STEP)
    always = ResamplingOracle(surrogate)
    always.append(STEP, u[0])
    found, lengths = [always.results()[0]], np.diff(t)
    # where steps of one length make up a sample, no curve is needed between the times
    parts = STEP / lengths
    on_lines = bool(np.ptp(parts) < 1e-6 and abs(parts[0] - np.rint(parts[0])) < 1e-6)
    window = always if on_lines else MovingOracle(surrogate, known=True, before=u[0])
    for length, row, own in zip(lengths, u[1:], kept[1:], strict=True):
        found.append(taken(copy.deepcopy(window), length, row).results()[0])
        taken(window, length, own)
    return np.array(found)[places]


@pytest.mark.extended
@pytest.mark.parametrize(("fmi", "forecasts"), [(2, None), (2, False), (3, False), (2, True)])
@pytest.mark.parametrize("steps", [[1.0], [0.5], [1.3], [2.0], [0.3, 2.1, 1.0]])
@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_moving_inputs_give_outputs_at_the_times_whatever_their_distances(
    tmp_path: Path, shape: Shape, steps: list[float], forecasts: bool | None, fmi: int
) -> None:
    """Whatever the FMU takes inputs for by default."""
    surrogate = random_surrogate(dataclasses.replace(shape, hold="first_order"))
    if forecasts is not None:
        surrogate = forecasting(surrogate, planned=forecasts)
    t = 3.0 + STEP * np.concatenate([[0.0], np.cumsum((steps * 30)[:30])])
    u = moving_inputs(surrogate, 31)
    found = slide.simulate(exported(surrogate, tmp_path, fmi), t, u)
    lengths = np.diff(refine(t, u, (), STEP)[0]) / STEP
    between = shape.cell is not None and any(n_phases(length) == 0 for length in lengths)
    allowed = BETWEEN if between else TOLERANCE
    np.testing.assert_allclose(found, plain_outputs(surrogate, t, u), rtol=0, atol=allowed)


def test_held_inputs_on_the_fmus_own_grid_are_those_of_a_record(tmp_path: Path) -> None:
    surrogate = random_surrogate(SHAPES["cell"])
    u, t = moving_inputs(surrogate, 40), STEP * np.arange(41)
    found = slide.simulate(exported(surrogate, tmp_path), t, np.vstack([u, u[:1]]))
    expected = surrogate.predict_newest(u)
    np.testing.assert_allclose(found[1:], expected, rtol=0, atol=TOLERANCE)
    np.testing.assert_allclose(found[0], expected[0], rtol=0, atol=TOLERANCE)


def test_held_inputs_between_the_fmus_steps_count_by_their_means(tmp_path: Path) -> None:
    """The sum of the window, on half steps and on irregular times: outputs lie on lines."""
    fmu = exported(sum_surrogate(2), tmp_path)
    halves = np.arange(7) * STEP / 2
    u = np.array([0.0, 1.0, 1.0, 0.0, 0.5, 0.5, 0.0])
    # means of the steps: 0.5, 0.5, 0.5; the first one also counts as before
    np.testing.assert_allclose(slide.simulate(fmu, halves, u)[:, 0], [1, 1, 1, 1, 1, 1, 1])
    times = STEP * np.array([0.0, 0.25, 1.0, 2.75, 3.5])
    u = np.array([1.0, 0.0, 1.0, -1.0, 0.0])
    means = np.array([0.25, 1.0, 0.75 - 0.25, -0.5])
    at_own = np.concatenate([[2 * means[0]], means + np.concatenate([means[:1], means[:-1]])])
    # before the start the input was that of the first time, 1
    found = slide.simulate(fmu, times, u)[:, 0]
    np.testing.assert_allclose(found, np.interp(times / STEP, range(5), at_own), atol=1e-6)


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_one_time_alone_gives_the_response_to_inputs_that_were_always_so(
    tmp_path: Path, hold: Hold
) -> None:
    fmu = exported(sum_surrogate(4, hold), tmp_path)
    assert slide.simulate(fmu, np.array([2.0]), np.array([0.5])).tolist() == [[2.0]]


@pytest.mark.parametrize(
    ("t", "u", "said"),
    [
        (np.zeros((2, 1)), np.zeros(2), r"t of shape \(2, 1\); expected \(N,\)"),
        (np.zeros(0), np.zeros(0), r"at least one time"),
        (np.arange(3.0), np.zeros((2, 1)), r"u of shape \(2, 1\); expected \(3, 1\).*\['u'\]"),
        (np.arange(3.0), np.zeros((3, 2)), r"u of shape \(3, 2\); expected \(3, 1\)"),
        (np.arange(3.0), np.array([0, np.nan, 0]), r"u\[1\] = \[nan\]; expected finite"),
        (np.array([0, np.inf]), np.zeros(2), r"t\[1\] = inf; expected finite"),
        (np.array([0.0, 1.0, 1.0]), np.zeros(3), r"t\[1\] = 1 s, t\[2\] = 1 s; expected times"),
    ],
)
def test_what_is_no_record_is_refused(
    tmp_path: Path, t: FloatArray, u: FloatArray, said: str
) -> None:
    with pytest.raises(ValueError, match=said):
        slide.simulate(exported(sum_surrogate(), tmp_path), t, u)


def test_fmus_of_others_are_refused(tmp_path: Path) -> None:
    import zipfile

    fmu, other = exported(sum_surrogate(), tmp_path), tmp_path / "other.fmu"
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(other, "w") as target:
        for name in source.namelist():
            if not name.startswith("resources/"):
                target.writestr(name, source.read(name))
    with refused(slide.CoSimulationError, "other.fmu has no", "expected an FMU of"):
        slide.simulate(other, np.arange(2.0), np.zeros(2))


def test_long_gap_that_is_a_multiple_but_for_rounding_is_one(tmp_path: Path) -> None:
    """The FMU allows a rounding relative to the gap, so its own steps are not taken instead."""
    fmu = exported(sum_surrogate(2), tmp_path)
    u = np.array([1.0, 0.0, 0.0])
    exact = slide.simulate(fmu, STEP * np.array([0.0, 2000.0, 2001.0]), u)
    rounded = slide.simulate(fmu, STEP * np.array([0.0, 2000.0001, 2001.0001]), u)
    np.testing.assert_array_equal(rounded, exact)
