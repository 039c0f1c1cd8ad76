"""The loop in C gives what the calls from Python give: values, and errors by the same words."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim import step_loop
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fmu.export import export_fmu
from slide_fmu.importer.errors import CoSimulationError
from slide_fmu.importer.file import unpacked
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate
from tests.libraries import build_libraries
from tests.own_models.lag import build_lag
from tests.own_models.strict_lag import build_strict_lag, true_level


@pytest.fixture(scope="module", autouse=True)
def _binaries() -> None:
    build_libraries()


def both_messages(fmu: Path, drive: FloatArray) -> list[str]:
    """What a run of an FMU says in C and in Python."""
    messages = []
    with unpacked(fmu) as files:
        for timed in (False, True):
            with pytest.raises(CoSimulationError) as raised:
                run_fmu(files, {"drive": drive}, ["level"], step=0.02, timed=timed)
            messages.append(str(raised.value))
    return messages


@pytest.mark.parametrize("fmi", [2, 3])
def test_values_are_those_of_calls_from_python(tmp_path: Path, fmi: int) -> None:
    """Reals and Booleans are read, over the seams of several calls."""
    surrogate = random_surrogate(Shape(n_inputs=2, n_outputs=2, cell=CellShape()))
    fmu = export_fmu(surrogate, tmp_path / "one.fmu", fmi=3 if fmi == 3 else 2)
    rows = np.random.default_rng(0).uniform(-1, 1, (41, 2))
    with unpacked(fmu) as files:
        inputs = {s.name: rows[:, k] for k, s in enumerate(surrogate.inputs)}
        kinds = {files.variables[name].type for name in files.variables}
        assert "Boolean" in kinds
        wanted = ["window_filled", *(s.name for s in surrogate.outputs)]
        for step in (STEP, STEP / 3):
            in_c = run_fmu(files, inputs, wanted, step=step)
            in_python = run_fmu(files, inputs, wanted, step=step, timed=True)
            np.testing.assert_array_equal(in_c.values, in_python.values)
            assert in_c.values.shape == (42, 3)
            assert len(in_python.seconds) == len(in_python.step_seconds) == 41
            assert len(in_c.seconds) == 0


@pytest.mark.parametrize(("step", "longest"), [(1e-6, 32), (0.03, 4), (7.0, 1)])
def test_call_lasts_no_longer_than_a_user_waits_for_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: float, longest: int
) -> None:
    """A step of the FMU takes this time in s; calls double until they take a tenth of a second."""
    fmu = build_strict_lag(tmp_path / "lag.fmu")
    taken, clock = list[int](), [0.0]
    take = step_loop._WholeRun.take

    def spied(whole: step_loop._WholeRun, first: int, last: int) -> None:
        take(whole, first, last)
        taken.append(last - first)
        clock[0] += step * (last - first)

    monkeypatch.setattr(step_loop._WholeRun, "take", spied)
    monkeypatch.setattr(step_loop, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    drive = np.linspace(-1, 1, 63)
    with unpacked(fmu) as files:
        values = run_fmu(files, {"drive": drive}, ["level"], step=0.02).values
    assert (sum(taken), max(taken)) == (63, longest)
    np.testing.assert_allclose(values[:, 0], true_level(drive, 0.02), atol=1e-12)


def test_failed_step_is_told_as_from_python(tmp_path: Path) -> None:
    fmu = build_strict_lag(tmp_path / "lag.fmu", end=0.8)
    in_c, in_python = both_messages(fmu, np.ones(60))
    assert in_c == in_python
    assert "0.82 s is beyond the end" in in_c


@pytest.mark.parametrize(
    ("last", "told"), [(1.5, "asks for the end of the simulation"), (-1.5, "returned early")]
)
def test_end_of_a_step_of_fmi_3_is_told_as_from_python(
    tmp_path: Path, last: float, told: str
) -> None:
    """The FMU ends where its input leaves its range: in the fourth step."""
    fmu = build_lag(tmp_path / "lag.fmu")
    in_c, in_python = both_messages(fmu, np.array([0.2, -0.3, 0.9, last, 0.0]))
    assert in_c == in_python
    assert f"fmi3DoStep {told} at t = 0.08 s" in in_c
    assert "from 0.06 s" in in_c
