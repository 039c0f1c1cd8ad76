"""Methods of coupled runs, with a quarter car cut in two: errors, energy, iterations."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.apps.couple.component import instance_of, open_component
from slide_fmu.apps.couple.initialization import initialize
from slide_fmu.apps.couple.options import CouplingOptions
from slide_fmu.apps.couple.result import CoupledRun
from slide_fmu.apps.couple.structure import coupled_system
from slide_fmu.importer.errors import CoSimulationError
from tests.own_models.halves.cut_car import (
    KNOT,
    LINKS,
    relative_error,
    road,
    whole,
    write_halves,
)
from tests.python_fmus import write_python_fmu
from tests.refusals import refused

OWN_MODELS = Path(__file__).parents[2] / "own_models"
STOP = 2.0


def ride(halves: dict[str, Path], mass: float, step: float, **options: Any) -> CoupledRun:
    """Run the car over its road."""
    found: CoupledRun = slide.couple(
        halves,
        LINKS,
        step=step,
        stop=STOP,
        inputs={"lower.road": road(STOP)},
        parameters={"upper.mass": mass},
        moving=["lower"],
        **options,
    )
    return found


def error(run: CoupledRun, mass: float) -> float:
    """The error of the body's position."""
    times, heights = road(STOP)
    found = np.interp(times, run.time, run["upper.position"])
    return relative_error(found, whole(mass, times, heights))


@pytest.mark.parametrize("method", ["newton", "fixed_point"])
def test_implicit_steps_of_a_light_body_are_close_to_the_whole_car(
    halves: dict[str, Path], method: str
) -> None:
    run = ride(halves, 12.0, 0.02, method=method)
    assert error(run, 12.0) < 0.005
    assert run.figures.iterations <= (3 if method == "newton" else 4)
    added = run["upper.work"][-1] - run["lower.work"][-1]
    assert abs(added) < 1e-3 * run["lower.exchanged"][-1]


@pytest.mark.parametrize("method", ["jacobi", "gauss_seidel"])
def test_explicit_steps_of_a_light_body_grow_and_name_the_remedy(
    halves: dict[str, Path], method: str
) -> None:
    with refused(CoSimulationError, "component 'lower'", "body = ", "the method newton"):
        ride(halves, 12.0, 0.02, method=method)


def test_error_of_implicit_steps_falls_with_the_square_of_the_step(
    halves: dict[str, Path],
) -> None:
    long, short = (error(ride(halves, 300.0, step), 300.0) for step in (KNOT, KNOT / 2))
    assert long / short == pytest.approx(4, rel=0.15)


def test_extrapolation_of_explicit_steps_makes_them_more_accurate(
    halves: dict[str, Path],
) -> None:
    zero, linear = (
        error(ride(halves, 300.0, 0.01, method="jacobi", extrapolation=name), 300.0)
        for name in ("zero", "linear")
    )
    sequential = error(ride(halves, 300.0, 0.01, method="gauss_seidel"), 300.0)
    assert sequential < linear < 0.5 * zero


@pytest.mark.parametrize("control", ["predictor", "halving"])
def test_controlled_steps_become_short_where_it_is_needed(
    halves: dict[str, Path], control: str
) -> None:
    run = ride(halves, 300.0, 0.04, control=control, error=5e-3)
    assert run.figures.rejected > 0
    assert run.figures.shortest_step_s < 0.04
    assert run.time[-1] == pytest.approx(STOP)
    assert error(run, 300.0) < error(ride(halves, 300.0, 0.04), 300.0)


@pytest.mark.parametrize("control", ["predictor", "halving"])
def test_controlled_steps_become_short_where_iterations_do_not_end(
    halves: dict[str, Path], control: str
) -> None:
    few: dict[str, Any] = {"method": "fixed_point", "iterations": 3}
    with refused(CoSimulationError, "step of 0.08 s", "after 3 iterations"):
        ride(halves, 12.0, 0.08, **few)
    run = ride(halves, 12.0, 0.08, control=control, error=0.5, **few)
    assert run.figures.rejected > 0
    assert run.figures.most_iterations <= 3
    assert error(run, 12.0) < 0.02
    with refused(CoSimulationError, "step of 7.8125e-05 s", "after 1 iterations"):
        ride(halves, 12.0, 0.08, control=control, iterations=1)


