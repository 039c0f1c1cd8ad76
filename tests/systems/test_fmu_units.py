"""Units of FMUs by their definitions, and inputs that are no real numbers."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.core.units import unit_of_bases
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.fmu.model import describe
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification
from tests.own_models.strict_lag import build_strict_lag
from tests.refusals import refused
from tests.systems.test_fmu_refusals import changed

OTHERS = """<ScalarVariable name="gear" valueReference="7" causality="input">
    <Integer start="1"/></ScalarVariable>
    <ScalarVariable name="mode" valueReference="8" causality="input">
    <String start="a"/></ScalarVariable>
  </ModelVariables>"""


def lag_with(folder: Path, **replaced: str) -> str:
    return changed(str(build_strict_lag(folder / "made.fmu")), folder / "lag.fmu", **replaced)


def in_unit(folder: Path, definition: str) -> str:
    """The lag's drive is in a unit of its own."""
    unit = f'<UnitDefinitions><Unit name="own">{definition}</Unit></UnitDefinitions>'
    words = {'<Real start="0"': '<Real unit="own" start="0"', "<DefaultExp": f"{unit}<DefaultExp"}
    return lag_with(folder, **words)


def test_unit_of_an_fmu_is_known_by_its_base_units(tmp_path: Path) -> None:
    fmu = in_unit(tmp_path, '<BaseUnit kg="1" m="1" s="-2" factor="1000"/>')
    found = describe(fmu)
    assert found.inputs["drive"].unit == "kN"
    assert "unit 'own' of drive is kN, by its definition" in found.remarks
    assert load_system(Specification(fmu, {}, 0.02, "fmu")).inputs[0].unit == "kN"


@pytest.mark.parametrize("definition", ["", '<BaseUnit kg="1" m="2" s="-2" factor="1.356"/>'])
def test_unit_that_nobody_knows_is_remarked(tmp_path: Path, definition: str) -> None:
    found = describe(in_unit(tmp_path, definition))
    assert found.inputs["drive"].unit is None
    assert any("unit 'own' of drive is not known here" in each for each in found.remarks)


@pytest.mark.parametrize(
    ("exponents", "factor", "offset", "unit"),
    [
        ({"K": 1}, 1.0, 273.15, "degC"),
        ({"rad": 1, "s": -1}, 0.1047198, 0.0, "rpm"),
        ({"kg": 1, "m": 2, "s": -3}, 1.0, 0.0, "W"),
        ({"kg": 1, "s": -1}, 1.0, 0.0, "kg/s"),
        ({"s": -2, "m": 0}, 1.0, 0.0, "1/s2"),
        ({"m": 1}, 0.3, 0.0, None),
        ({}, 1.0, 0.0, None),
    ],
)
def test_base_units_find_a_symbol_or_their_product(
    exponents: dict[str, int], factor: float, offset: float, unit: str | None
) -> None:
    assert unit_of_bases(exponents, factor, offset) == unit


def test_inputs_of_other_types_are_named_with_their_types(tmp_path: Path) -> None:
    found = describe(lag_with(tmp_path, **{"</ModelVariables>": OTHERS}))
    assert list(found.inputs) == ["drive"]
    assert any("gear (Integer), mode (String)" in remark for remark in found.remarks)


def test_fmu_without_a_real_input_is_refused_by_the_types_that_it_has(tmp_path: Path) -> None:
    drive = {'<Real start="0" min="-1" max="1"/>': '<Integer start="0"/>'}
    fmu = lag_with(tmp_path, **drive)
    for look in (describe, lambda path: load_system(Specification(path, {}, 0.02, "fmu"))):
        with refused(LoadError, "has no real input", "drive is Integer"):
            look(fmu)
