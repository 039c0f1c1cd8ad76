"""Physical parameters of an FMU: set before the start and in a run, refused, differentiated."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from pathlib import Path

import fmpy
import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.simulate import simulate
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.fmu.description.variables import PARAMETERS_SETTLED
from slide_fmu.fmu.export import export_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.importer.errors import CoSimulationError
from slide_fmu.network.state_space.cell import MIXED_UNITS
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.gradient import parameter_jacobian
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.native import DISCARD, ERROR, OK, ExportedFmu, Load, Native
from tests.fmu.native3 import Native3, instance_of
from tests.fmu.plain import UNSETTLED, plain_features, plain_pair
from tests.fmu.samples import PARAMETERS, STEP, CellShape, Shape, random_surrogate
from tests.refusals import refused

SHAPE = Shape(n_in=20, n_out=6, n_inputs=2, n_outputs=2, cell=CellShape(states=4, parameters=3))
GATED = CellShape(states=4, parameters=2, activation="gated", turned=1, factors=1)
MIXED = CellShape(states=4, units=6, parameters=2, activation=MIXED_UNITS)
MOVING = Shape(n_in=20, n_out=6, n_inputs=2, n_outputs=2, hold="first_order", cell=SHAPE.cell)
GIVEN = {"mass": 2.6, "damping": -0.7}
SAME = 2e-6
"""Rounding of single precision, relative to an output's range of about 1."""
SLOPE = 3e-4
"""Of derivatives, relative to the largest: of weights of single precision, which follow parameters
weakly here."""
both_standards = pytest.mark.parametrize("fmi", [2, 3])
Instance = Native | Native3


def instance(loaded: ExportedFmu, fmi: FmiVersion) -> Instance:
    return loaded.instance() if fmi == 2 else instance_of(loaded)


def places(surrogate: Surrogate, fmi: FmiVersion) -> dict[str, int]:
    """The place of every variable in the model description, by name."""
    return {v.name: place for place, v in enumerate(fmu_variables(surrogate, fmi))}


class Run:
    """An instance whose variables are set and read by name."""

    def __init__(self, loaded: ExportedFmu, fmi: FmiVersion) -> None:
        self.native = instance(loaded, fmi)
        self.surrogate, self._places = loaded.surrogate, places(loaded.surrogate, fmi)
        self.time = 0.0

    def set(self, **values: float) -> int:
        """The worst status of setting variables one by one."""
        return max(
            self.native.set(value, first=self._places[name]) for name, value in values.items()
        )

    def get(self, name: str) -> float:
        return self.native.get(self._places[name])[0]

    def step(self, row: FloatArray, samples: float = 1.0) -> list[float]:
        """The outputs after a step."""
        names = [signal.name for signal in self.surrogate.inputs]
        assert self.set(**dict(zip(names, row.tolist(), strict=True))) == OK
        length = samples * STEP
        assert self.native.do_step(self.time, length) == OK, self.native.messages
        self.time += length
        return [self.get(signal.name) for signal in self.surrogate.outputs]


def inputs(count: int, seed: int = 0) -> FloatArray:
    return np.random.default_rng(seed).uniform(-1, 1, (count, 2))


@both_standards
@pytest.mark.parametrize("cell", [SHAPE.cell, GATED, MIXED])
def test_fmu_answers_as_the_surrogate_with_these_parameters(
    load: Load, fmi: FmiVersion, cell: CellShape
) -> None:
    loaded = load(random_surrogate(Shape(**{**vars(SHAPE), "cell": cell})))
    run, rows = Run(loaded, fmi), inputs(60)
    assert run.set(**GIVEN) == OK
    run.native.start()
    assert [run.get(name) for name in GIVEN] == list(GIVEN.values())
    found = [run.step(row) for row in rows]
    expected = loaded.surrogate.predict_newest(rows, GIVEN)
    assert np.array(found) == pytest.approx(expected, abs=SAME)
    assert run.get(PARAMETERS_SETTLED) == 1


@both_standards
def test_fmu_begins_with_the_start_values(load: Load, fmi: FmiVersion) -> None:
    loaded = load(random_surrogate(SHAPE))
    run, rows = Run(loaded, fmi), inputs(40)
    run.native.start()
    assert [run.get(p.name) for p in PARAMETERS] == [p.start_value for p in PARAMETERS]
    found = [run.step(row) for row in rows]
    assert np.array(found) == pytest.approx(loaded.surrogate.predict_newest(rows), abs=SAME)


