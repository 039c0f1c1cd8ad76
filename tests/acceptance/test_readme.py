"""What the README says works: its commands exist, its examples run."""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path

import pytest
import typer.main

from slide_fmu.cli.app import app
from slide_fmu.fmu.export import read_fmu
from tests.acceptance.conftest import invoke
from tests.marks import APPS, needs_app

OF_APPS = {
    **{name: (name,) for name in ("bench", "calibrate", "compare", "couple", "motion", "page")},
    "reference": ("reference", "ssp"),
}
"""Subcommands of each app."""

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def page(name: str) -> str:
    """The text of a page of the documentation."""
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def subcommands() -> list[str]:
    """All subcommands of the console script."""
    group = typer.main.get_command(app)
    assert isinstance(group, typer.core.TyperGroup)
    return sorted(group.commands)


def without_removed_apps(listed: list[str]) -> list[str]:
    """The names in their order, without the subcommands of apps that were removed."""
    gone = [name for name in OF_APPS if not (APPS / name / "__init__.py").exists()]
    removed = [subcommand for name in gone for subcommand in OF_APPS[name]]
    return sorted(name for name in listed if name not in removed)


def test_readme_names_all_subcommands_and_no_others() -> None:
    start = README.index("The subcommands of `slide-fmu`:")
    listed = re.findall(r"`(\w+)`", README[start : README.index("`make test`")].replace("\n", " "))
    assert without_removed_apps(listed) == subcommands()


def test_table_of_subcommands_is_complete() -> None:
    listed = re.findall(r"^\| `slide-fmu ([\w-]+)", page("command_line.md"), re.MULTILINE)
    assert without_removed_apps(listed) == subcommands()


def shell_commands() -> list[str]:
    """All lines of the shell in the README, without their comments."""
    blocks = re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
    return [line.split("#")[0].strip() for block in blocks for line in block.splitlines()]


SMALL = """
[data]
substeps = 4
duration = 12.0
burn_in = 4.0
train = 12
validation = 3
companion = 6
bound = 20
calibration = 40

[network]
order = 2
hidden = 8

[training]
starts = 1
iterations = 25
expert.start_iterations = 10
expert.kept = 1
expert.kept_iterations = 10

[validation]
trajectories = 4

[bound.expert]
hidden = [8]
steps = 300
attempts = 1
"""
"""What a proposed recipe leaves open, with small numbers; found, they take a run some minutes."""


def with_small_numbers(recipe: Path) -> None:
    """Give the small numbers to a proposed recipe, which keeps its kinds of excitation."""
    text = recipe.read_text(encoding="utf-8")
    start, kinds = text.index("[data]"), text.index("[[data.excitation]]")
    bound = text.index("[bound.expert]")
    after = text.index("[[bound.excitation]]")
    recipe.write_text(
        text[:start] + SMALL[: SMALL.index("[network]")] + text[kinds:bound] + text[after:]
        + SMALL[SMALL.index("[network]") :],
        encoding="utf-8",
    )  # fmt: skip


@pytest.mark.extended
@pytest.mark.usefixtures("few_motions")
def test_commands_of_the_readme_make_an_fmu_with_a_small_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``make demo`` would set up another checkout: only what it would run is looked at.

    ``tests/benchmarks/front_door.py --model template`` runs the same commands with all defaults.
    """
    assert shell_commands()[:2] == ["make demo", ". .venv/bin/activate"]
    planned = subprocess.run(["make", "-n", "demo"], cwd=ROOT, capture_output=True, text=True)
    assert "slide-fmu run training/duffing_demo.toml" in planned.stdout
    monkeypatch.chdir(tmp_path)
    for command in shell_commands()[2:]:
        program, *arguments = shlex.split(command)
        assert program == "slide-fmu"
        if arguments[0] == "run":
            with_small_numbers(tmp_path / arguments[1])
        done = invoke(*arguments)
        assert done.exit_code == 0, done.output
    figures = read_fmu(tmp_path / "runs" / "my_model" / "my_model.fmu")[1]
    assert figures is not None
    (position, velocity) = figures["measured"]["validation"]["in range"]["outputs"]
    assert position["relative_rmse"] < 0.02
    assert velocity["relative_rmse"] < 0.05


def test_make_targets_named_in_the_readme_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"(?:^|`)make (\w+)", README, re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target


def test_python_examples_of_readme_and_pages_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those that print nothing check their shapes themselves."""
    text = README + page("api.md") + page("use_an_fmu.md")
    examples = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    monkeypatch.chdir(ROOT)
    printed = []
    for example in examples:
        exec(example, {"__name__": "__main__"})
        printed.append(capsys.readouterr().out)
    assert len(printed) == 8
    position, error = (float(word) for word in printed[0].split(" with a bound of "))
    # a held force of 200 N: k x (1 + alpha x^2) = F at 0.124 m
    assert abs(position - 0.124) < 0.02
    assert 0 < error < 0.1


@needs_app("from_torch")
def test_network_of_torch_on_its_page_becomes_an_fmu(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    examples = re.findall(r"```py\n(.*?)```", page("api.md"), re.DOTALL)
    (example,) = [example for example in examples if "from_torch" in example]
    monkeypatch.chdir(tmp_path)
    exec(example, {})
    surrogate, _ = read_fmu(Path("my_network.fmu"))
    assert [signal.name for signal in surrogate.inputs] == ["force"]
