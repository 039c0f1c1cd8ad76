"""Machines that rest at first, and FMUs that are not what they say."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.couple.result import CoupledRun
from slide_fmu.importer.errors import CoSimulationError
from tests.apps.couple.test_oscillator import LINKS, OWN_MODELS, run, written
from tests.python_fmus import write_python_fmu
from tests.refusals import refused

STARTS = 0.5
"""Time in s at which a push begins to rise, by 1 N/s."""


def late(time: float) -> float:
    return max(time - STARTS, 0.0)


def pushed(time: np.ndarray) -> np.ndarray:
    """The place of the mass of 1 kg on the spring of 100 N/m under this push."""
    since = np.maximum(time - STARTS, 0.0)
    return np.asarray(since / 100 - np.sin(10 * since) / 1000)


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return written(tmp_path_factory.mktemp("parts"))


def from_rest(
    parts: dict[str, Path], step: float, stop: float = 1.5, **options: str
) -> CoupledRun:
    rest = {"mass.start": 0.0}
    return run(parts, step, stop, inputs={"spring.push": late}, parameters=rest, **options)


@pytest.mark.parametrize("method", ["newton", "fixed_point"])
def test_predictor_shortens_the_step_in_which_a_machine_begins_to_move(
    parts: dict[str, Path], method: str
) -> None:
    found = from_rest(parts, 0.1, method=method, control="predictor")
    behind = found.time > STARTS
    assert np.diff(found.time)[behind[1:]][0] < 0.01
    assert np.abs(found["mass.x"] - pushed(found.time)).max() < 0.005 * pushed(found.time).max()


@pytest.mark.parametrize("method", ["newton", "fixed_point"])
def test_implicit_steps_end_where_a_push_reaches_a_mass_through_others(
    parts: dict[str, Path], method: str
) -> None:
    """What is behind the others rests exactly in the first iterations."""
    fmus = {"mass": parts["mass"], "three": parts["spring"], "two": parts["spring"]}
    links = [
        ("one.force", "two.x"),
        ("two.force", "three.x"),
        ("three.force", "mass.force"),
        ("mass.x", "one.x"),
    ]
    fixed = {"mass.start": 0.0, "two.stiffness": -1.0, "three.stiffness": -1.0}
    for step in np.linspace(0.002, 0.03, 15):
        found = slide.couple(
            {**fmus, "one": parts["spring"]},
            links,
            step=float(step),
            stop=40 * float(step),
            method=method,
            parameters=fixed,
            inputs={"one.push": lambda time: time},
        )
        exact = (found.time - np.sin(10 * found.time) / 10) / 100
        assert np.abs(found["mass.x"] - exact).max() < 0.02 * exact.max()


@pytest.mark.parametrize("method", ["jacobi", "gauss_seidel"])
def test_linear_explicit_steps_are_of_second_order(parts: dict[str, Path], method: str) -> None:
    def error(step: float) -> float:
        found = run(parts, step, 1.0, method=method, extrapolation="linear")
        return float(np.abs(found["mass.x"] - 0.01 * np.cos(10 * found.time)).max())

    assert error(0.01) / error(0.005) == pytest.approx(4, rel=0.2)


def faulty(folder: Path, goes_back: bool) -> Path:
    given = {"canGetAndSetFMUstate": "true"} if goes_back else {}
    script = OWN_MODELS / "faulty_slave.py"
    return write_python_fmu("Faulty", script, folder / f"faulty_{goes_back}.fmu", **given)


def test_states_that_leave_something_out_are_refused(
    parts: dict[str, Path], tmp_path: Path
) -> None:
    """Though the output that is wrong is not connected."""
    fmus = {"mass": faulty(tmp_path, goes_back=True), "spring": parts["spring"]}
    with refused(CoSimulationError, "component 'mass': x is", "goes back", "_get_fmu_state"):
        slide.couple(fmus, LINKS[1:], step=0.01, stop=0.1)
    explicit = slide.couple(fmus, LINKS[1:], step=0.01, stop=0.1, method="jacobi")
    assert np.isfinite(explicit["mass.x"]).all()


def test_circle_of_feedthrough_with_an_fmu_that_cannot_go_back_is_refused(tmp_path: Path) -> None:
    """Here the force of one spring moves the other one's end."""
    options = {"canHandleVariableCommunicationStepSize": "true"}
    spring = write_python_fmu(
        "Spring", OWN_MODELS / "spring_slave.py", tmp_path / "spring.fmu", **options
    )
    links = [("one.force", "two.x"), ("two.force", "one.x")]
    with refused(CoSimulationError, "['one', 'two'] depend", "['one', 'two'] cannot"):
        slide.couple({"one": spring, "two": spring}, links, step=0.01, stop=0.1)


FAILS = """
import json, sys
import slide_fmu as slide
mass, spring, options = json.loads(sys.argv[1])
fmus = {"mass": mass, "spring": spring}
try:
    slide.couple(fmus, [("spring.force", "mass.force")], step=0.01, stop=0.1,
                 parameters={"mass.end": 0.045}, **options)
except Exception as error:
    print(type(error).__name__, error)
"""


@pytest.mark.parametrize("control", [None, "halving"])
def test_fmu_is_not_called_again_after_a_fatal_error(
    parts: dict[str, Path], tmp_path: Path, control: str | None
) -> None:
    """A call would end the process, so that it is one of its own."""
    options = {"method": "jacobi"} if control is None else {"control": control}
    mass = parts["mass"] if control else faulty(tmp_path, goes_back=False)
    if control:  # a mass that goes back, and fails
        script = tmp_path / "faulty.py"
        text = (OWN_MODELS / "faulty_slave.py").read_text(encoding="utf-8")
        register = 'self.register_variable(Real("x", causality=Fmi2Causality.output))'
        local = 'self.register_variable(Real("speed", causality=Fmi2Causality.output))'
        script.write_text(text.replace(register, f"{register}\n        {local}"), encoding="utf-8")
        mass = write_python_fmu(
            "Faulty", script, tmp_path / "faulty.fmu", canGetAndSetFMUstate="true"
        )
    given = json.dumps([str(mass), str(parts["spring"]), options])
    done = subprocess.run(
        [sys.executable, "-c", FAILS, given], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("StoppedRunError component 'mass': fmi2DoStep failed")
    assert "force = " in done.stdout


def test_values_and_tables_without_effect_get_a_remark(parts: dict[str, Path]) -> None:
    found = run(
        parts, 0.02, 0.2, parameters={"spring.x": 3.0}, inputs={"spring.push": ([0.1, 1], [0, 0])}
    )
    remarks = "\n".join(found.figures.remarks)
    assert "spring.x = 3.0 has no effect, since mass.x sets this input" in remarks
    assert "values of spring.push begin at 0.1 s, and the run at 0 s" in remarks
