"""Models of the kind "function": what a user's file says becomes a reference system."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.systems.base import System
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.function.model import describe
from slide_fmu.systems.function.record import RecordSystem
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification
from tests.refusals import refused
from tests.systems.function_models import specifications as models

LAG = """
inputs = {"u": {"unit": "1", "range": [-1, 1]}}
outputs = {"y": {"unit": "1", "range": [-1, 1]}}
parameters = {"rate": 2.0}
start = [0.0]

def f(x, u, p):
    return [p.rate * (u[0] - x[0])]

def g(x, u, p):
    return [x[0]]
"""
"""A first-order lag whose lines the tests change."""

RECORD = """
inputs = {"u": {"unit": "1", "range": [-1, 1]}}
outputs = {"y": {"unit": "1", "range": [-1, 1]}}

def simulate(t, u, p):
    return u
"""


def written(folder: Path, text: str) -> Specification:
    """The specification of a model with this text, in a file of its own."""
    path = folder / "model.py"
    path.write_text(text, encoding="utf-8")
    return Specification(str(path), {}, 0.1, "function")


def loaded(folder: Path, text: str) -> System:
    return load_system(written(folder, text))


def test_lag_follows_its_exact_response(tmp_path: Path) -> None:
    system = loaded(tmp_path, LAG)
    inputs = np.random.default_rng(0).uniform(-1, 1, (50, 1))
    kept, exact = np.exp(-0.2), [inputs[0, 0]]  # at rest under the first input
    for u in inputs[:, 0]:
        exact.append(kept * exact[-1] + (1 - kept) * u)
    assert system.simulate(inputs)[:, 0] == pytest.approx(exact, abs=1e-6)


def test_lag_under_a_first_order_hold_follows_the_ramps(tmp_path: Path) -> None:
    system = loaded(tmp_path, f"{LAG}\nhold = 'first_order'\n")
    assert system.inputs[0].hold == "first_order"
    inputs = np.random.default_rng(1).uniform(-1, 1, (50, 1))
    kept, exact, last = np.exp(-0.2), [inputs[0, 0]], inputs[0, 0]
    for u in inputs[:, 0]:
        slope = (u - last) / 0.1  # of the ramp, which the lag follows late by 1 / rate
        exact.append((exact[-1] - last + slope / 2) * kept + u - slope / 2)
        last = u
    assert system.simulate(inputs)[:, 0] == pytest.approx(exact, abs=1e-6)


def test_rates_of_the_inputs_are_those_of_the_ramp(tmp_path: Path) -> None:
    text = LAG.replace("f(x, u, p)", "f(x, u, p, du)").replace("g(x, u, p)", "g(x, u, p, du)")
    text = text.replace("p.rate * (u[0] - x[0])", "du[0]").replace("[x[0]]", "[x[0] - u[0]]")
    system = loaded(tmp_path, f"{text}\nhold = 'first_order'\nstart = lambda u, p: u\n")
    inputs = np.random.default_rng(2).uniform(-1, 1, (20, 1))
    assert system.simulate(inputs) == pytest.approx(np.zeros((21, 1)), abs=1e-9)


def test_model_of_second_order_starts_in_its_equilibrium() -> None:
    system = load_system(models.quarter_car())
    outputs = system.simulate(np.full((5, 1), 0.03))
    assert outputs == pytest.approx(np.zeros((6, 3)), abs=1e-6)


def test_same_inputs_give_the_same_bytes_whatever_was_simulated_before() -> None:
    system = load_system(models.quarter_car())
    inputs = np.random.default_rng(3).uniform(-0.02, 0.02, (30, 1))
    first = system.simulate(inputs)
    system.simulate(-inputs)
    assert system.simulate(inputs).tobytes() == first.tobytes()


def test_simulation_goes_on_from_a_saved_state_to_the_byte() -> None:
    system = load_system(models.quarter_car())
    assert isinstance(system, FunctionSystem)
    inputs = np.random.default_rng(4).uniform(-0.02, 0.02, (30, 1))
    whole = system.simulate(inputs)
    system.simulate(inputs[:10])
    state = system.get_state()
    system.simulate(-inputs)
    rest = simulate(system, inputs[10:], state).outputs
    assert rest[1:].tobytes() == whole[11:].tobytes()


def test_linearization_has_the_derivatives_of_the_equations() -> None:
    system = load_system(models.thermal_masses())
    assert isinstance(system, FunctionSystem)
    state = system.rest_state(np.array([200.0, 50.0]))
    lost = 1.0 + 4 * 2e-9 * state.coordinates**3
    conducted = 2.0 * np.array([[-1, 1, 0], [1, -2, 1], [0, 1, -1]])
    exact = (conducted - np.diag(lost)) / 400.0
    assert system.linearize(state).matrix == pytest.approx(exact, rel=1e-7, abs=1e-12)
    balance = np.array([200.0, 0.0, 50.0]) - (state.coordinates - 293.0)
    balance -= 2e-9 * (state.coordinates**4 - 293.0**4)
    assert balance + conducted @ state.coordinates == pytest.approx(np.zeros(3), abs=1e-5)


def test_whole_simulation_gets_what_has_acted_until_each_time() -> None:
    system = load_system(models.first_order_lag(gain=1.5))
    assert isinstance(system, RecordSystem)
    inputs = np.random.default_rng(5).uniform(-1, 1, (40, 1))
    kept, exact = np.exp(-0.1), [1.5 * inputs[0, 0]]
    for u in inputs[:, 0]:
        exact.append(kept * exact[-1] + (1 - kept) * 1.5 * u)
    assert system.simulate(inputs)[:, 0] == pytest.approx(exact, abs=1e-12)


def test_whole_simulation_sees_ramps_as_interp_reads_them(tmp_path: Path) -> None:
    system = loaded(tmp_path, f"{RECORD}\nhold = 'first_order'\n")
    inputs = np.array([[0.5], [0.7], [-0.1]])
    assert system.simulate(inputs)[:, 0].tolist() == [0.5, 0.5, 0.7, -0.1]


def test_unstable_position_is_not_taken_for_rest() -> None:
    specification = models.bistable()
    system = load_system(specification)
    assert isinstance(system, FunctionSystem)
    pushed = system.rest_state(np.array([10.0])).coordinates
    assert pushed[0] > 1
    assert pushed[1] == pytest.approx(0.0, abs=1e-8)
    assert system.remarks == ()


def test_system_without_equilibrium_starts_where_it_says_and_remarks_that() -> None:
    system = load_system(models.integrator())
    assert isinstance(system, FunctionSystem)
    assert system.rest_state(np.array([0.5])).coordinates.tolist() == [0.0]
    assert "no stable equilibrium was found from start = [0.0]" in system.remarks[0]
    assert system.linearize(system.get_state()).matrix.tolist() == [[0.0]]


def test_stiff_method_gives_the_same_motion(tmp_path: Path) -> None:
    text = LAG.replace('"rate": 2.0', '"rate": 500.0')
    inputs = np.random.default_rng(6).uniform(-1, 1, (10, 1))
    plain = loaded(tmp_path, text).simulate(inputs)
    (tmp_path / "stiff").mkdir()
    stiff = loaded(tmp_path / "stiff", f"{text}\nmethod, rtol = 'LSODA', 1e-8\n")
    assert stiff.simulate(inputs) == pytest.approx(plain, abs=1e-5)


def test_description_says_what_the_file_declares() -> None:
    path = models.TUTORIALS / "quarter_car_function.py"
    found = describe(str(path))
    assert (found.kind, found.model, found.step) == ("function", str(path), None)
    assert found.inputs == {"road": SignalTable(unit="m", hold="first_order")}
    assert [(name, table.unit) for name, table in found.outputs.items()] == [
        ("body_acceleration", "m/s^2"),
        ("suspension_travel", "m"),
        ("tyre_deflection", "m"),
    ]
    assert ("body_mass", 300.0) in [(p.name, p.value) for p in found.parameters]


def test_description_has_the_ranges_and_the_step_that_the_file_gives(tmp_path: Path) -> None:
    found = describe(written(tmp_path, f"{LAG}\nstep = 0.25\n").model)
    assert found.inputs == {"u": SignalTable(unit="1", range=(-1, 1))}
    assert found.step == 0.25


def test_step_of_the_model_serves_where_the_recipe_has_none(tmp_path: Path) -> None:
    specification = replace(written(tmp_path, f"{LAG}\nstep = 0.25\n"), step=None)
    assert load_system(specification).step == 0.25


def test_parameters_of_the_recipe_replace_those_of_the_model() -> None:
    heavy, light = (load_system(models.quarter_car(body_mass=m)) for m in (500, 250))
    road = np.concatenate([np.zeros((1, 1)), np.full((20, 1), 0.02)])
    assert heavy.simulate(road)[5, 0] < light.simulate(road)[5, 0]


MISTAKES = [
    ("def f", "def other", "neither f nor simulate", "expected f"),
    ("def g", "def simulate(t, u, p): ...\ndef g", "defines f and simulate", "expected"),
    ("start = [0.0]", "", "does not define start", "expected inputs, outputs, g, start"),
    ("[0.0]", "[[0.0]]", "start is [[0.0]]", "list of finite numbers"),
    ("[0.0]", "['a']", "start gave ['a'], of type <U1", "list of numbers"),
    ("[0.0]", "lambda u: [0.0]", "start(u)", "expected start(u, p)"),
    ("f(x, u, p)", "f(x, u)", "f(x, u)", "expected f(x, u, p) or f(x, u, p, du)"),
    ("f(x, u, p)", "f(t, x, u)", "f(t, x, u) asks for the time", "expected f(x, u, p)"),
    ("g(x, u, p)", "g(u, x, p)", "has u, x at another place", "expected g(x, u, p)"),
    ("f(x, u, p)", "f(x, u, p, du)", "f takes du", "these inputs are held"),
    ("p.rate", "p.speed", "no parameter 'speed'; expected one of ['rate']", "model.py, line 8"),
    ("p.rate", "p['rate']", "p['rate']; expected p.rate", "model.py, line 8"),
    ("[p.rate", "[0, p.rate", "of shape (2,)", "expected 1 numbers"),
    ("return [x[0]]", "pass", "g gave None, of type object", "expected 1 numbers"),
    ("return [x[0]]", "return [1j]", "g gave [1j], of type complex128", "expected"),
    ("[x[0]]", "[x[0] / 0 * 0]", "g gave [nan]", "expected finite numbers"),
    ("[x[0]]", "[[1.0], 2.0]", "g gave [[1.0], 2.0]", "expected 1 numbers"),
    ("return [x[0]]", "x[0] = 1; return x", "g raised ValueError", "read-only"),
    ('{"rate": 2.0}', "[2.0]", "parameters = [2.0]", "expected a table of keys and values"),
    ('{"rate": 2.0}', '{"rate": [2.0]}', "parameters.rate = [2.0]", "expected a number"),
    ('{"u": {', '{"u": {"low": 1, ', "inputs.u.low = 1 is not a known key", "'range'"),
    ('{"u": {', '{"u": {"column": "a", ', "['u'] name columns", "expected none"),
    ('"range": [-1, 1]', '"range": 3', "inputs.u.range = 3", "expected [LOW, HIGH]"),
    ('"range": [-1, 1]', '"range": [1, -1]', "inputs.u.range = [1, -1]", "smaller one first"),
    ('"range": [-1, 1]', '"start": 0.0', "input 'u' has no range", "system.inputs.u.range"),
    ('"range": [-1, 1]', '"hold": "ramp"', "inputs.u.hold = 'ramp'", "expected 'zero_order'"),
    ('"u"', "3", "inputs.3 = 3", "expected a text"),
    ("start", "step = -1\nstart", "step = -1", "expected more than 0"),
    ("start", "method = 'Euler'\nstart", "method = 'Euler'", "'LSODA'"),
    ("start", "rtol = 0\nstart", "rtol = 0", "expected a positive number"),
    ("start", "hold = 'ramp'\nstart", "inputs.u.hold = 'ramp'", "or 'first_order'"),
    ("start", "start(", "SyntaxError", "correct the model"),
    ("start", "raise SystemExit(3)\nstart", "SystemExit: 3", "model.py, line 5); correct"),
    ("return [p.rate", "raise SystemExit\n    return [p.rate", "f raised SystemExit", "correct"),
]
"""What is replaced in the lag, by what, and two key words of what is then said."""


@pytest.mark.parametrize(("old", "new", "found", "expected"), MISTAKES)
def test_mistake_in_a_model_is_named(
    tmp_path: Path, old: str, new: str, found: str, expected: str
) -> None:
    assert old in LAG
    with refused(LoadError, found, expected):
        loaded(tmp_path, LAG.replace(old, new, 1))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"speed": 1.0}, r"unknown parameters \['speed'\]; expected some of \['rate'\]"),
        ({"rate": "fast"}, "parameter rate = 'fast'; expected the type of the model's value, 2.0"),
    ],
)
def test_mistake_in_a_parameter_of_the_recipe_is_named(
    tmp_path: Path, given: dict[str, float], message: str
) -> None:
    with pytest.raises(LoadError, match=message):
        load_system(replace(written(tmp_path, LAG), parameters=given))


CHOSEN = {"c": SignalTable(range=(-9.0, 9.0)), "a": SignalTable(range=(-9.0, 9.0))}
THREE = {
    "equations": LAG.replace("return [x[0]]", "return [x[0], 2 * x[0], 3 * x[0]]"),
    "record": RECORD.replace("return u", "return u * [1.0, 2.0, 3.0]"),
}


@pytest.mark.parametrize("kind", THREE)
def test_outputs_that_the_recipe_names_are_those_of_the_system(tmp_path: Path, kind: str) -> None:
    text = THREE[kind].replace(
        '"y": {"unit": "1", "range": [-1, 1]}', '"a": "m", "b": "m", "c": "m"'
    )
    system = load_system(replace(written(tmp_path, text), outputs=CHOSEN))
    assert [signal.name for signal in system.outputs] == ["c", "a"]
    outputs = system.simulate(np.full((4, 1), 0.5))
    assert outputs == pytest.approx(np.tile([1.5, 0.5], (5, 1)), abs=1e-6)


def test_model_gives_all_its_outputs_also_where_the_recipe_has_fewer(tmp_path: Path) -> None:
    text = LAG.replace('"y": {"unit": "1", "range": [-1, 1]}', '"a": "m", "b": "m", "c": "m"')
    with refused(LoadError, "expected 3 columns", "shape (1,)"):
        load_system(replace(written(tmp_path, text), outputs=CHOSEN))


def test_name_behind_a_colon_is_refused(tmp_path: Path) -> None:
    specification = written(tmp_path, LAG)
    with refused(LoadError, "expected the file", "'f' behind the"):
        load_system(replace(specification, model=f"{specification.model}:f"))


@pytest.mark.parametrize(
    ("old", "new", "found", "expected"),
    [
        (
            "return [p.rate * (u[0] - x[0])]",
            "if x[0] > 0.5: raise KeyError('far')\n    return [p.rate * (u[0] - x[0])]",
            "f raised KeyError: 'far'",
            "model.py, line 8)",
        ),
        ("p.rate * (u[0] - x[0])", "1.0 + x[0]**2", "DOP853 gives up ", "expected motions that"),
        ("return [x[0]]", "return [x[0]] if x[0] < 0.5 else None", "g gave None", "1 numbers"),
        ("[x[0]]", "[x[0] if x[0] < 0.5 else float('inf')]", "g gave [inf]", "finite numbers"),
    ],
)
def test_failure_on_the_way_names_sample_time_state_and_input(
    tmp_path: Path, old: str, new: str, found: str, expected: str
) -> None:
    assert old in LAG
    system = loaded(tmp_path, LAG.replace(old, new))
    inputs = np.concatenate([np.zeros((3, 1)), np.ones((40, 1))])
    with pytest.raises(SimulationError, match=r"^in sample \d+ \(t = [\d.]+ s\) under") as raised:
        system.simulate(inputs)
    for word in (found, expected, "with x = [", "u = [1.0]"):
        assert word in str(raised.value)
    assert raised.value.time is not None
    assert 0.3 <= raised.value.time < 4.3


def test_rounding_brings_no_input_out_of_its_range() -> None:
    """Where an input arrives at an end of its range, f is asked for that end exactly."""
    seen: list[float] = []

    def f(x: Any, u: Any, p: Any) -> list[float]:
        seen.append(float(u[0]))
        return [u[0] - x[0]]

    signal = Signal("drive", "m", -0.66, 5.42, hold="first_order")
    lag = FunctionSystem(
        f,
        lambda x, u, p: [x[0]],
        inputs=[signal],
        outputs=[Signal("level", "m", -1.0, 6.0)],
        start=[0.0],
        step=0.07,
    )
    rng = np.random.default_rng(0)
    inputs = np.where(np.arange(200) % 2, rng.choice([-0.66, 5.42], 200), rng.uniform(0, 1, 200))
    lag.simulate(inputs[:, None])
    assert (min(seen), max(seen)) == (-0.66, 5.42)


def test_step_that_is_only_tried_may_leave_where_f_is_defined(tmp_path: Path) -> None:
    """A tank that runs empty fast: a first try over the whole sample ends below zero."""
    text = LAG.replace("p.rate * (u[0] - x[0])", "-200 * math.sqrt(x[0]) + 20 * u[0]")
    text = text.replace("[-1, 1]", "[0.5, 1]", 1)  # it never runs empty for good
    system = loaded(tmp_path, f"import math\n{text}\nstart = [1.0]\n")
    outputs = system.simulate(np.array([[1.0], [1.0], [0.9]]))
    assert outputs[-1, 0] == pytest.approx(0.0081, rel=1e-3)


@pytest.mark.parametrize("method", ["DOP853", "LSODA", "Radau"])
def test_step_that_fails_says_what_f_raised_on_the_way(tmp_path: Path, method: str) -> None:
    text = LAG.replace("p.rate * (u[0] - x[0])", "-1 - math.sqrt(x[0])")
    system = loaded(tmp_path, f"import math\n{text}\nstart = [1.0]\nmethod = {method!r}\n")
    raised = (
        r"f raised ValueError: .*\(.*model.py, line 9\), [\d.e-]+ s after the sample with x = "
    )
    after = r"\[-[\d.e-]+\], u = \[0.0\]; .* gives up .* check f"
    with pytest.raises(SimulationError, match=r"^in sample \d+ \(t = .*" + raised + after):
        system.simulate(np.zeros((40, 1)))


@pytest.mark.parametrize(
    ("result", "found", "expected"),
    [
        ("u[1:]", "simulate gave an array of shape (4, 1)", "expected (5, 1): a row for"),
        ("None", "simulate gave None, of type object", "expected an array"),
        ("u / 0", "simulate gave output 'y' = inf 1 in sample 0 (t = 0 s)", "finite numbers"),
        ("p.none", "simulate raised AttributeError", "model.py, line 6)"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero", "ignore:invalid value")
def test_mistake_in_a_whole_simulation_is_named(
    tmp_path: Path, result: str, found: str, expected: str
) -> None:
    system = loaded(tmp_path, RECORD.replace("return u", f"return {result}"))
    with refused(SimulationError, found, expected):
        simulate(system, np.full((4, 1), 0.5))


def test_input_that_is_none_is_refused() -> None:
    system = load_system(models.integrator())
    assert isinstance(system, FunctionSystem)
    with refused(ValueError, "input inflow = [nan]", "expected finite numbers, shape (1,)"):
        system.advance(np.array([np.nan]))
    state = system.get_state()
    with refused(ValueError, "state coordinates = [0. 0.]", "shape (1,)"):
        system.set_state(replace(state, coordinates=np.zeros(2)))


@pytest.mark.extended
@pytest.mark.parametrize(
    ("rate", "method", "remarked"),
    [(2.0, "DOP853", False), (1e4, "DOP853", True), (1e4, "LSODA", False)],
)
def test_stiff_model_of_an_explicit_method_has_a_remark(
    tmp_path: Path, rate: float, method: str, remarked: bool
) -> None:
    text = LAG.replace('"rate": 2.0', f'"rate": {rate}') + f"method = {method!r}\n"
    system = loaded(tmp_path, text)
    simulate(system, np.random.default_rng(0).uniform(-1, 1, (120, 1)))
    assert bool(system.remarks) == remarked
    if remarked:
        (remark,) = system.remarks
        assert remark.startswith("DOP853 calls f ")
        assert 'by method = "LSODA" in the file' in remark