def changed_at(step: int, loaded: ExportedFmu, rows: FloatArray) -> FloatArray:
    """Return the outputs of a plain loop whose parameters change to GIVEN before a step."""
    surrogate, changed = loaded.surrogate, loaded.surrogate.at(GIVEN)
    assert isinstance(surrogate.network, StateSpace)
    assert isinstance(changed.network, StateSpace)
    lead = 2 * surrogate.network.n_samples - 1
    held = np.concatenate([np.repeat(rows[:1], lead, axis=0), rows])
    scaled = surrogate.input_scaling.apply(held)
    features = plain_features(surrogate.network.features, scaled)
    values, _ = plain_pair(surrogate.network, features, (lead + step, changed.network))
    return surrogate.output_scaling.invert(values[lead:])


@both_standards
def test_change_in_a_run_keeps_what_is_remembered(load: Load, fmi: FmiVersion) -> None:
    """It counts from the next step on; a flag rises to 1 while the window passes."""
    loaded = load(random_surrogate(SHAPE))
    run, rows = Run(loaded, fmi), inputs(90)
    memory, expected = loaded.surrogate.network.memory_length, changed_at(41, loaded, rows)
    run.native.start()
    for k, row in enumerate(rows):
        if k == 41:
            before = [run.get(signal.name) for signal in loaded.surrogate.outputs]
            assert run.set(**GIVEN) == OK
            assert [run.get(s.name) for s in loaded.surrogate.outputs] == before
        found = run.step(row)
        assert found == pytest.approx(expected[k], abs=SAME)
        settled = 1.0 if k < 41 else min((k - 40) / memory, 1.0)
        assert run.get(PARAMETERS_SETTLED) == pytest.approx(settled)
    after = loaded.surrogate.predict_newest(rows, GIVEN)[-1]
    assert found == pytest.approx(after, abs=1e-4)  # what the cell has not forgotten


def test_first_step_in_a_phase_knows_the_new_parameters_alone(load: Load) -> None:
    """It evaluates the whole window anew."""
    loaded = load(random_surrogate(SHAPE))
    run, other, rows = Run(loaded, 2), Run(loaded, 2), inputs(30)
    run.native.start()
    assert other.set(**GIVEN) == OK
    other.native.start()
    for row in rows:
        run.step(row)
        other.step(row)
    assert run.set(**GIVEN) == OK
    assert run.step(rows[0], 1.5) == pytest.approx(other.step(rows[0], 1.5), abs=SAME)
    assert run.get(PARAMETERS_SETTLED) == 1


