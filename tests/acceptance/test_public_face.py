"""``import slide_fmu``: its names, what they cost, and what they say about files."""

from __future__ import annotations

import ast
import builtins
import importlib
import inspect
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.fmu.export import read_fmu
from tests.refusals import refused

ROOT = Path(__file__).parents[2]
DUFFING = ROOT / "fmus" / "duffing" / "duffing.fmu"
HEAVY = ("torch", "exudyn", "fmpy", "scipy", "matplotlib", "pydantic", "numpy")


def names_for_type_checkers() -> dict[str, str]:
    """What type checkers are told: public names and the modules that they come from."""
    tree = ast.parse(inspect.getsource(slide))
    for_type_checkers = next(node for node in tree.body if isinstance(node, ast.If))
    homes = {}
    for node in for_type_checkers.body:
        if (
            isinstance(node, ast.ImportFrom)
            and node.module
            and node.module.startswith("slide_fmu")
        ):
            homes.update({alias.name: str(node.module) for alias in node.names})
    return homes


def test_public_names_are_the_same_for_python_and_for_type_checkers() -> None:
    homes = {name: module for module, names in slide._HOMES.items() for name in names}
    assert homes == names_for_type_checkers()
    assert sorted(homes) == sorted(set(slide.__all__) - {"__version__"})
    assert sorted(slide.__all__) == slide.__all__


@pytest.mark.parametrize("name", [name for name in slide.__all__ if name != "__version__"])
def test_public_name_is_there_and_documented(name: str) -> None:
    public = getattr(slide, name)
    assert public.__name__ == name
    documentation = inspect.getdoc(public) or ""
    assert documentation.split("\n\n")[0].endswith((".", ":")), name
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    assert f"`{name}`" in page, f"{name} is missing in docs/api.md"


def test_no_public_name_is_that_of_a_room() -> None:
    rooms = {module.name for module in pkgutil.iter_modules(slide.__path__)}
    assert not rooms & set(slide.__all__)


def test_unknown_name_is_refused_as_python_does() -> None:
    with refused(AttributeError, "'slide_fmu' has no", "attribute 'sureogate'"):
        slide.sureogate  # noqa: B018
    assert set(slide.__all__) <= set(dir(slide))


def test_import_alone_loads_nothing_heavy() -> None:
    program = f"import sys, slide_fmu; print([n for n in {HEAVY} if n in sys.modules])"
    result = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == "[]"


def test_all_public_names_load_neither_torch_nor_exudyn() -> None:
    program = "import sys\nfrom slide_fmu import *\nprint(*(n in sys.modules for n in HEAVY[:3]))"
    program = program.replace("HEAVY[:3]", str(HEAVY[:3]))
    result = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert result.stdout.split() == ["False"] * 3


@pytest.mark.parametrize("kind", [str, Path])
def test_load_of_an_fmu_gives_its_surrogate(kind: type) -> None:
    surrogate = slide.load(kind(DUFFING))
    assert surrogate.to_bytes() == read_fmu(DUFFING)[0].to_bytes()
    inputs = 200 * np.ones((300, 1))
    outputs = surrogate.predict(inputs)
    assert outputs.shape == (300, 1)
    # a held force of 200 N: k x (1 + alpha x^2) = F at 0.124 m
    assert abs(outputs[-1, 0] - 0.124) < 0.02


def test_load_of_a_surrogate_file_gives_the_same_surrogate(tmp_path: Path) -> None:
    surrogate = slide.load(DUFFING)
    surrogate.save(tmp_path / "duffing.slide")
    assert slide.load(tmp_path / "duffing.slide").to_bytes() == surrogate.to_bytes()


def test_load_of_another_file_says_what_was_expected(tmp_path: Path) -> None:
    other = tmp_path / "notes.fmu"
    other.write_text("no archive at all", encoding="utf-8")
    with refused(slide.FmuError, "'no archi' and is", "b'no archi'"):
        slide.load(other)


def test_load_of_a_missing_file_names_it(tmp_path: Path) -> None:
    with refused(FileNotFoundError, "missing.fmu"):
        slide.load(tmp_path / "missing.fmu")


def test_export_to_a_path_given_as_text_can_be_loaded_again(tmp_path: Path) -> None:
    surrogate = slide.load(DUFFING)
    path = slide.export_fmu(surrogate, str(tmp_path / "again.fmu"))
    assert slide.load(path).to_bytes() == surrogate.to_bytes()


def test_recipe_is_loaded_from_a_path_given_as_text() -> None:
    assert slide.load_recipe(str(ROOT / "training" / "duffing.toml")).name == "duffing"


def test_version_is_the_newest_of_the_changelog_or_develops_the_next_one() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest, former = re.findall(r"^## (\S+)", changelog, re.MULTILINE)[:2]
    if newest == "Unreleased":
        version, is_development = slide.__version__.split(".dev")
        assert is_development == "0"
        assert [int(n) for n in version.split(".")] > [int(n) for n in former.split(".")]
    else:
        assert newest == slide.__version__


@pytest.mark.extended
def test_python_m_does_what_the_console_script_does() -> None:
    assert callable(importlib.import_module("slide_fmu.cli").main)
    arguments = [sys.executable, "-m", "slide_fmu", "check", str(DUFFING)]
    result = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True)
    assert (result.returncode, "no problems" in result.stderr) == (0, True), result.stderr


@pytest.mark.parametrize("path", ["nope.fmu", "", "."])
def test_load_names_a_path_that_is_no_file(path: str) -> None:
    with refused(FileNotFoundError, "expected an FMU", "correct the path"):
        slide.load(path)


@pytest.mark.parametrize("path", [None, 3])
def test_load_refuses_what_is_no_path(path: object) -> None:
    with refused(slide.FmuError, "expected the path of", "an FMU"):
        slide.load(path)  # type: ignore[arg-type]


@pytest.mark.parametrize("inputs", [[[1j]], [["force"]]])
def test_predict_refuses_what_are_no_real_numbers(inputs: object) -> None:
    surrogate = slide.load(ROOT / "fmus" / "linear" / "linear.fmu")
    with refused(TypeError, "inputs of type", "expected real numbers"):
        surrogate.predict(inputs)  # type: ignore[arg-type]


def test_predict_refuses_what_is_missing() -> None:
    surrogate = slide.load(ROOT / "fmus" / "linear" / "linear.fmu")
    with refused(ValueError, "at sample 0 is nan", "expected finite values"):
        surrogate.predict([[None]])  # type: ignore[arg-type]


@pytest.mark.parametrize("name", [name for name in slide.__all__ if name != "__version__"])
def test_errors_that_a_public_name_speaks_of_are_public(name: str) -> None:
    public = getattr(slide, name)
    own = vars(public).values() if inspect.isclass(public) else ()
    texts = [inspect.getdoc(one) or "" for one in (public, *own)]
    named = set(re.findall(r"\b[A-Z]\w+Error\b", " ".join(texts)))
    assert named <= {*slide.__all__, *dir(builtins)}
