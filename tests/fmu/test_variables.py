"""The table of variables, and what is made from it."""

from __future__ import annotations

import ctypes
import dataclasses

import pytest

from slide_fmu.fmu.description import generate
from slide_fmu.fmu.description.surrogate_variables import Variable, fmu_variables
from slide_fmu.fmu.description.variables import BY_KEY, KINDS, REFERENCES_PER_KIND
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate, with_span
from tests.fmu.native import ERROR, OK, ExportedFmu, Load, Native
from tests.fmu.native3 import Native3, instance_of
from tests.fmu.samples import CellShape, Shape, random_surrogate

NUMBERS = {
    "INPUT": 0,
    "OUTPUT": 1,
    "ERROR_ESTIMATE": 2,
    "WINDOW_FILLED": 3,
    "ESTIMATE_FILLED": 4,
    "TRUNCATION_ERROR": 5,
    "IN_RANGE": 6,
    "PREHISTORY_KNOWN": 7,
    "INITIAL_INPUT": 8,
    "TIME": 9,
    "OUTPUT_WINDOW": 10,
    "INITIAL_WINDOW": 11,
    "INPUTS_AT_STEP_END": 12,
    "MODEL_PARAMETER": 13,
    "PARAMETERS_SETTLED": 14,
    "ERROR_BOUND": 15,
    "IN_DOMAIN": 16,
    "NOVELTY": 17,
    "BOUND_FILLED": 18,
    "CONFIDENCE": 19,
    "OUTPUTS_IN_RANGE": 20,
    "ERROR_TOLERANCE": 21,
    "TRUSTED": 22,
    "INPUTS_HELD": 23,
    "INITIAL_OUTPUT_WINDOW": 24,
}
"""Of the kinds in released FMUs. New kinds are added here; what is here never changes."""

SHAPES = {
    "layers": Shape(n_inputs=2, n_outputs=2, positions=3),
    "cell": Shape(n_inputs=2, n_outputs=3, cell=CellShape()),
    "one sample": Shape(block=False),
    "parameters": Shape(n_inputs=2, n_outputs=2, cell=CellShape(parameters=3)),
}
SURROGATES = {name: random_surrogate(shape) for name, shape in SHAPES.items()} | {
    "bound": bounded_surrogate(SHAPES["cell"]),
    "bound with estimate": with_span(bounded_surrogate(SHAPES["cell"])),
}


GENERATED = {
    "header": (generate.HEADER, generate.header),
    "page": (generate.PAGE, generate.page),
}


@pytest.mark.parametrize("name", GENERATED)
def test_generated_file_is_that_of_the_table(name: str) -> None:
    path, text = GENERATED[name]
    assert path.read_text("utf-8") == text(), f"run {generate.COMMAND}"


def test_kind_numbers_are_those_of_released_fmus() -> None:
    assert {kind.key: kind.number for kind in KINDS} == NUMBERS
    assert REFERENCES_PER_KIND == 1_000_000
    assert [kind.number for kind in KINDS] == sorted(set(NUMBERS.values()))


def test_value_reference_out_of_room_is_refused() -> None:
    last = REFERENCES_PER_KIND - 1
    assert BY_KEY["OUTPUT"].reference(last) == REFERENCES_PER_KIND + last
    for index in (-1, REFERENCES_PER_KIND):
        with pytest.raises(ValueError, match=f"index {index}; expected 0 to {last}"):
            BY_KEY["OUTPUT"].reference(index)


def test_descriptions_are_whole_sentences() -> None:
    for kind in KINDS:
        for text in (kind.text, kind.text_fmi_3):
            assert text == "" or (text[0].isupper() and text.endswith(".")), kind.key