@pytest.mark.parametrize("hold", ["zero_order", "first_order"])
def test_each_phase_counts_its_samples_since_parameters_changed(load: Load, hold: str) -> None:
    """What it had seen before stays; once all is forgotten, only the new parameters count."""
    loaded = load(random_surrogate(Shape(**{**vars(SHAPE), "hold": hold})))
    run, other = Run(loaded, 2), Run(loaded, 2)
    memory = loaded.surrogate.network.memory_length
    rows = inputs(240)
    assert other.set(**GIVEN) == OK
    for one in (run, other):
        one.native.start()
        for row in rows[:60]:
            one.step(row, 0.5)
    assert run.set(**GIVEN) == OK
    settled = []
    for row in rows[60:]:
        found, expected = (one.step(row, 0.5) for one in (run, other))
        settled.append(run.get(PARAMETERS_SETTLED) * memory)
    assert found == pytest.approx(expected, abs=1e-4)
    unsettled = UNSETTLED if hold == "zero_order" else 0  # these are taken in again
    counts = np.minimum(1 + unsettled + np.arange(180) // 2, memory)
    assert settled == pytest.approx(counts)


def test_failed_step_does_not_accept_parameters(load: Load) -> None:
    """Those of the outputs stay, and the flag that tells of them."""
    cell = CellShape(states=4, parameters=3, activation="cubic")
    loaded = load(random_surrogate(Shape(**{**vars(SHAPE), "cell": cell})))
    run = Run(loaded, 2)
    run.native.start()
    for row in inputs(50):
        run.step(row)
    slopes_before = slopes(run, ["mass"], [1.0])
    assert run.set(**GIVEN) == OK
    assert run.native.set(1e30, 1e30) == OK
    assert run.native.do_step(run.time, STEP) == ERROR
    assert run.get(PARAMETERS_SETTLED) == 1
    assert np.array_equal(slopes(run, ["mass"], [1.0]), slopes_before)
    run.step(inputs(1)[0])
    assert run.get(PARAMETERS_SETTLED) < 1


@both_standards
def test_inputs_that_move_follow_parameters_too(load: Load, fmi: FmiVersion) -> None:
    """A first-order hold, whose steps are done again when the true end is known."""
    loaded = load(random_surrogate(MOVING))
    rows = np.cumsum(inputs(50), axis=0) / 10
    changed, fresh = Run(loaded, fmi), Run(loaded, fmi)
    assert fresh.set(**GIVEN) == OK
    for run in (changed, fresh):
        run.native.start()
    for k, row in enumerate(rows):
        if k == 2:
            assert changed.set(**GIVEN) == OK
        found, expected = changed.step(row), fresh.step(row)
        assert fresh.get(PARAMETERS_SETTLED) == 1
    assert changed.get(PARAMETERS_SETTLED) == 1
    assert found == pytest.approx(expected, abs=1e-4)


@both_standards
@pytest.mark.parametrize("value", [0.9, 3.1, np.nan, np.inf])
def test_values_outside_the_range_are_refused(load: Load, fmi: FmiVersion, value: float) -> None:
    """FMI: the status Discard; nothing has changed."""
    run = Run(load(random_surrogate(SHAPE)), fmi)
    before = PARAMETERS[0].start_value
    assert run.set(mass=value) == DISCARD
    run.native.start()
    assert run.get("mass") == before
    run.step(inputs(1)[0])
    assert run.set(mass=value) == DISCARD
    assert "value reference 13000000" in run.native.messages[-1]
    assert "expected 1 to 3" in run.native.messages[-1]
    assert run.get("mass") == before


def test_value_outside_by_rounding_is_the_end_of_the_range(load: Load) -> None:
    run = Run(load(random_surrogate(SHAPE)), 2)
    assert run.set(mass=3.0000001) == OK
    run.native.start()
    assert run.get("mass") == 3.0


def test_parameters_cannot_be_set_within_a_step(load: Load) -> None:
    loaded, statuses = load(random_surrogate(SHAPE)), []
    place = places(loaded.surrogate, 3)["mass"]

    def watch(_time: float, _may_set: bool) -> None:
        statuses.append(native.set(2.0, first=place))

    native = instance_of(loaded, watch=watch).start()
    assert native.do_step(0.0, 3 * STEP) == OK
    assert statuses == [ERROR] * 3
    assert "set it between communication steps" in native.messages[-1]


@both_standards
def test_saved_state_brings_the_parameters_back(load: Load, fmi: FmiVersion) -> None:
    """To the bit, in another instance too."""
    loaded, rows = load(random_surrogate(SHAPE)), inputs(60)
    run, other = Run(loaded, fmi), Run(loaded, fmi)
    run.native.start()
    other.native.start()
    for row in rows[:20]:
        run.step(row)
    assert run.set(**GIVEN) == OK
    saved = run.native.save()
    expected = [run.step(row) for row in rows[20:]]
    assert run.set(mass=1.1) == OK
    run.step(rows[0])
    for again in (run, other):
        assert again.native.restore(saved) == OK
        again.time = 20 * STEP
        assert [again.get(name) for name in GIVEN] == list(GIVEN.values())
        assert [again.step(row) for row in rows[20:]] == expected


def test_reset_brings_the_start_values_back(load: Load) -> None:
    loaded, rows = load(random_surrogate(SHAPE)), inputs(30)
    run = Run(loaded, 2)
    run.native.start()
    expected = [run.step(row) for row in rows]
    assert run.set(**GIVEN) == OK
    run.step(rows[0])
    assert isinstance(run.native, Native)
    assert run.native.reset() == OK
    run.native.start()
    run.time = 0.0
    assert [run.step(row) for row in rows] == expected
    assert run.get(PARAMETERS_SETTLED) == 1


def slopes(run: Run, knowns: Sequence[str], seed: Sequence[float]) -> FloatArray:
    """All outputs in a direction of some variables."""
    assert isinstance(run.native, Native)
    known = places(run.surrogate, 2)
    unknowns = [known[signal.name] for signal in run.surrogate.outputs]
    found = (ctypes.c_double * len(unknowns))()
    status = run.native.call(
        "fmi2GetDirectionalDerivative",
        run.native.places.references(unknowns),
        ctypes.c_size_t(len(unknowns)),
        run.native.places.references([known[name] for name in knowns]),
        ctypes.c_size_t(len(knowns)),
        (ctypes.c_double * len(seed))(*seed),
        found,
    )
    assert status == OK, run.native.messages
    return np.array(found)


@pytest.mark.parametrize("cell", [SHAPE.cell, GATED])
def test_derivatives_by_parameters_are_those_of_the_settled_response(
    load: Load, cell: CellShape
) -> None:
    loaded = load(random_surrogate(Shape(**{**vars(SHAPE), "cell": cell})))
    run, plain, rows = Run(loaded, 2), Run(loaded, 2), inputs(47)
    surrogate = loaded.surrogate
    for one in (run, plain):
        assert one.set(**GIVEN) == OK
        one.native.start()
    for row in rows:
        run.step(row)
        plain.step(row)
    window = rows[-surrogate.window.n_in :]
    expected = parameter_jacobian(surrogate, window, GIVEN)[-1]
    allowed = SLOPE * np.abs(expected).max()
    for index, parameter in enumerate(surrogate.parameters):
        found = slopes(run, [parameter.name], [1.0])
        assert found == pytest.approx(expected[:, index], abs=allowed)
    both = slopes(run, ["mass", "damping"], [0.5, -2.0])
    assert both == pytest.approx(expected[:, :2] @ [0.5, -2.0], abs=4 * allowed)
    # derivatives change nothing
    assert run.step(rows[0]) == plain.step(rows[0])


def test_derivatives_by_inputs_and_parameters_add_up(load: Load) -> None:
    loaded = load(random_surrogate(SHAPE))
    run = Run(loaded, 2)
    run.native.start()
    for row in inputs(30):
        run.step(row)
    assert run.set(**GIVEN) == OK  # counts from the next step on, not in derivatives of this one
    first = loaded.surrogate.inputs[0].name
    parts = slopes(run, [first], [1.0]) + slopes(run, ["mass"], [0.1])
    assert slopes(run, [first, "mass"], [1.0, 0.1]) == pytest.approx(parts, rel=1e-12)


def test_derivatives_by_other_parameters_are_refused(load: Load) -> None:
    run = Run(load(random_surrogate(SHAPE)), 2)
    run.native.start()
    with refused(AssertionError, "expected inputs", "0 to 1"):
        slopes(run, ["prehistory_known"], [1.0])


def test_adjoint_derivatives_are_the_transpose(load: Load) -> None:
    loaded = load(random_surrogate(SHAPE))
    run, other = Run(loaded, 3), Run(loaded, 2)
    for one in (run, other):
        one.native.start()
        for row in inputs(30):
            one.step(row)
    known = places(loaded.surrogate, 3)
    unknowns = [known[signal.name] for signal in loaded.surrogate.outputs]
    size, found = ctypes.c_size_t, (ctypes.c_double * 1)()
    status = run.native.call(
        "fmi3GetAdjointDerivative",
        run.native.places.references(unknowns),
        size(2),
        run.native.places.references([known["mass"]]),
        size(1),
        (ctypes.c_double * 2)(0.3, -1.0),
        size(2),
        found,
        size(1),
    )
    assert status == OK, run.native.messages
    expected = slopes(other, ["mass"], [1.0]) @ [0.3, -1.0]
    assert found[0] == pytest.approx(expected, rel=1e-9)


@both_standards
def test_importer_sets_parameters_by_name(load: Load, tmp_path: Path, fmi: FmiVersion) -> None:
    """FMPy by its start values, and ``slide_fmu.simulate``."""
    surrogate = random_surrogate(SHAPE)
    path = export_fmu(surrogate, tmp_path / "named.fmu", fmi=fmi)
    rows = np.repeat(inputs(1), 60, axis=0)
    names = [signal.name for signal in surrogate.inputs]
    start = {**GIVEN, **dict(zip(names, rows[0].tolist(), strict=True))}
    result = fmpy.simulate_fmu(
        str(path), stop_time=60 * STEP, output_interval=STEP, start_values=start
    )
    expected = surrogate.predict_newest(rows, GIVEN)[-1]
    outputs = [signal.name for signal in surrogate.outputs]
    assert [result[name][-1] for name in outputs] == pytest.approx(expected, abs=SAME)
    times = STEP * np.arange(61)
    found = simulate(path, times, np.concatenate([rows, rows[:1]]), GIVEN)
    assert found[-1] == pytest.approx(expected, abs=SAME)
    with refused(CoSimulationError, "expected 1 to 3"):
        simulate(path, times, np.concatenate([rows, rows[:1]]), {"mass": 4.0})


def test_description_tells_what_a_parameter_is(load: Load) -> None:
    loaded = load(random_surrogate(SHAPE))
    described = fmpy.read_model_description(str(loaded.path))
    found = {v.name: v for v in described.modelVariables}
    for parameter in loaded.surrogate.parameters:
        variable = found[parameter.name]
        assert (variable.causality, variable.variability) == ("parameter", "tunable")
        assert variable.initial == "exact"
        assert [float(v) for v in (variable.min, variable.max, variable.start)] == [
            parameter.low,
            parameter.high,
            parameter.start_value,
        ]
        assert variable.unit == parameter.unit
    assert found["damping"].description == "It may be negative."
