"""A mass and a spring, as slaves that users write: an oscillator of 10 rad/s, known exactly."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.couple.result import CoupledRun
from slide_fmu.core.files import write_zip
from slide_fmu.importer.errors import CoSimulationError
from tests.acceptance.conftest import invoke
from tests.python_fmus import write_python_fmu
from tests.refusals import refused

OWN_MODELS = Path(__file__).parents[2] / "own_models"
LINKS = [("mass.x", "spring.x"), ("spring.force", "mass.force")]
START, RATE = 0.01, 10.0


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return written(tmp_path_factory.mktemp("parts"))


def written(folder: Path, any_step: bool = True, rollback: bool = True) -> dict[str, Path]:
    """Write both slaves; without ``any_step``, the spring takes steps of 5 ms alone.

    Without ``rollback``, none goes back to a former state.
    """

    def slave(name: str, any_step: bool) -> Path:
        options = {
            "canGetAndSetFMUstate": str(rollback).lower(),
            "canHandleVariableCommunicationStepSize": str(any_step).lower(),
        }
        script = OWN_MODELS / f"{name}_slave.py"
        return write_python_fmu(name.title(), script, folder / f"{name}.fmu", **options)

    return {"mass": slave("mass", any_step=True), "spring": slave("spring", any_step)}


def run(
    parts: dict[str, Path], step: float = 0.02, stop: float = 4.0, **options: Any
) -> CoupledRun:
    found: CoupledRun = slide.couple(
        parts, options.pop("links", LINKS), step=step, stop=stop, **options
    )
    return found


def error(found: CoupledRun, middle: float = 0.0) -> float:
    """The largest error of the place, as a part of the amplitude."""
    exact = START * np.cos(RATE * found.time)
    return float(np.max(np.abs(found["mass.x"] - middle - exact)) / START)


def energy(found: CoupledRun) -> float:
    """The energy at the end over the one at the start."""
    both = 0.5 * found["mass.v"] ** 2 + 50 * found["mass.x"] ** 2
    return float(both[-1] / both[0])


@pytest.mark.parametrize("late", [0.0, 1.0], ids=["at once", "in each step"])
@pytest.mark.parametrize("method", ["newton", "fixed_point"])
def test_implicit_steps_neither_add_energy_nor_take_it(
    parts: dict[str, Path], method: str, late: float
) -> None:
    long, short = (
        run(parts, step, method=method, parameters={"spring.late": late}) for step in (0.02, 0.01)
    )
    assert energy(long) == pytest.approx(1, abs=1e-4)
    assert error(long) / error(short) == pytest.approx(4, rel=0.1)


def test_recorded_values_belong_to_one_time(parts: dict[str, Path]) -> None:
    found = run(parts)
    force = -100 * found["mass.x"]
    assert found["spring.force"] == pytest.approx(force, abs=1e-9)


@pytest.mark.parametrize("late", [0.0, 1.0], ids=["at once", "in each step"])
@pytest.mark.parametrize("links", [LINKS, LINKS[1:]], ids=["loop", "chain"])
def test_given_input_that_passes_through_acts_in_time(
    parts: dict[str, Path], links: list[tuple[str, str]], late: float
) -> None:
    weak = {"spring.stiffness": 1e-9, "spring.late": late, "mass.start": 0.0}
    given: dict[str, Any] = {"inputs": {"spring.push": lambda t: t}, "parameters": weak}
    found = run(parts, 0.1, 1.0, links=links, **given)
    first = 0.01 if late and links is LINKS[1:] else 0.0
    assert found["mass.v"][-1] == pytest.approx(0.5 - first, abs=1e-6)


def test_tolerance_is_a_part_of_the_motion(parts: dict[str, Path]) -> None:
    far = {"mass.start": 1000.01, "spring.middle": 1000.0}
    found = run(parts, 0.01, parameters=far)
    assert error(found, 1000.0) == pytest.approx(error(run(parts, 0.01)), rel=0.1)
    with refused(ValueError, "tolerance = 0.5", "at most 0.01"):
        run(parts, tolerance=0.5)


@pytest.mark.parametrize("control", ["predictor", "halving"])
def test_controlled_steps_are_right_from_the_first_one_on(
    parts: dict[str, Path], control: str
) -> None:
    found = run(parts, 0.3, 3.0, control=control)
    assert found.time[1] < 0.05
    assert error(found) < 0.2
    assert found.figures.steps < 1000


def test_fmu_with_steps_of_one_length_is_given_no_shorter_ones(tmp_path: Path) -> None:
    fixed = written(tmp_path, any_step=False)
    found = run(fixed, 0.02, control="halving")
    assert found.figures.shortest_step_s == pytest.approx(0.01)  # taken as two halves
    assert error(found) < error(run(fixed))
    with refused(CoSimulationError, "its error is", "with 0.01 s", "allow more"):
        run(fixed, 0.02, control="halving", error=1e-9)
    with refused(ValueError, "only multiples of 0.005 s"):
        run(fixed, 0.015, stop=3.0, control="halving")


EXPLICIT = pytest.mark.parametrize("method", ["jacobi", "gauss_seidel"])


@EXPLICIT
@pytest.mark.parametrize("order", [("mass", "spring"), ("spring", "mass")], ids=" first, ".join)
@pytest.mark.parametrize("late", [0.0, 1.0], ids=["at once", "in each step"])
def test_explicit_steps_are_of_second_order(
    parts: dict[str, Path], method: str, order: tuple[str, str], late: float
) -> None:
    sorted_parts = {name: parts[name] for name in order}
    long, short = (
        error(run(sorted_parts, step, 2.0, method=method, parameters={"spring.late": late}))
        for step in (0.01, 0.005)
    )
    assert long < 0.15
    assert long / short == pytest.approx(4, rel=0.2)


@pytest.mark.parametrize("late", [0.0, 1.0], ids=["at once", "in each step"])
@pytest.mark.parametrize("method", ["newton", "gauss_seidel"])
def test_outputs_of_fmus_that_cannot_go_back_are_of_the_right_time(
    parts: dict[str, Path], tmp_path: Path, method: str, late: float
) -> None:
    once = written(tmp_path, rollback=False)
    for mixed in ({**parts, "spring": once["spring"]}, once):
        found = run(mixed, 0.01, method=method, parameters={"spring.late": late})
        assert error(found) < (0.05 if method == "newton" else 0.3)


@EXPLICIT
@pytest.mark.parametrize("extrapolation", ["linear", "zero"])
def test_explicit_steps_that_are_wrong_by_much_say_so(
    parts: dict[str, Path], method: str, extrapolation: str
) -> None:
    long, short = (
        run(parts, step, method=method, extrapolation=extrapolation) for step in (0.02, 0.005)
    )
    assert error(long) > 0.2  # its energy grows
    (remark,) = [one for one in long.figures.remarks if "assumed" in one]
    assert re.search(r"differ from those that came out, by up to \d+(\.\d+)? % of its", remark)
    assert "take shorter steps or an implicit method" in remark
    told = any("assumed" in one for one in short.figures.remarks)
    assert told == (error(short) > 0.05)


@EXPLICIT
def test_rest_and_jumps_are_no_misses(parts: dict[str, Path], method: str) -> None:
    rest = {"mass.start": 0.1 + 0.2, "spring.middle": 0.3}  # apart by rounding
    still = run(parts, 0.005, method=method, parameters=rest)
    assert not any("assumed" in one for one in still.figures.remarks)
    push = ([0.0, 1.0, 1.0 + 1e-9, 4.0], [0.0, 0.0, 0.5, 0.5])
    calm = {"mass.start": 0.0, "mass.mass": 1e3}
    pushed = run(parts, 0.005, method=method, parameters=calm, inputs={"spring.push": push})
    assert not any("assumed" in one for one in pushed.figures.remarks)


def test_explicit_steps_that_explode_are_no_warnings_of_numpy(parts: dict[str, Path]) -> None:
    light = {"mass.mass": 1e-3}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = run(parts, 1.0, 100.0, method="jacobi", extrapolation="zero", parameters=light)
    assert np.abs(found["mass.x"]).max() > 1e200
    (remark,) = [one for one in found.figures.remarks if "assumed" in one]
    assert "nan" not in remark


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"links": LINKS[:1]}, "mass: force without a connection or a value"),
        ({"inputs": {"spring.push": ([0.0, 1.0], [0.0, 0.0])}}, "values of spring.push end at 1"),
    ],
)
def test_what_may_have_been_forgotten_gets_a_remark(
    parts: dict[str, Path], given: dict[str, Any], words: str
) -> None:
    assert any(words in one for one in run(parts, **given).figures.remarks)
    assert not any(words in one for one in run(parts).figures.remarks)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"links": ["mass.x"]}, ("connection 'mass.x'", "expected a pair")),
        ({"inputs": {"spring.push": lambda t: float("nan")}}, ("'spring.push' = nan at",)),
        (
            {"inputs": {"spring.push": ([0.0, float("inf")], [0, 0])}},
            ("row 2 is 0 at inf s", "expected finite"),
        ),
        (
            {"inputs": {"spring.push": ([0, 2, 1], [0, 0, 0])}},
            ("1 s follows 2 s in row 3", "rise"),
        ),
        ({"iterations": 2.5}, ("iterations = 2.5", "whole number")),
        ({"stop": "1"}, ("stop = '1'", "positive number")),
        ({"moving": "mass"}, ("moving = 'mass'", "list")),
    ],
)
def test_wrong_arguments_are_refused_in_words(
    parts: dict[str, Path], given: dict[str, Any], words: tuple[str, ...]
) -> None:
    with refused(ValueError, *words):
        run(parts, **given)


def test_ssp_may_have_other_ways_of_writing_a_place(
    parts: dict[str, Path], tmp_path: Path
) -> None:
    def component(name: str, source: str, variables: Callable[[str], str]) -> str:
        return (
            f'<ssd:Component name="{name}" source="{source}"><ssd:Connectors>'
            f"{variables(name)}</ssd:Connectors></ssd:Component>"
        )

    def connectors(name: str) -> str:
        return ""

    pairs = [("a.m", "x", "spring", "x"), ("spring", "force", "a.m", "force")]
    text = (
        '<ssd:SystemStructureDescription name="oscillator" version="1.0" '
        'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription">'
        '<ssd:System name="s"><ssd:Elements>'
        + component("a.m", "./resources/my%20mass.fmu", connectors)
        + component("spring", "resources/spring.fmu", connectors)
        + "</ssd:Elements><ssd:Connections>"
        + "".join(
            f'<ssd:Connection startElement="{a}" startConnector="{b}" endElement="{c}" '
            f'endConnector="{d}"/>'
            for a, b, c, d in pairs
        )
        + "</ssd:Connections></ssd:System></ssd:SystemStructureDescription>"
    )
    place = tmp_path / "oscillator.ssp"
    write_zip(
        place,
        {
            "SystemStructure.ssd": text.encode(),
            "resources/my mass.fmu": parts["mass"].read_bytes(),
            "resources/spring.fmu": parts["spring"].read_bytes(),
        },
    )
    table = tmp_path / "table.csv"
    options = ("--step", 0.02, "--stop", 1, "--report", tmp_path, "-o", table)
    assert invoke("couple", place, *options, "--record", "a.m.v").exit_code == 0
    heading, *rows = table.read_text("utf-8").splitlines()
    assert heading == "time,a.m.v"
    assert len(rows) == 51
    result = invoke("couple", place, "--step", 0.02, "--stop", 1, "-o", tmp_path)
    assert result.exit_code == 1
    assert "expected a file" in " ".join(result.output.split())