def test_value_references_stay_when_a_surrogate_grows() -> None:
    """More inputs and outputs, an estimator, another family, another standard: none moves one."""
    small, large = (
        random_surrogate(shape)
        for shape in (
            Shape(),
            Shape(n_inputs=3, n_outputs=2, positions=3, cell=CellShape()),
        )
    )
    few = {v.name: v.reference for v in fmu_variables(small)}
    for fmi in (2, 3):
        many = {v.name: v.reference for v in fmu_variables(large, fmi)}
        assert few.items() < many.items()
    without = fmu_variables(dataclasses.replace(large, estimator=None))
    assert {v.name: v.reference for v in without}.items() < many.items()


def _get(native: Native | Native3, variable: Variable, function: str) -> tuple[int, list[float]]:
    size, of_bytes = variable.size or 1, function == "fmi3GetBoolean"
    forms = {"fmi2GetBoolean": ctypes.c_int, "fmi3GetBoolean": ctypes.c_bool}
    values = (forms.get(function, ctypes.c_double) * size)(*[of_bytes] * size)
    references = (ctypes.c_uint * 1)(variable.reference)
    count = () if isinstance(native, Native) else (ctypes.c_size_t(size),)
    status = native.call(function, references, ctypes.c_size_t(1), values, *count)
    return status, [float(value) for value in values]


def _instance(loaded: ExportedFmu, fmi: FmiVersion) -> Native | Native3:
    if fmi == 2:
        return loaded.instance().start()
    return instance_of(loaded).start()


@pytest.mark.parametrize("surrogate", SURROGATES.values(), ids=SURROGATES)
@pytest.mark.parametrize("fmi", [2, 3])
def test_library_knows_the_variables_of_the_table_and_no_others(
    load: Load, surrogate: Surrogate, fmi: FmiVersion
) -> None:
    loaded = load(surrogate)
    native = _instance(loaded, fmi)
    getters = {
        "Real": "fmi2GetReal" if fmi == 2 else "fmi3GetFloat64",
        "Boolean": f"fmi{fmi}GetBoolean",
    }
    variables = fmu_variables(loaded.surrogate, fmi)
    for variable in variables:
        for name, getter in getters.items():
            status, _ = _get(native, variable, getter)
            assert status == (OK if name == variable.type else ERROR), variable.name
            if status == ERROR:
                assert f"is of type {variable.type}" in native.messages[-1]
                assert f"expected {name}" in native.messages[-1]
    known = {variable.reference for variable in variables}
    for kind in range(len(KINDS) + 2):
        for index in range(5):
            reference = kind * REFERENCES_PER_KIND + index
            if reference not in known:
                wrong = dataclasses.replace(variables[0], reference=reference)
                assert {_get(native, wrong, getter)[0] for getter in getters.values()} == {ERROR}
                assert f"no variable has the value reference {reference}" in native.messages[-1]


@pytest.mark.parametrize("fmi", [2, 3])
def test_inputs_in_range_is_true_or_false(load: Load, fmi: FmiVersion) -> None:
    loaded = load(random_surrogate(Shape()))
    native = _instance(loaded, fmi)
    (in_range,) = (v for v in fmu_variables(loaded.surrogate) if v.kind.key == "IN_RANGE")
    assert _get(native, in_range, f"fmi{fmi}GetBoolean") == (OK, [1.0])
    assert native.set(1e3) == native.do_step(0.0) == OK
    assert _get(native, in_range, f"fmi{fmi}GetBoolean") == (OK, [0.0])


@pytest.mark.parametrize("fmi", [2, 3])
def test_booleans_cannot_be_set(load: Load, fmi: FmiVersion) -> None:
    native = _instance(load(random_surrogate(Shape())), fmi)
    form = ctypes.c_int if fmi == 2 else ctypes.c_bool
    references, values = (ctypes.c_uint * 1)(6_000_000), (form * 1)(True)
    n = ctypes.c_size_t(1)
    count = () if fmi == 2 else (n,)
    assert native.call(f"fmi{fmi}SetBoolean", references, n, values, *count) == ERROR
    assert "value reference 6000000 is no input" in native.messages[-1]
