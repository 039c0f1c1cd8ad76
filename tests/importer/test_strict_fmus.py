"""What an FMU says that it takes is honoured in the same way by all that run FMUs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.core.progress import quiet
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.importer.errors import CoSimulationError
from slide_fmu.importer.file import unpacked
from slide_fmu.importer.instance import instantiated
from slide_fmu.memory.sizing import NotForgettingError
from slide_fmu.propose.proposal import InitOptions, propose
from slide_fmu.recipe.writing import ModelDraft
from slide_fmu.systems.base import Stepping, System
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.fmu.model import describe
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification
from tests.marks import first
from tests.own_models.strict_lag import build_strict_lag, true_level
from tests.refusals import refused

STEP = 0.02
DRIVE = np.sin(0.4 * np.arange(60)) - 0.3
EXACT = {"rtol": 0, "atol": 1e-12}


def system_of(fmu: Path, step: float = STEP, **parameters: float) -> System:
    inputs = {"drive": SignalTable(hold="zero_order")}
    return load_system(Specification(str(fmu), parameters, step, "fmu", inputs))


def by_importer(fmu: Path) -> FloatArray:
    with unpacked(fmu) as files:
        return run_fmu(files, {"drive": DRIVE}, ["level"], step=STEP).values[:, 0]


def by_system(fmu: Path) -> FloatArray:
    return simulate(system_of(fmu), DRIVE[:, None]).outputs[:, 0]


def by_couple(fmu: Path) -> FloatArray:
    held = {"lag.drive": lambda time: float(DRIVE[min(int(time / STEP), len(DRIVE) - 1)])}
    stop = STEP * len(DRIVE)
    run = slide.couple({"lag": fmu}, [], step=STEP, stop=stop, inputs=held, method="jacobi")
    return run["lag.level"]


Door = Callable[[Path], FloatArray]
doors = pytest.mark.parametrize("run", [by_importer, by_system, by_couple])


@doors
@pytest.mark.parametrize("start", [0.0, 5.0])
@pytest.mark.parametrize("only_step", [None, 0.004])
def test_fmu_begins_at_its_own_start_time_and_gets_steps_that_it_takes(
    tmp_path: Path, run: Door, start: float, only_step: float | None
) -> None:
    fmu = build_strict_lag(tmp_path / "lag.fmu", start=start, only_step=only_step)
    np.testing.assert_allclose(run(fmu), true_level(DRIVE, STEP), **EXACT)


@doors
def test_step_that_an_fmu_does_not_take_is_refused(tmp_path: Path, run: Door) -> None:
    fmu = build_strict_lag(tmp_path / "lag.fmu", only_step=0.015)
    with pytest.raises((CoSimulationError, LoadError, ValueError), match=r"0\.015 s"):
        run(fmu)


@doors
def test_message_of_a_failed_step_has_the_numbers_that_the_fmu_logs(
    tmp_path: Path, run: Door
) -> None:
    fmu = build_strict_lag(tmp_path / "lag.fmu", end=0.8)
    with pytest.raises((CoSimulationError, SimulationError)) as raised:
        run(fmu)
    message = str(raised.value)
    assert "fmi2DoStep failed with status 3 (error): 0.82 s is beyond the end" in message
    assert "ends at 0.8 s (stopTime)" in message


LONG = np.sin(0.13 * np.arange(500)) - 0.3


@pytest.mark.parametrize("told_end", [False, True])
@pytest.mark.parametrize("start", [0.0, 5.0])
def test_motions_go_on_beyond_the_default_experiment(
    tmp_path: Path, start: float, told_end: bool
) -> None:
    """By a later stop time where the FMU takes one, else by instances that lead in one another."""
    fmu = build_strict_lag(tmp_path / "lag.fmu", start=start, end=start + 3.0, told_end=told_end)
    system, expected = system_of(fmu), true_level(LONG, STEP)
    for knows_end in (False, True):
        found = simulate(system, LONG[:, None]).outputs[:, 0]
        exact = told_end and knows_end  # it is told the end from the start on
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 if exact else 1e-8)


def test_memory_that_outlasts_the_default_experiment_is_told(tmp_path: Path) -> None:
    fmu = build_strict_lag(tmp_path / "lag.fmu", end=0.5)
    found = "leads in over 0.38 s comes to 'level' = "
    with refused(SimulationError, found, "ends at 0.5 s (stopTime)", "with a later end"):
        simulate(system_of(fmu), LONG[:, None])


def test_failure_within_the_default_experiment_is_the_same_as_ever(tmp_path: Path) -> None:
    wrong = "if (begin > 4.09) return fmi2Error;"
    fmu = build_strict_lag(tmp_path / "lag.fmu", end=10.0, at_step=wrong)
    with refused(SimulationError, "failed at t = 4.1 s", "fmi2DoStep failed"):
        simulate(system_of(fmu), LONG[:, None])


def test_one_instance_in_a_process_is_enough(tmp_path: Path) -> None:
    """Systems take turns; each one begins anew."""
    fmu = build_strict_lag(tmp_path / "lag.fmu", only_one=True)
    one, other = system_of(fmu), system_of(fmu, STEP / 2)
    for _ in range(2):
        for system, step in ((one, STEP), (other, STEP / 2)):
            levels = simulate(system, DRIVE[:, None]).outputs[:, 0]
            np.testing.assert_allclose(levels, true_level(DRIVE, step), **EXACT)
    np.testing.assert_allclose(by_couple(fmu), true_level(DRIVE, STEP), **EXACT)


def test_withdrawn_instance_is_refused_by_name(tmp_path: Path) -> None:
    fmu = build_strict_lag(tmp_path / "lag.fmu", only_one=True)
    system = system_of(fmu)
    assert isinstance(system, Stepping)
    system.begin(np.zeros(1))
    by_system(fmu)
    with refused(SimulationError, "canBeInstantiatedOnlyOncePerProcess", "begin anew"):
        system.advance(np.zeros(1))


def test_two_living_instances_are_told_by_the_fmu_itself(tmp_path: Path) -> None:
    """Where the description does not say that one is all, the text of the FMU is all there is."""
    fmu = build_strict_lag(tmp_path / "lag.fmu", only_one=True)
    with unpacked(fmu) as files:
        files.offer.canBeInstantiatedOnlyOncePerProcess = False
        with (
            instantiated(files),
            refused(CoSimulationError, "lag.fmu cannot be", "1 of 1 instances are there"),
            instantiated(files),
        ):
            pass


def test_unnamed_step_is_asked_for_by_its_key(tmp_path: Path) -> None:
    fmu = build_strict_lag(tmp_path / "lag.fmu", only_step=0.004, names_step=False)
    assert not describe(str(fmu)).takes_any_step
    with refused(LoadError, "fmu-step = SECONDS", "canHandleVariableCommunicationStepSize"):
        system_of(fmu)
    levels = simulate(system_of(fmu, **{"fmu-step": 0.004}), DRIVE[:, None]).outputs[:, 0]
    np.testing.assert_allclose(levels, true_level(DRIVE, STEP), **EXACT)


def test_own_times_of_an_fmu_get_a_remark(tmp_path: Path) -> None:
    fmu = build_strict_lag(tmp_path / "lag.fmu", start=5.0, end=15.0)
    remarks = "; ".join(describe(str(fmu)).remarks)
    assert "begins at 5 s, its own startTime" in remarks
    assert "ends at 15 s (stopTime)" in remarks
    run = slide.couple({"lag": fmu}, [], step=STEP, stop=0.2)
    assert any("lag begins at 5 s of its own time" in one for one in run.figures.remarks)


def test_told_step_is_a_multiple_of_the_only_one(tmp_path: Path) -> None:
    fmu = build_strict_lag(tmp_path / "lag.fmu", only_step=0.004)
    with refused(LoadError, "fmu-step = 0.005 s", "a multiple of 0.004 s"):
        system_of(fmu, **{"fmu-step": 0.005})


@pytest.mark.parametrize("names_step", first([True, False]))
def test_proposal_probes_an_fmu_by_its_step_alone(tmp_path: Path, names_step: bool) -> None:
    """Any other step would be refused by the FMU."""
    fmu = build_strict_lag(tmp_path / "lag.fmu", only_step=0.004, names_step=names_step)
    told = None if names_step else 0.004
    draft = propose(InitOptions(str(fmu), fmu_step=told), quiet).draft
    assert isinstance(draft, ModelDraft)
    assert draft.step / 0.004 == pytest.approx(round(draft.step / 0.004))


@pytest.mark.parametrize("time", first([1.0, 100.0]))
def test_fmu_with_a_clock_inside_is_refused_by_init(tmp_path: Path, time: float) -> None:
    fmu = build_strict_lag(tmp_path / "lag.fmu", start=None, clock=time)
    with refused(NotForgettingError, "depend on time", "level differs by up to 0.", "s later"):
        propose(InitOptions(str(fmu)), quiet)
