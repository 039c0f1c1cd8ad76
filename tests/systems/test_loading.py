"""Systems by name."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from mbs_models.oscillators.oscillators import DuffingOscillator
from slide_fmu.systems.base import LoadError, Parameter, System
from slide_fmu.systems.loading import KINDS, load_system


def test_system_is_loaded_by_name_with_its_parameters() -> None:
    system = load_system("mbs_models.oscillators:DuffingOscillator", {"step": 0.01, "mass": 2})
    assert isinstance(system, DuffingOscillator)
    assert system.step == 0.01


@pytest.mark.parametrize(
    ("model", "parameters", "message"),
    [
        ("mbs_models.oscillators", {}, "expected 'package.module:Class'"),
        (":DuffingOscillator", {}, "expected 'package.module:Class'"),
        ("mbs_models.missing:Model", {}, "'mbs_models.missing' cannot be imported"),
        ("my_model:Model", {}, "installed module, or one in a folder on PYTHONPATH"),
        ("mbs_models.oscillators:Missing", {}, "expected one of .*'LinearOscillator'"),
        ("mbs_models.oscillators:System", {}, "not a reference system"),
        ("mbs_models.oscillators:Signal", {}, "not a reference system"),
        ("mbs_models.oscillators:LinearOscillator", {"alpha": 1.0}, "unknown parameters"),
        ("mbs_models.oscillators:LinearOscillator", {"mass": -1.0}, "mass = -1.0; expected"),
        ("mbs_models.oscillators:LinearOscillator", {"mass": "one"}, "mass"),
    ],
)
def test_mistake_in_a_name_or_parameter_is_named(
    model: str, parameters: dict[str, float], message: str
) -> None:
    with pytest.raises(LoadError, match=message):
        load_system(model, parameters)


def test_load_system_of_unknown_kind_lists_the_kinds() -> None:
    with pytest.raises(LoadError, match=r"kind of system 'record'; expected one of \['class'\]"):
        load_system("record.csv", {}, kind="record")


def test_a_registered_kind_is_loaded_with_model_and_parameters(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []

    def system_of_record(model: str, parameters: Mapping[str, Parameter]) -> System:
        asked.append((model, dict(parameters)))
        return DuffingOscillator(step=0.02)

    monkeypatch.setitem(KINDS, "record", system_of_record)
    system = load_system("record.csv", {"step": 0.02}, kind="record")
    assert (system.step, asked) == (0.02, [("record.csv", {"step": 0.02})])
