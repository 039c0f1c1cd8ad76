"""Systems by name."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from mbs_models.oscillators.oscillators import DuffingOscillator
from slide_fmu.core.search_path import make_importable
from slide_fmu.data.trajectories import values_of_draws
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.systems.base import System
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.loading import KINDS, describe_model, load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification
from tests.recipes import tiny_recipe
from tests.refusals import refused


def test_system_is_loaded_by_name_with_its_parameters() -> None:
    system = load_system(
        Specification("mbs_models.oscillators:DuffingOscillator", {"mass": 2}, 0.01)
    )
    assert isinstance(system, DuffingOscillator)
    assert system.step == 0.01


@pytest.mark.parametrize(
    ("model", "parameters", "found", "expected"),
    [
        ("mbs_models.oscillators", {}, "expected", "'package.module:Class'"),
        ("mbs_models.oscillators", {}, "has another system.kind", "function, exudyn or fmu"),
        ("mbs_models.oscillators/LinearOscillator", {}, "expected", "'package.module:Class'"),
        ("../oscillators:LinearOscillator", {}, "'../oscillators' is no", "name of a module"),
        ("README.md:LinearOscillator", {}, "'README.md' is no", "name of a module"),
        (
            "swing/pendulum.slx",
            {},
            "a file of Simulink",
            "export the model from Simulink as an FMU",
        ),
        ("pendulum.mo", {}, "'pendulum.mo' is a file of Modelica by its name", "expected an FMU"),
        (":DuffingOscillator", {}, "expected", "'package.module:Class'"),
        ("mbs_models.missing:Model", {}, "'mbs_models.missing'", "cannot be imported"),
        ("my_model:Model", {}, "installed module, or one", "in the recipe's folder"),
        ("mbs_models.oscillators:Missing", {}, "expected one of", "'LinearOscillator'"),
        ("mbs_models.oscillators:System", {}, "there is no 'System'", "expected one of"),
        (
            "mbs_models.oscillators:Signal",
            {},
            "there is no 'Signal'",
            "expected one of",
        ),
        ("mbs_models.oscillators:LinearOscilator", {}, "did you mean", "'LinearOscillator'"),
        ("mbs_models.oscillators:LinearOscillator", {"alpha": 1.0}, "unknown", "parameters"),
        ("mbs_models.oscillators:LinearOscillator", {"mass": -1.0}, "mass = -1.0", "expected"),
        ("mbs_models.oscillators:LinearOscillator", {"mass": "one"}, "mass", "'one'"),
    ],
)
def test_mistake_in_a_name_or_parameter_is_named(
    model: str, parameters: dict[str, float], found: str, expected: str
) -> None:
    with refused(LoadError, found, expected):
        load_system(Specification(model, parameters))


def test_kind_whose_package_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(KINDS, "lonely", "a_package_that_is_not_installed.model")
    with refused(LoadError, "'lonely' needs the package 'a_package_that_is_not_inst"):
        load_system(Specification("model.py", kind="lonely"))


def test_recipe_of_a_registered_kind_makes_its_system(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Nothing else has to know a kind: the recipe names it."""
    asked = []

    def make(specification: Specification) -> System:
        asked.append(specification)
        return DuffingOscillator(step=0.02)

    module = ModuleType("kind_of_twins")
    vars(module)["make"] = make
    monkeypatch.setitem(sys.modules, "kind_of_twins", module)
    monkeypatch.setitem(KINDS, "twin", "kind_of_twins")
    recipe = tiny_recipe(system={"kind": "twin", "model": "a twin"})
    system = case_of(recipe).system
    assert (system.step, asked) == (0.02, [case_of(recipe).systems.specification])
    assert values_of_draws(recipe)["system"]["kind"] == "twin"


def test_recipe_of_an_unknown_kind_is_refused_with_the_kinds() -> None:
    kinds = "expected one of ['class', 'exudyn', 'fmu', 'function', 'record']"
    with refused(RecipeError, "system.kind = 'unheard'", kinds):
        tiny_recipe(system={"kind": "unheard"})
    with refused(LoadError, "'unheard'", kinds):
        load_system(Specification("model", kind="unheard"))


def test_data_of_a_class_do_not_depend_on_its_picture() -> None:
    drawn = tiny_recipe(system={"kind": "class", "picture": "mbs_models.pictures:draw"})
    assert values_of_draws(drawn) == values_of_draws(tiny_recipe())


def test_model_file_that_was_rewritten_is_read_again_in_the_same_process(tmp_path: Path) -> None:
    path = tmp_path / "gain.py"
    found = []
    for factor in (2.0, 3.0):
        path.write_text(GAIN.format(factor=factor), encoding="utf-8")
        system = load_system(Specification(str(path), {}, 0.1, kind="function"))
        found.append(float(simulate(system, np.ones((5, 1))).outputs[-1, 0]))
    assert found == [2.0, 3.0]


