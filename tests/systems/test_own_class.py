"""What a class of the user says of itself and gives: every mistake is told by file and remedy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.signals import Signal
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.loading import describe_model, load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification
from tests.refusals import refused

PUMP = """
import numpy as np
import slide_fmu as slide


class Pump(slide.System):
    def __init__(self, *, step=0.1, speed=1.0):
        self.step = step
        self.inputs = (slide.Signal("u", "N", -1.0, 1.0),)
        self.outputs = (slide.Signal("y", "m", -1.0, 1.0),)

    def simulate(self, inputs):
        return np.concatenate([np.zeros((1, 1)), 0.5 * inputs])
"""

INPUTS = '        self.inputs = (slide.Signal("u", "N", -1.0, 1.0),)\n'
RESULT = "np.concatenate([np.zeros((1, 1)), 0.5 * inputs])"


def written(folder: Path, old: str, new: str) -> str:
    """Write the pump with a mistake, and give its path."""
    assert old in PUMP
    place = folder / "pump.py"
    place.write_text(PUMP.replace(old, new), encoding="utf-8")
    return str(place)


@pytest.mark.parametrize(
    ("old", "new", "found", "expected"),
    [
        (INPUTS, "", "pump.py).inputs is None", "expected a tuple of slide_fmu.Signal"),
        (INPUTS, '        self.inputs = ("u",)\n', ".inputs is ('u',)", "expected a tuple"),
        ('"y"', '"u"', "share the names ['u']", "expected a name of its own for each"),
        ("= step\n", "= str(step)\n", ".step is '0.1'", "take an argument `step`"),
        ("= step\n", "= -step\n", ".step is -0.1", "take an argument `step`"),
        ("= step\n", "= step\n        raise ValueError('größer')\n", "größer", "pump.py, line 9)"),
        ('"m", -1.0', '"m", "-1.0"', "'y': low '-1.0'; expected a number", "pump.py, line 10)"),
    ],
)
def test_class_with_a_mistake_in_what_it_says_of_itself_is_refused(
    tmp_path: Path, old: str, new: str, found: str, expected: str
) -> None:
    model = written(tmp_path, old, new)
    with refused(LoadError, found, expected):
        describe_model(model)
    with refused(LoadError, found, expected):
        load_system(Specification(f"{model}:Pump", step=0.1))


def test_ranges_of_a_class_may_be_numbers_of_numpy(tmp_path: Path) -> None:
    found = describe_model(written(tmp_path, '"m", -1.0, 1.0', '"m", np.int64(-1), np.float32(1)'))
    assert found.outputs["y"].range == (-1.0, 1.0)


def test_class_whose_default_step_is_negative_is_refused(tmp_path: Path) -> None:
    model = written(tmp_path, "step=0.1", "step=-0.1")
    with refused(LoadError, ".step is -0.1; expected", "a positive number"):
        describe_model(model)


@pytest.mark.parametrize(
    ("result", "found", "expected"),
    [
        ("None", "Pump.simulate gave NoneType", "expected an array of numbers of shape (5, 1)"),
        (f"{RESULT} + 1j", "gave ndarray (of type complex128", "expected an array"),
        ("inputs.fill(0.0)", "raised ValueError", "pump.py, line 13)"),
    ],
)
def test_outputs_that_are_none_and_inputs_that_are_overwritten_are_refused(
    tmp_path: Path, result: str, found: str, expected: str
) -> None:
    model = written(tmp_path, RESULT, result)
    inputs = np.full((4, 1), 0.5)
    with refused(SimulationError, found, expected):
        simulate(load_system(Specification(f"{model}:Pump", step=0.1)), inputs)
    inputs[:] = 0.0  # whoever simulates may go on with its inputs


def test_parameter_with_a_slip_of_the_pen_has_a_suggestion(tmp_path: Path) -> None:
    model = written(tmp_path, "speed", "speed")
    message = r"unknown parameters \['sped'\]; .*: correct or remove them; did you mean 'speed'\?"
    with pytest.raises(LoadError, match=message):
        load_system(Specification(f"{model}:Pump", parameters={"sped": 2.0}, step=0.1))


def test_file_in_a_folder_whose_name_begins_as_this_package_is_the_users(tmp_path: Path) -> None:
    import slide_fmu.systems.user_code as user_code

    package = Path(user_code.__file__).parents[1]
    assert user_code._is_users(f"{package}_models/pump.py")
    assert not user_code._is_users(f"{package}/core/signals.py")
    assert not user_code._is_users("<string>")


@pytest.mark.parametrize("value", ["1", True, None, 1j])
def test_signal_whose_range_is_no_number_is_refused(value: object) -> None:
    with refused((ValueError, TypeError), "low"):
        Signal("y", "m", value, 2.0)  # type: ignore[arg-type]
