"""FMUs that end or block the program that runs them, discard steps, or diverge."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.couple.result import CoupledRun, StoppedRunError
from tests.marks import first
from tests.own_models.strict_lag import build_strict_lag, true_level
from tests.refusals import refused

STEP, STOP = 0.01, 0.6
AT = 0.3
"""The time in s from which on they misbehave."""
METHODS = first(["newton", "jacobi"])
DRIVE = (np.array([0.0, STOP]), np.array([0.0, 1.0]))
LOOP = "for (;;) signal(SIGTERM, SIG_IGN);"
ENDS = {
    "exit": ("exit(0);", "ended the program that runs it with the exit code 0, in fmi2DoStep"),
    "crash": ("raise(SIGSEGV);", "ended the program that runs it by SIGSEGV, in fmi2DoStep"),
    "loop": (LOOP, "fmi2DoStep has not returned for 0.3 s, the deadline of one call"),
    "error": ("return fmi2Error;", "fmi2DoStep failed with status 3"),
}


@pytest.fixture(autouse=True)
def in_this_program() -> None:
    """These run in a program of their own, as without tests."""


def run(folder: Path, at_step: str, method: str = "newton", states: bool = False) -> CoupledRun:
    """Two lags follow each other; the second one misbehaves."""
    fine = build_strict_lag(folder / "fine.fmu")
    bad = build_strict_lag(folder / "bad.fmu", at_step=at_step, states=states)
    return slide.couple(
        {"one": fine, "other": bad},
        [("one.level", "other.drive")],
        step=STEP,
        stop=STOP,
        inputs={"one.drive": DRIVE},
        method=method,
        deadline=0.3,
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("way", ENDS)
def test_fmu_that_ends_a_run_is_named_and_rows_before_are_kept(
    tmp_path: Path, way: str, method: str
) -> None:
    does, said = ENDS[way]
    with pytest.raises(StoppedRunError) as caught:
        run(tmp_path, f"if (begin > {AT - 1e-6}) {{ {does} }}", method)
    assert "component 'other'" in str(caught.value)
    assert said in str(caught.value)
    kept = caught.value.values
    assert kept is not None
    whole = run(tmp_path, "", method)
    np.testing.assert_allclose(kept.time, STEP * np.arange(round(AT / STEP) + 1))
    for name, values in kept.values.items():
        np.testing.assert_allclose(values, whole[name][: len(values)], atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_discarded_step_is_taken_by_halves_where_the_fmu_goes_back(
    tmp_path: Path, method: str
) -> None:
    """A lag under held inputs is exact for steps of any length."""
    refuses = f"if (begin > {AT - 1e-6} && step > 0.003) {{ lag->level = 9; return fmi2Discard; }}"
    whole, halved = run(tmp_path, "", method), run(tmp_path, refuses, method, states=True)
    np.testing.assert_allclose(halved["other.level"], whole["other.level"], atol=2e-5)
    with refused(StoppedRunError, "component 'other'", "cannot go back", "canGetAndSetFMUstate"):
        run(tmp_path, refuses, method)


def test_step_that_no_half_mends_ends_the_run(tmp_path: Path) -> None:
    with refused(StoppedRunError, "fmi2DoStep", "status 2 (discard)"):
        run(tmp_path, f"if (begin > {AT - 1e-6}) return fmi2Discard;", states=True)


@pytest.mark.parametrize("method", METHODS)
def test_motion_that_leaves_all_ranges_is_an_error_at_its_moment(
    tmp_path: Path, method: str
) -> None:
    """The level doubles in every step from 0.3 s on, in a range of -1 .. 1."""
    grows = f"if (begin > {AT - 1e-6}) {{ lag->level = 2 * lag->level + 0.01; }}"
    fmus = {"a": build_strict_lag(tmp_path / "grows.fmu", at_step=grows)}
    fmus["b"] = build_strict_lag(tmp_path / "fine.fmu")
    with pytest.raises(StoppedRunError, match=r"b\.drive left its range -1 \.\. 1 at 0\.3") as e:
        slide.couple(fmus, [("a.level", "b.drive")], step=STEP, stop=STOP, method=method)
    kept = e.value.values
    assert kept is not None
    assert np.abs(kept.values["b.drive"][:-1]).max() <= 100.0 < np.abs(kept.values["b.drive"][-1])


@pytest.mark.parametrize("value", ["NAN", "-INFINITY"])
@pytest.mark.parametrize("linked", [True, False])
def test_output_that_is_no_number_ends_the_run_where_it_begins(
    tmp_path: Path, linked: bool, value: str
) -> None:
    """Whether another FMU takes it, or it is for the table alone."""
    bad = f"if (begin > {AT - 1e-6}) {{ lag->level = {value}; }}"
    fmus = {"a": build_strict_lag(tmp_path / "bad.fmu", at_step=bad)}
    fmus["b"] = build_strict_lag(tmp_path / "fine.fmu")
    links = [("a.level", "b.drive")] if linked else [("b.level", "a.drive")]
    with refused(StoppedRunError, "component 'a'", "level is not finite", "number") as found:
        slide.couple(fmus, links, step=STEP, stop=STOP)
    kept = found.value.values  # type: ignore[attr-defined]
    np.testing.assert_allclose(kept.time[-1], AT)
    assert all(np.isfinite(values).all() for values in kept.values.values())


def test_functions_of_a_session_are_run_here_with_a_remark(tmp_path: Path) -> None:
    fmu = build_strict_lag(tmp_path / "lag.fmu")
    found = slide.couple(
        {"lag": fmu}, [], step=STEP, stop=STOP, inputs={"lag.drive": lambda time: 0.5}
    )
    np.testing.assert_allclose(found["lag.level"], true_level(np.full(60, 0.5), STEP))
    assert any("functions of a session" in remark for remark in found.figures.remarks)


def write_ssp(folder: Path, does: str) -> Path:
    bad = build_strict_lag(folder / "bad.fmu", at_step=f"if (begin > {AT - 1e-6}) {{ {does} }}")
    return slide.write_ssp(folder / "bad.ssp", {"lag": bad}, [])


def command(folder: Path, *more: str) -> subprocess.Popen[bytes]:
    words = ["couple", "bad.ssp", "--step", str(STEP), "--stop", str(STOP), *more]
    return subprocess.Popen(
        [sys.executable, "-m", "slide_fmu", *words], cwd=folder, stderr=subprocess.PIPE
    )


def test_table_of_a_stopped_run_is_written_and_the_status_is_an_error(tmp_path: Path) -> None:
    write_ssp(tmp_path, "exit(0);")
    with command(tmp_path) as program:
        _, said = program.communicate()
    assert program.returncode == 1
    assert b"component 'lag' (lag.fmu) ended the program" in b" ".join(said.split())
    table = np.genfromtxt(tmp_path / "runs/bad/couple/values.csv", delimiter=",", names=True)
    np.testing.assert_allclose(table["time"][-1], AT)


def test_endless_step_ends_with_the_command(tmp_path: Path) -> None:
    place = tmp_path / "number"
    says = f'FILE *f = fopen("{place}", "w"); fprintf(f, "%d", getpid()); fclose(f);'
    write_ssp(tmp_path, says + LOOP)
    with command(tmp_path) as program:
        while not (place.exists() and (number := place.read_text())):
            time.sleep(0.05)
        program.send_signal(signal.SIGTERM)
        program.communicate(timeout=20)
    assert program.returncode == 143
    assert not Path(f"/proc/{number}").exists()


def test_fmu_that_ends_its_program_in_the_initialization_is_named(tmp_path: Path) -> None:
    fmu = build_strict_lag(tmp_path / "bad.fmu", start=None, at_start="exit(3);")
    with refused(StoppedRunError, "component 'a'", "exit code 3, in fmi2SetupExperiment") as found:
        slide.couple({"a": fmu}, [], step=STEP, stop=STOP)
    assert found.value.values is None  # type: ignore[attr-defined]