def test_model_file_imports_its_neighbours_from_any_folder(tmp_path: Path) -> None:
    (tmp_path / "neighbour_of_gain.py").write_text("FACTOR = 5.0", encoding="utf-8")
    path = tmp_path / "gain.py"
    text = "from neighbour_of_gain import FACTOR\n" + GAIN.format(factor="FACTOR")
    path.write_text(text, encoding="utf-8")
    make_importable(tmp_path)
    before = [(type(entry), entry) for entry in sys.path]
    system = load_system(Specification(str(path), {}, 0.1, kind="function"))
    assert simulate(system, np.ones((5, 1))).outputs[-1, 0] == 5.0
    assert [(type(entry), entry) for entry in sys.path] == before


def test_unit_that_differs_from_that_of_the_model_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "gain.py"
    path.write_text(
        GAIN.replace('"1", "range": [-1', '"N", "range": [-1').format(factor=2), "utf-8"
    )
    given = Specification(str(path), {}, 0.1, "function", {"u": SignalTable(unit="kN")})
    with refused(LoadError, "input 'u' is in kN in the recipe, and in N in the model"):
        load_system(given)
    for unit in ("N", None):
        load_system(replace(given, inputs={"u": SignalTable(unit=unit)}))


GAIN = """
inputs = {{"u": {{"unit": "1", "range": [-1.0, 1.0]}}}}
outputs = {{"y": {{"unit": "1", "range": [-9.0, 9.0]}}}}
start = [0.0]


def f(x, u, p):
    return [u[0] - x[0]]


def g(x, u, p) -> list:
    return [{factor} * u[0]]


assert g.__annotations__["return"] is list  # the loader's own future statements do not act here
"""


def test_class_without_a_step_is_refused_where_it_is_described(tmp_path: Path) -> None:
    path = tmp_path / "stepless.py"
    path.write_text(STEPLESS, encoding="utf-8")
    with refused(LoadError, "expected the sample step", ".step is"):
        describe_model(str(path))


STEPLESS = """
import slide_fmu as slide


class Stepless(slide.System):
    def __init__(self):
        self.inputs = (slide.Signal("u", "1", -1.0, 1.0),)
        self.outputs = (slide.Signal("y", "1", -1.0, 1.0),)

    def simulate(self, inputs):
        return inputs
"""


HALF_A_PUMP = """
import slide_fmu as slide

class Pump(slide.Stepping):
    def __init__(self, *, step=0.01):
        self.step = step
    def begin(self, held_input):
        pass

class Plain:
    pass
"""


@pytest.mark.parametrize(
    ("name", "found", "expected"),
    [
        ("", "Pump lacks the methods advance, output", "Stepping asks for: define them"),
        (":Pump", "Pump lacks the methods advance, output", "Stepping asks for: define them"),
        (
            ":Pmp",
            "there is no 'Pmp'",
            "did you mean 'Pump'",
        ),
        (
            ":Plain",
            "'Plain' does not inherit slide_fmu.System",
            "inherit slide_fmu.Stepping",
        ),
    ],
)
def test_class_that_is_no_whole_system_is_told_what_it_lacks(
    tmp_path: Path, name: str, found: str, expected: str
) -> None:
    place = tmp_path / "half.py"
    place.write_text(HALF_A_PUMP, encoding="utf-8")
    with refused(LoadError, found, expected):
        describe_model(f"{place}{name}")
    if name:
        with refused(LoadError, found, expected):
            load_system(Specification(f"{place}{name}", step=0.01))


def test_import_that_fails_in_a_model_is_told_with_file_line_and_cause(tmp_path: Path) -> None:
    place = tmp_path / "wrong_import.py"
    place.write_text("import numpy\nimport exudyn.symbolic_expressions\n", encoding="utf-8")
    message = (
        r"ModuleNotFoundError: No module named 'exudyn\.symbolic_expressions' "
        r"\(.*wrong_import\.py, line 2\): correct the name of the import, or install what it needs"
    )
    with pytest.raises(LoadError, match=message):
        load_system(Specification(f"{place}:Pump", step=0.01))


def test_name_of_two_dots_is_refused_as_no_module() -> None:
    with refused(LoadError, "'..' is no", "system '..:x'"):
        load_system(Specification("..:x", step=0.01))


def test_module_that_this_process_uses_from_another_file_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python would silently take the first one again."""
    name = "pump_of_two_folders"
    for folder in ("first", "second"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / f"{name}.py").write_text("from mbs_models.oscillators import *\n")
    given = Specification(f"{name}:LinearOscillator", step=0.01)
    monkeypatch.syspath_prepend(str(tmp_path / "first"))
    load_system(given)
    monkeypatch.syspath_prepend(str(tmp_path / "second"))
    with pytest.raises(LoadError, match=f"'{name}' is in .*second.* has loaded another .*first"):
        load_system(given)
    monkeypatch.delitem(sys.modules, name)
