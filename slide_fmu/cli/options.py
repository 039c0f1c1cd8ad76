"""These options and arguments are shared by several subcommands."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from slide_fmu.core.file_kinds import record_formats

RecipeArgument = Annotated[Path, typer.Argument(help="The recipe, such as training/duffing.toml.")]
FmuArgument = Annotated[Path, typer.Argument(help="The FMU, made by slide-fmu.")]


def _writable(path: str | None) -> str | None:
    """Refuse a path for figures before the work begins."""
    if path is not None and path != "-":
        folder = Path(path).absolute().parent
        here = folder.is_dir() and os.access(folder, os.W_OK)
        if Path(path).is_dir() or not here:
            raise typer.BadParameter(
                f"{path!r}: expected a file in a folder that can be written to"
            )
    return path


JsonOption = Annotated[
    str | None,
    typer.Option(
        "--json",
        metavar="PATH",
        help="Write the figures as JSON to this file. - is standard output.",
        callback=_writable,
    ),
]
RunsOption = Annotated[Path, typer.Option("--runs", help="Folder for data, training and reports.")]
InputsOption = Annotated[
    Path | None,
    typer.Option(
        "--inputs",
        metavar="FILE",
        help=f"File of your own inputs ({record_formats()}) with times and a column for each. Its "
        "first half is learnt from; the second half judges the FMU, first of all, as 'your "
        "inputs'.",
    ),
]
WorkersOption = Annotated[
    int | None,
    typer.Option(
        "--workers", min=1, help="Number of processes that simulate. Default: one per core."
    ),
]
ExecutorOption = Annotated[
    str | None,
    typer.Option(
        "--executor",
        metavar="dask://HOST:PORT",
        help="Simulate with the workers of this Dask scheduler. Default: processes "
        "of this machine.",
    ),
]
ThreadsOption = Annotated[
    int, typer.Option("--threads", min=1, help="Number of threads of the training.")
]
QuickOption = Annotated[
    bool,
    typer.Option(
        "--quick",
        help="Take about a minute of computing: fewer trajectories, a shorter training, larger "
        "errors, wider bounds. The FMU comes into runs/NAME/quick.",
    ),
]
TrajectoriesOption = Annotated[
    int | None,
    typer.Option(
        min=1, help="Number of unseen trajectories for the measurement. Default: as in the recipe."
    ),
]
TrainingSeedOption = Annotated[
    int | None,
    typer.Option(
        "--seed",
        min=0,
        max=2**31 - 1,
        help="Seed of the training. Default: as in the recipe.",
    ),
]
DataSeedOption = Annotated[
    int | None,
    typer.Option(
        "--data-seed", min=0, help="Seed of the trajectories. Default: as in the recipe."
    ),
]


def one_of(choices: Sequence[str], otherwise: str) -> Callable[[str | None], str | None]:
    """Return a check of an option with few values; ``otherwise`` is the other remedy."""

    def check(value: str | None) -> str | None:
        if value is not None and value not in choices:
            raise typer.BadParameter(
                f"{value!r}; expected {' or '.join(choices)}: correct it, or {otherwise}"
            )
        return value

    return check


def pairs_of(option: str, texts: Sequence[str] | None, value: str) -> dict[str, str]:
    """Read texts ``NAME=TEXT``, each name once; ``value`` names TEXT in messages.

    Raises:
        ValueError: a text has another form, or a name occurs twice.
    """
    pairs: dict[str, str] = {}
    for text in texts or ():
        name, equals, behind = text.partition("=")
        if not (name and equals and behind) or name in pairs:
            raise ValueError(f"--{option} {text}; expected NAME={value}, each name once")
        pairs[name] = behind
    return pairs


def numbers_of(option: str, texts: Sequence[str] | None) -> dict[str, float]:
    """Read texts ``NAME=NUMBER``, each name once.

    Raises:
        ValueError: as for ``pairs_of``; or the text after a name is not a number.
    """
    return {
        name: _number(option, name, text)
        for name, text in pairs_of(option, texts, "VALUE").items()
    }


def _number(option: str, name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"--{option} {name}={text}; expected a number behind =") from None
