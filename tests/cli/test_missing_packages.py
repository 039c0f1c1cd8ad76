"""Without the packages of the extra "train", what needs them says in a line what to install."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.limits import HANGS
from tests.marks import essential, needs_app

WITHOUT = """
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("torch", "exudyn"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Hidden())
"""
MAIN = "from slide_fmu.cli import main\nsys.argv[0] = 'slide-fmu'\nmain()"
LEARN = (
    "import slide_fmu\n"
    "try:\n    slide_fmu.learn({'kind': 'function', 'model': 'lag.py'}, 'lag')\n"
    "except ImportError as error:\n    raise SystemExit(f'error: {error}')"
)
INSTALL = "pip install '.[train]' in a clone of slide-fmu, pip install 'slide-fmu[train]' else"
LAG = """
inputs = {"u": {"unit": "1", "range": [-1, 1]}}
outputs = {"y": "1"}
start = [0.0]
def f(x, u, p):
    return [u[0] - x[0]]
def g(x, u, p):
    return x
"""


def called(folder: Path, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", WITHOUT + program, *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=HANGS)


@pytest.mark.parametrize(
    "subcommand",
    [
        *essential(("try", "run", "train", "generate", "window", "learn"), "run", "learn"),
        pytest.param("compare", marks=[needs_app("compare"), pytest.mark.extended]),
    ],
)
def test_what_needs_training_packages_names_the_extra_in_one_line(
    tmp_path: Path, subcommand: str
) -> None:
    (tmp_path / "lag.toml").write_text("", encoding="utf-8")
    done = (
        called(tmp_path, LEARN)
        if subcommand == "learn"
        else called(tmp_path, MAIN, subcommand, "lag.toml")
    )
    assert done.returncode == 1
    assert done.stderr == (
        f"error: the package 'torch' is not installed; expected the extra 'train': {INSTALL}\n"
    )


@pytest.mark.extended
def test_init_writes_the_recipe_of_a_function_without_training_packages(tmp_path: Path) -> None:
    (tmp_path / "lag.py").write_text(LAG, encoding="utf-8")
    done = called(tmp_path, MAIN, "init", "lag.py", "--step", "0.1")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "lag.toml").exists()
    assert done.stderr.splitlines()[-3:] == [
        "recipe  lag.toml",
        f"install {INSTALL}: try and run need it",
        "next    slide-fmu try lag.toml",
    ]


@pytest.mark.extended
def test_init_with_training_packages_names_nothing_to_install(tmp_path: Path) -> None:
    (tmp_path / "lag.py").write_text(LAG, encoding="utf-8")
    command = [sys.executable, "-c", f"import sys\n{MAIN}", "init", "lag.py", "--step", "0.1"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=HANGS)
    assert done.stderr.splitlines()[-2:] == ["recipe  lag.toml", "next    slide-fmu try lag.toml"]


def test_remedy_is_what_the_readme_says_for_a_clone() -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    assert f"`{INSTALL.partition(' in a clone')[0]}`" in readme


@pytest.mark.extended
def test_init_of_a_model_that_imports_exudyn_says_what_to_install(tmp_path: Path) -> None:
    (tmp_path / "arm.py").write_text("import exudyn\ndef build(mbs, p): ...\n", encoding="utf-8")
    done = called(tmp_path, MAIN, "init", "arm.py")
    assert done.returncode == 1
    assert done.stderr.count("\n") <= 1
    assert INSTALL in done.stderr
