"""What the README says works: its commands exist, its examples run."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import typer.main

from slide_fmu.cli import app
from slide_fmu.python_fmu.torch_export import ModuleTable

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_readme_s_table_of_subcommands_is_complete() -> None:
    listed = re.findall(r"^\| `slide-fmu ([\w-]+)", README, re.MULTILINE)
    group = typer.main.get_command(app)
    assert isinstance(group, typer.core.TyperGroup)
    assert sorted(listed) == sorted(group.commands)


def test_make_targets_named_in_the_readme_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"(?:^|`)make (\w+)", README, re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target


def test_files_named_in_the_readme_exist() -> None:
    for name in re.findall(r"(?:`|\()((?:slide_fmu|mbs_models|training|fmus)/[\w./]+)", README):
        assert (ROOT / name).exists(), name


def test_python_examples_of_the_readme_run() -> None:
    """All but the first one of the README check their shapes themselves."""
    api = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    examples = re.findall(r"```python\n(.*?)```", README + api, re.DOTALL)
    environment = {**os.environ, "PYTHONWARNINGS": "error"}
    said = []
    for example in examples:
        result = subprocess.run(
            [sys.executable, "-c", example],
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
        )
        assert result.returncode == 0, result.stderr
        said.append(result.stdout)
    assert len(said) == 4
    position, error = (float(word) for word in said[0].split(" +- "))
    # a held force of 200 N: k x (1 + alpha x^2) = F at 0.124 m
    assert abs(position - 0.124) < 0.02
    assert 0 < error < 0.1


def test_readme_s_description_of_a_torch_module_is_accepted() -> None:
    (example,) = re.findall(r"```toml\n(.*?)```", README, re.DOTALL)
    table = ModuleTable.model_validate(tomllib.loads(example))
    assert (table.inputs[0].name, table.window.n_in) == ("force", 100)