def test_sizes_of_a_rejected_step_do_not_stay(halves: dict[str, Path]) -> None:
    """They would make later errors look small; an input without a size alone gets one."""
    system = coupled_system(halves, LINKS, {"upper.mass": 300.0}, {"lower.road": road(STOP)})
    options = CouplingOptions.of(step=0.04, stop=STOP, moving=["lower"])
    with ExitStack() as stack:
        components = []
        for name, taken, read in (("lower", "reached", "force"), ("upper", "held", "position")):
            instance = stack.enter_context(instance_of(system, name))
            components.append(open_component(system, name, instance, taken, ([read], [])))
        loop, _ = initialize(system, components, options)
        loop.sizes = np.array([1.0, 0.0])
        mark = loop.mark()
        loop.accept(loop.empty(), np.array([1e6, 1e6]), np.zeros(2), 0.04)
        loop.go_back(mark)
        assert loop.sizes.tolist() == [1.0, 1e6]


def test_fmu_that_cannot_go_back_takes_part_explicitly_and_is_named(
    halves: dict[str, Path], tmp_path: Path
) -> None:
    mixed = {**halves, "upper": write_halves(tmp_path, rollback=False)["upper"]}
    run = ride(mixed, 300.0, 0.01)
    assert run.figures.remarks[0].startswith("upper takes part explicitly")
    assert error(run, 300.0) < 0.05
    with refused(CoSimulationError, "component 'upper'", "leave control out"):
        ride(mixed, 300.0, 0.01, control="halving")


def test_iterations_that_do_not_end_name_the_input(halves: dict[str, Path]) -> None:
    with refused(CoSimulationError, "after 1 iterations", "expected agreement", "upper.force"):
        ride(halves, 12.0, 0.02, iterations=1)


@pytest.mark.parametrize("method", ["newton", "gauss_seidel", "jacobi"])
def test_discrete_output_is_held_over_the_next_step(
    halves: dict[str, Path], tmp_path: Path, method: str
) -> None:
    """As the output of a controller is: the force is 0, 1, 2, ... N over successive steps."""
    stairs = write_python_fmu("Stairs", OWN_MODELS / "stairs_slave.py", tmp_path / "stairs.fmu")
    run = slide.couple(
        {"stairs": stairs, "upper": halves["upper"]},
        [("stairs.count", "upper.force")],
        step=0.1,
        stop=0.5,
        parameters={"upper.mass": 1.0},
        method=method,
    )
    assert run["upper.speed"] == pytest.approx(0.1 * np.cumsum([0, 0, 1, 2, 3, 4]))


def test_implicit_steps_stay_stable_at_twenty_times_the_longest_explicit_step(
    halves: dict[str, Path],
) -> None:
    """A body of 12 kg with an offset comes to rest; explicit steps of 12 ms let it swing on."""
    free: dict[str, Any] = {
        "inputs": {"lower.road": 0.0},
        "parameters": {"upper.mass": 12.0, "upper.start": 0.01},
        "moving": ["lower"],
    }
    explicit = slide.couple(halves, LINKS, step=0.012, stop=2.4, method="gauss_seidel", **free)
    assert np.abs(explicit["upper.position"][-50:]).max() > 0.02
    run = slide.couple(halves, LINKS, step=0.24, stop=9.6, **free)
    assert np.abs(run["upper.position"][-10:]).max() < 1e-3


@pytest.mark.parametrize("method", ["gauss_seidel", "newton"])
def test_fmu_with_steps_of_one_length_takes_several_of_them(
    halves: dict[str, Path], tmp_path: Path, method: str
) -> None:
    fixed = {**halves, "lower": write_halves(tmp_path, any_step=False)["lower"]}
    run, free = (ride(both, 300.0, 0.02, method=method) for both in (fixed, halves))
    assert run.figures.component_steps["lower"] >= 2 * run.figures.steps
    size = np.ptp(free["upper.position"])
    close = 1e-6 if method == "gauss_seidel" else 0.005  # it finds other means of the force
    assert run["upper.position"] == pytest.approx(free["upper.position"], abs=close * size)


def test_controlled_steps_are_refused_where_an_fmu_takes_no_shorter_ones(tmp_path: Path) -> None:
    fixed = write_halves(tmp_path, any_step=False)["lower"]
    own = float(fmpy.read_model_description(fixed).defaultExperiment.stepSize)
    with refused(
        ValueError, "control = 'halving'", "'lower' takes only multiples of", "leave control"
    ):
        slide.couple({"lower": fixed}, [], step=own, stop=10 * own, control="halving")
