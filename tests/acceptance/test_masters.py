"""Released FMUs in real masters: in a loop with a controller, and beside their references."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd
from fmpy.validation import validate_fmu

from slide_fmu.fmu.export import read_fmu
from slide_fmu.signals import FloatArray
from slide_fmu.ssp import Connection, write_ssp

from .conftest import invoke
from .controller import build_controller, force_at
from .masters import (
    Outputs,
    run_container,
    run_ecos,
    run_fmpy,
    run_libcosim,
    write_container,
)

ROOT = Path(__file__).parents[2]
DUFFING = ROOT / "fmus" / "duffing" / "duffing.fmu"
STEP = 0.03
LOOP_STEPS = 200
SAME = 1e-5
"""In m: native library and numpy round differently, and start values reach the FMUs in different
orders; one step more or less would change the positions by 0.02 m."""

Master = Callable[[Path, Outputs, float, int], FloatArray]


def master(run: Master, module: str) -> object:
    """A master that is skipped where it is missing."""
    missing = importlib.util.find_spec(module) is None
    mark = pytest.mark.skipif(missing, reason=f"{module} is not installed")
    return pytest.param(run, id=module, marks=mark)


MASTERS = [
    master(run_fmpy, "fmpy"),
    master(run_libcosim, "libcosimpy"),
    master(run_ecos, "ecospy"),
]
needs_toolbox = pytest.mark.skipif(
    importlib.util.find_spec("fmu_manipulation_toolbox") is None,
    reason="fmu-manipulation-toolbox is not installed",
)


@pytest.fixture(autouse=True)
def unchanged_path() -> Iterator[None]:
    """PythonFMU leaves the folder of every instance on Python's search path."""
    before = list(sys.path)
    yield
    sys.path[:] = before


@pytest.fixture(scope="module")
def controller(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The other FMU of the loop."""
    path = build_controller(tmp_path_factory.mktemp("controller"))
    assert validate_fmu(str(path)) == []
    return path


@pytest.fixture(scope="module")
def closed_loop() -> FloatArray:
    """Positions at the ends of the steps, shape (LOOP_STEPS, 1), by numpy.

    Both FMUs step with what the other gave at the end of the step before.
    """
    surrogate, _ = read_fmu(DUFFING)
    stream, position, force = surrogate.stream(), 0.0, 0.0
    positions = []
    for k in range(LOOP_STEPS):
        before = position
        position = stream.step(np.array([force]))[0][0]
        force = force_at((k + 1) * STEP, before)
        positions.append([position])
    return np.array(positions)


@pytest.mark.parametrize("run", MASTERS)
def test_loop_with_a_controller(
    run: Master, controller: Path, closed_loop: FloatArray, tmp_path: Path
) -> None:
    connections = [
        Connection(("controller", "force"), ("duffing", "force")),
        Connection(("duffing", "position"), ("controller", "position")),
    ]
    components = {"controller": controller, "duffing": DUFFING}
    ssp = write_ssp(tmp_path / "loop.ssp", "loop", components, connections)
    found = run(ssp, [("duffing", "position")], STEP, LOOP_STEPS)
    assert np.ptp(closed_loop) > 0.2
    np.testing.assert_allclose(found, closed_loop, rtol=0, atol=SAME)


@needs_toolbox
def test_loop_inside_a_container(
    controller: Path, closed_loop: FloatArray, tmp_path: Path
) -> None:
    for fmu in (controller, DUFFING):
        shutil.copy(fmu, tmp_path)
    links = [
        ("controller.fmu", "force", "duffing.fmu", "force"),
        ("duffing.fmu", "position", "controller.fmu", "position"),
    ]
    container = write_container(tmp_path, links, ("duffing.fmu", "position"), STEP)
    found = run_container(container, "position", STEP, LOOP_STEPS)
    np.testing.assert_allclose(found, closed_loop, rtol=0, atol=SAME)


@needs_toolbox
@pytest.mark.parametrize("fmu", sorted((ROOT / "fmus").glob("*/*.fmu")), ids=lambda p: p.stem)
def test_toolbox_has_nothing_to_say(fmu: Path) -> None:
    command = [Path(sys.executable).with_name("fmutool"), "-input", fmu, "-check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    said = done.stdout + done.stderr
    assert done.returncode == 0, said
    assert "seems to be compliant" in said, said
    assert "ERROR" not in said, said


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The SSP of the released Duffing FMU."""
    path = tmp_path_factory.mktemp("ssp") / "duffing.ssp"
    result = invoke("ssp", DUFFING, "-o", path, "--duration", 9)
    assert result.exit_code == 0, result.output
    return path


@pytest.mark.parametrize("run", MASTERS)
def test_reference_and_surrogate_side_by_side(run: Master, comparison: Path) -> None:
    outputs = [
        *(("reference", "position"), ("surrogate", "position"), ("inputs", "force")),
        ("surrogate", "window_filled"),
    ]
    found = run(comparison, outputs, STEP, 300)
    reference, surrogate, force = found[:, 0], found[:, 1], found[:, 2]
    assert np.ptp(force) > 500
    assert found[-1, 3] == 1
    error = np.sqrt(np.mean((surrogate - reference) ** 2) / np.mean(reference**2))
    assert error < 0.0015  # as the recipe promises


def test_structure_is_valid(comparison: Path) -> None:
    system = read_ssd(str(comparison)).system
    assert [element.name for element in system.elements] == ["inputs", "reference", "surrogate"]
    assert len(system.connections) == 2


def test_mistakes_are_named(tmp_path: Path, controller: Path) -> None:
    with pytest.raises(ValueError, match=r"ending in \.ssp"):
        write_ssp(tmp_path / "loop.zip", "loop", {"controller": controller}, [])
    wrong = [Connection(("controller", "force"), ("controller", "force"))]
    with pytest.raises(ValueError, match=r"controller\.force: no input .* one of \['position'\]"):
        write_ssp(tmp_path / "loop.ssp", "loop", {"controller": controller}, wrong)
    foreign = invoke("ssp", controller, "-o", tmp_path / "x.ssp")
    assert foreign.exit_code == 1
    assert "not made by slide-fmu" in foreign.output.replace("\n", " ")
    assert list(tmp_path.iterdir()) == []
