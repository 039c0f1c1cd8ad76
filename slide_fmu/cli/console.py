"""All subcommands say and write alike: progress, errors, figures, tables."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

from rich.console import Console

from slide_fmu.cli.tables import table_of
from slide_fmu.core.extras import how_to_install, told_missing
from slide_fmu.core.files import told_of_system, write_whole, writing
from slide_fmu.core.progress import Stages
from slide_fmu.core.units import behind
from slide_fmu.pipeline.display import messages, shown

TRACEBACK = "SLIDE_FMU_TRACEBACK"
"""Environment variable: if set, errors show where they come from."""

STOPPED = "stopped"
GOES_ON = "stopped; the same command goes on from here"
"""What is said where the user interrupts a program, and one that keeps its work."""
INTERRUPTED = 130
"""Exit code of a program that the user interrupts, as shells have it."""

console = messages()


def write_json(path: str | None, figures: Any) -> None:
    """Write figures as JSON to a path, to standard output for ``-``, or nowhere for None.

    A file is replaced as a whole; what is none, as a pipe or a link to one, is written to.
    """
    if path is None:
        return
    text = json_bytes(figures)
    if path == "-":
        sys.stdout.write(text.decode("utf-8"))
        return
    place = Path(path)
    with errors():
        if place.is_symlink() or (place.exists() and not place.is_file()):
            with writing(place):
                place.write_bytes(text)
        else:
            write_whole(place, text)


def json_bytes(figures: Any) -> bytes:
    """Return figures as JSON that people can read too."""
    return (json.dumps(figures, indent=2, allow_nan=False) + "\n").encode("utf-8")


def show_json(path: str | None, figures: Any) -> None:
    """Write figures as ``write_json`` does, and print them unless they go to stdout by that."""
    write_json(path, figures)
    if path != "-":
        Console().print_json(json.dumps(figures))


def show_plain_call(figures: dict[str, Any], to: Console | None = None) -> None:
    """Print what the plain call of the FMU errs by, where that was measured."""
    from slide_fmu.report.importer_sections import plain_call_rows

    if "plain_call" in figures:
        place, found = console if to is None else to, figures["plain_call"]
        heading, *rows = plain_call_rows(found)
        place.print("plain call, fmpy.simulate_fmu(fmu, input=table): relative RMSE")
        table = table_of(*heading)
        for row in rows:
            table.add_row(*row)
        place.print(table)
        place.print(found["sentence"])


def show_box(figures: dict[str, Any], to: Console | None = None) -> None:
    """Print what the FMU errs by where all inputs are constant, where that was measured."""
    from slide_fmu.report.importer_sections import box_rows

    if "box" in figures:
        heading, *rows = box_rows(figures["box"])
        table = table_of(*heading)
        for row in rows:
            table.add_row(*row)
        (console if to is None else to).print(table)


def show_validation(figures: dict[str, Any], title: str, to: Console | None = None) -> None:
    """Print the accuracy of every output, in its unit, and of the error estimate.

    Where inputs move, what a plain importer call errs stands beside it. It goes to the messages
    if no other console is given.
    """
    place = console if to is None else to
    # not as the table's title, which rich wraps to the width of the table
    place.print(f"{title}: {figures['trajectories']} trajectories, seed {figures['seed']}")
    moving = all("plain_relative_rmse" in output for output in figures["outputs"])
    size = "RMS of the reference about its mean"
    table = table_of("output", size, "RMSE", "relative RMSE", "largest error")
    if moving:
        table.add_column("relative RMSE, inputs set to what they are now")
    for output in figures["outputs"]:
        unit = behind(output["unit"])
        table.add_row(
            output["name"],
            f"{output['rms_reference_about_mean']:.4g}{unit}",
            f"{output['rmse']:.4g}{unit}",
            f"{100 * output['relative_rmse']:.3g} %",
            f"{output['max_error']:.4g}{unit}",
            *([f"{100 * output['plain_relative_rmse']:.3g} %"] if moving else []),
        )
    place.print(table)
    for output in figures["outputs"]:
        if "relative_noise_floor" in output:
            place.print(_told_noise(output))
    if figures["error_estimate"] is not None:
        _show_estimate(figures, place)
    if "error_bound" in figures:
        _show_bound(figures["error_bound"], place)


def _show_estimate(figures: dict[str, Any], place: Console) -> None:
    """Print how far error estimates are from true errors, next to the best constant."""
    from slide_fmu.report.trust_tables import estimate_cells, estimates_of

    place.print(f"error estimate over {figures['error_estimate']['span_samples']} samples")
    table = table_of(
        "output",
        "mean relative deviation",
        "95 % within",
        "the best constant: mean",
        "95 % within",
        "error more than twice the estimate",
        "95 % of the errors below",
        "rank correlation",
    )
    for one in estimates_of(figures):
        table.add_row(*estimate_cells(*one))
    place.print(table)


def _show_bound(bound: dict[str, Any], place: Console) -> None:
    """Print what error bounds cover, how wide they are, and how often the domain is left."""
    from slide_fmu.report.trust_sentences import covered_sentence
    from slide_fmu.report.trust_tables import output_cells
    from slide_fmu.validation.trust import HARMFUL

    place.print(f"error bound, {100 * bound['confidence']:g} % confidence")
    table = table_of(
        "output",
        "covered samples",
        "of the 5 % worst trajectories",
        "mean bound / 95 % quantile of errors",
        "skill beside the best constant",
        "rank correlation",
    )
    for output in bound["outputs"]:
        table.add_row(*output_cells(output))
    place.print(table)
    place.print(
        f"outside of the domain: {100 * bound['flagged']:.3g} % of the samples, "
        f"{100 * bound['trajectories_flagged']:.3g} % of the trajectories"
    )
    if "plain" in bound:
        place.print(covered_sentence(bound))
    if "harm" in bound:
        harm = bound["harm"]
        place.print(
            f"harmful errors (more than {HARMFUL:g} times what is usual in range): "
            f"{100 * harm['harmful']:.3g} % of the samples; in the domain and above the bound "
            f"{100 * harm['harmful_unnoticed']:.3g} %"
        )


def _told_noise(output: dict[str, Any]) -> str:
    """Say how much of an error beside a record is noise, and what the window costs."""
    noise = f"{output['name']}: {100 * output['relative_noise_floor']:.3g} % is noise"
    if "free_relative_rmse" not in output:
        return noise
    return f"{noise}; free of the window the error is {100 * output['free_relative_rmse']:.3g} %"


def show_remark(remark: str | None) -> None:
    """Print what the user should know about a result, if there is anything."""
    if remark is not None:
        console.print(f"remark: {remark}", style="yellow")


@contextmanager
def progress_bars(stopped: str = STOPPED) -> Iterator[Stages]:
    """Show progress as bars on a terminal, as lines elsewhere; errors become messages.

    ``stopped`` is as of ``errors``.
    """
    with errors(stopped), _quiet_output(), shown(console) as stages:
        yield stages


@contextmanager
def _quiet_output() -> Iterator[None]:
    """Lead standard output, which is for figures alone, to standard error: models may print.

    The file descriptor is led there too, since worker processes inherit that.
    """
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


@contextmanager
def errors(stopped: str = STOPPED) -> Iterator[None]:
    """Turn a user's mistakes into one message and exit code 1.

    Where the user interrupts the program, it says that it ``stopped``, with the exit code of that.
    """
    try:
        with interruptible(stopped):
            yield
    except ImportError as error:
        needs = f"{error}; this subcommand needs more packages: {how_to_install('train')}"
        _fail(error, told_missing(error) or needs)
    except OSError as error:
        _fail(error, told_of_system(error))
    except (ValueError, RuntimeError) as error:
        _fail(error, str(error))
    except MemoryError as error:
        _fail(error, f"not enough memory: {error or 'nothing is left'}")


@contextmanager
def interruptible(stopped: str = STOPPED) -> Iterator[None]:
    """Say in a line that the user interrupted the program, and end it with the code of that."""
    try:
        yield
    except KeyboardInterrupt:
        console.print(stopped)
        raise SystemExit(INTERRUPTED) from None


def _fail(error: Exception, message: str) -> None:
    if os.environ.get(TRACEBACK):
        raise error
    console.print(f"error: {message}", style="red")
    raise SystemExit(1) from None
