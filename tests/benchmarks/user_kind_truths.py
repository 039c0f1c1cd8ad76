"""True outputs for kinds of input as users drive machines, simulated once and kept in a folder."""

from __future__ import annotations

import hashlib
import io
import pickle
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from crank_kinds import CRANK
from force_kinds import FORCES
from joint_kinds import JOINT_MOTIONS
from kind_tables import Machine, rng_of

from slide_fmu.core.files import write_whole
from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import ATTEMPTS, TEST, Draw, Stream, drawn_outputs, first_that_runs
from slide_fmu.data.pool import in_parallel, process_pool
from slide_fmu.recipe.case import Case, case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import State, System
from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.simulation import simulate

MACHINES = {
    "mbs_models.oscillators:DuffingOscillator": FORCES,
    "mbs_models.slider_crank:SliderCrank": CRANK,
    "mbs_models.robot_6r:Robot6R": JOINT_MOTIONS,
}
"""Machines by the model that recipes name."""

CONTROL = "in range"
"""Name of kind and level of the trajectories that are drawn as the recipe says."""


@dataclass(frozen=True, eq=False)
class Truth:
    """A truth is a trajectory of a kind, in units of measure.

    Attributes:
        case: names of kind and level.
        inputs: shape (N, n_inputs).
        outputs: of the reference at samples 0 .. N, from each initial state, (M, N + 1,
            n_outputs); the first is the truth.
        failed: number of draws before this one that the reference could not simulate.
    """

    case: tuple[str, str]
    inputs: FloatArray
    outputs: FloatArray
    failed: int


@dataclass(frozen=True)
class Plan:
    """A plan says which trajectories are drawn.

    Attributes:
        seed: of all of them.
        trajectories: number for each kind and level.
        control: number in range.
        duration: length in s that is measured.
    """

    seed: int
    trajectories: int
    control: int
    duration: float


def machine_of(recipe: Recipe) -> Machine:
    """Return the machine of a recipe."""
    found = MACHINES.get(recipe.system.model)
    if found is None:
        raise SystemExit(
            f"recipe {recipe.name!r} has the model {recipe.system.model!r}; expected one of "
            f"{', '.join(MACHINES)}: take an FMU of these, or add kinds for this model"
        )
    return found


def truths_of(
    recipe: Recipe, plan: Plan, store: Path | None, workers: int, advance: Progress
) -> list[Truth]:
    """Return the truths of all kinds and levels, then those in range.

    Args:
        store: folder that has or gets them; None to keep nothing.
        workers: processes that simulate; 0 for this one alone.
    """
    cases = machine_of(recipe).cases()
    jobs = [(case, index) for case in cases for index in range(plan.trajectories)]
    jobs += [((CONTROL, CONTROL), index) for index in range(plan.control)]
    about = pickle.dumps((recipe, plan, store))
    advance(0, len(jobs))
    with process_pool(workers) as pool:
        return in_parallel(
            pool, _truth, [(about, *job) for job in jobs], lambda n: advance(n, len(jobs))
        )


@lru_cache(maxsize=1)
def _read(about: bytes) -> tuple[Case, Plan, Path | None]:
    """Unpickle a plan once in a process, which makes its systems once."""
    recipe, plan, store = pickle.loads(about)
    return case_of(recipe), plan, store


def _truth(about: bytes, names: tuple[str, str], index: int) -> Truth:
    case, plan, store = _read(about)
    if names == (CONTROL, CONTROL):
        return _in_range(case, plan, store, index)
    machine, step, system = machine_of(case.recipe), case.recipe.window.step, case.reference
    times = step * np.arange(round((machine.lead + plan.duration) / step))
    for attempt in range(ATTEMPTS):
        rng = rng_of(plan.seed, names, index, attempt)
        inputs = machine.inputs(names, times, rng)
        states = machine.states(system, rng, inputs[0])
        place = _place(case, store, names, inputs, states)
        try:
            return Truth(names, inputs, _outputs(system, inputs, states, place), attempt)
        except SimulationError as error:
            last = error
    raise SimulationError(f"{ATTEMPTS} draws of {names} could not be simulated: {last}", last.time)


def _in_range(case: Case, plan: Plan, store: Path | None, index: int) -> Truth:
    """Return a trajectory as the recipe draws it; it has one initial state only."""
    recipe, names, system = case.recipe, (CONTROL, CONTROL), case.reference
    seconds = max(machine_of(recipe).lead - recipe.data.burn_in, 0.0) + plan.duration
    stream = Stream(TEST, plan.seed, (1.0, 1.0), seconds)

    def run(drawn: Draw) -> Truth:
        if drawn.between is not None:
            outputs = drawn_outputs(system, drawn)[None]  # rare kinds, which are not kept
        else:
            states = [drawn.initial]
            place = _place(case, store, names, drawn.inputs, states)
            outputs = _outputs(system, drawn.inputs, states, place)
        return Truth(names, drawn.inputs, outputs, drawn.attempt)

    return first_that_runs(recipe, system, stream, index, run)


def _outputs(
    system: System, inputs: FloatArray, states: Sequence[State | None], place: Path | None
) -> FloatArray:
    """Return the outputs from all initial states, kept or simulated, (M, N + 1, n_outputs)."""
    if place is not None and place.exists():
        return np.asarray(np.load(place)["outputs"])
    outputs = np.array([simulate(system, inputs, state).outputs for state in states])
    if place is not None:
        content = io.BytesIO()
        np.savez_compressed(content, inputs=inputs, outputs=outputs)
        write_whole(place, content.getvalue())
    return outputs


def _place(
    case: Case,
    store: Path | None,
    names: Sequence[str],
    inputs: FloatArray,
    states: Sequence[State | None],
) -> Path | None:
    """Return the file of a truth, whose name follows from the reference and what drives it."""
    if store is None:
        return None
    digest = hashlib.sha256(case.systems.reference_specification.to_json().encode())
    parts = [inputs]
    for state in states:
        parts += [] if state is None else [state.coordinates, state.velocities, state.last_input]
    for part in parts:
        digest.update(np.ascontiguousarray(part).tobytes())
    name = "_".join(names).replace(" ", "_")
    return store / case.recipe.name / f"{name}_{digest.hexdigest()[:16]}.npz"
