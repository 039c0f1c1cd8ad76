"""What is answered at once: help, version, and completions of what was typed."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest

import slide_fmu
from slide_fmu.cli.app import OF_APPS, SUBCOMMANDS, name_of
from tests.marks import first

COMMAND = [sys.executable, "-m", "slide_fmu"]
HEAVY = ("numpy", "scipy", "matplotlib", "fmpy", "torch", "exudyn", "rich.markdown")
NAMES = [name_of(each) for each in (*SUBCOMMANDS, *OF_APPS)]
TO_COMPLETE = {
    "bash": {"COMP_WORDS": "slide-fmu {}", "COMP_CWORD": "1"},
    "zsh": {"_TYPER_COMPLETE_ARGS": "slide-fmu {}"},
    "fish": {"_TYPER_COMPLETE_FISH_ACTION": "get-args", "_TYPER_COMPLETE_ARGS": "slide-fmu {}"},
}


def asked(shell: str, typed: str) -> dict[str, str]:
    """The environment in which a shell asks how a word goes on."""
    found = {name: text.format(typed) for name, text in TO_COMPLETE[shell].items()}
    return {**os.environ, "_SLIDE_FMU_COMPLETE": f"complete_{shell}", **found}


@pytest.mark.parametrize("shell", first(TO_COMPLETE))
def test_subcommands_are_completed_in_a_shell(shell: str) -> None:
    whole = subprocess.run(COMMAND, env=asked(shell, ""), capture_output=True, text=True)
    assert whole.returncode == 0, whole.stderr
    for name in NAMES:
        assert re.search(rf"\b{name}\b", whole.stdout), name
    one = subprocess.run(COMMAND, env=asked(shell, "val"), capture_output=True, text=True)
    assert "validate" in one.stdout
    assert "calibrate" not in one.stdout


@pytest.mark.parametrize("shell", first(TO_COMPLETE))
def test_script_of_a_shell_completes_the_name_that_is_typed(shell: str) -> None:
    shown = subprocess.run(
        COMMAND,
        env={**os.environ, "_SLIDE_FMU_COMPLETE": f"source_{shell}"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert re.search(r"(complete|compdef)\b.*\bslide-fmu", shown.stdout)
    assert f"_SLIDE_FMU_COMPLETE=complete_{shell}" in shown.stdout


def test_version_is_that_of_the_package() -> None:
    shown = subprocess.run([*COMMAND, "--version"], capture_output=True, text=True, check=True)
    assert shown.stdout == f"slide-fmu {slide_fmu.__version__}\n"


@pytest.mark.parametrize("start", ["--help", "--version", *TO_COMPLETE])
def test_what_is_answered_at_once_imports_nothing_slow(start: str) -> None:
    arguments, environment = [start], dict(os.environ)
    if start in TO_COMPLETE:
        arguments, environment = [], asked(start, "val")
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "slide_fmu", *arguments],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    imported = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    assert "typer" in imported
    assert not imported & set(HEAVY)
