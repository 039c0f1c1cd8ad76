"""All subcommands print progress, errors, JSON and remarks in the same way."""

from __future__ import annotations

import codecs
import io
import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path

from slide_fmu.core.extras import how_to_install, missing_extra
from slide_fmu.core.figures import plain
from slide_fmu.core.files import reason_of, write_whole, writing
from slide_fmu.core.progress import Stages
from slide_fmu.report.progress_display import Messages, messages, progress_on
from slide_fmu.report.table import ReportTable

TRACEBACK = "SLIDE_FMU_TRACEBACK"
"""Environment variable; if set, errors show a traceback."""

STOPPED = "stopped"
GOES_ON = "stopped; the same command goes on from here"
"""Messages for an interrupt by the user: of any program, and of those that keep their work."""
INTERRUPTED, KILLED = 130, 143
"""Exit codes after Ctrl-C and after kill, as in shells: 128 and the number of the signal."""

NO_MEMORY = "failed to map segment", "annot allocate memory"
"""Words of an import that failed for want of memory."""

console = messages()


def replace_unprintable() -> None:
    """Let standard output and standard error replace what their encoding cannot show.

    A micro sign becomes the letter u, any other character a question mark.
    """
    codecs.register_error("replace_unprintable", _replacement)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace_unprintable")


def _replacement(error: UnicodeError) -> tuple[str, int]:
    """Return the text in the place of characters that cannot be shown, and where it ends."""
    assert isinstance(error, UnicodeEncodeError)
    unknown = error.object[error.start : error.end]
    return "".join("u" if one == "µ" else "?" for one in unknown), error.end


def write_json(path: str | None, figures: object) -> None:
    """Write figures as JSON to a path, to standard output for ``-``, or nowhere for None.

    A file is replaced as a whole; a pipe, or a link to one, is written to directly.
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


def json_bytes(figures: object) -> bytes:
    """Return figures as JSON that users can read too."""
    return (json.dumps(plain(figures), indent=2, allow_nan=False) + "\n").encode("utf-8")


def figures_console() -> Messages:
    """Open standard output for tables and sentences that are the result of a subcommand."""
    return Messages(file=sys.stdout, markup=False, highlight=False)


def show_table(table: ReportTable) -> None:
    """Print a table with its title, if it has one."""
    from slide_fmu.report.console import print_table

    print_table(table, console)


def show_remark(remark: str | None) -> None:
    """Print what the user should know about a result, if there is anything."""
    if remark is not None:
        console.print(f"remark: {remark}", style="yellow")


@contextmanager
def progress_bars(stopped: str = STOPPED) -> Iterator[Stages]:
    """Show progress as bars on a terminal, as lines elsewhere; errors become messages.

    ``stopped`` is as for ``errors``.
    """
    with errors(stopped), _quiet_output(), progress_on(console) as stages:
        yield stages


@contextmanager
def _quiet_output() -> Iterator[None]:
    """Redirect standard output, which is for figures only, to standard error: models may print.

    The file descriptor is redirected too, since worker processes inherit it.
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

    If the user interrupts the program, the message ``stopped`` and the matching exit code are
    used.
    """
    try:
        with interruptible(stopped):
            yield
    except ImportError as error:
        if any(words in str(error) for words in NO_MEMORY):
            _fail_without_memory(error)
        needs = f"{error}; this subcommand needs more packages: {how_to_install('train')}"
        _fail(error, missing_extra(error) or needs)
    except OSError as error:
        _fail(error, reason_of(error))
    except UnicodeEncodeError as error:
        found = error.object[error.start : error.end]
        what = f"a name has the bytes {os.fsencode(found)!r}, which are no UTF-8"
        _fail(error, f"{what}; expected UTF-8: rename the file or folder")
    except (ValueError, RuntimeError) as error:
        _fail(error, str(error))
    except MemoryError as error:
        _fail_without_memory(error)


@contextmanager
def interruptible(stopped: str = STOPPED) -> Iterator[None]:
    """Report an interrupt by the user in one line, and exit with the matching code."""
    try:
        yield
    except KeyboardInterrupt:
        console.print(stopped)
        raise SystemExit(INTERRUPTED) from None


def _fail_without_memory(error: Exception) -> None:
    """Say that the memory is full, by what needs none."""
    if os.environ.get(TRACEBACK):
        raise error
    reason = str(error) or "nothing is left"
    sys.stderr.write(
        f"error: not enough memory: {reason}; close other programs, or raise the limit\n"
    )
    raise SystemExit(1) from None


def _fail(error: Exception, message: str) -> None:
    if os.environ.get(TRACEBACK):
        raise error
    console.print(f"error: {message}", style="red")
    raise SystemExit(1) from None
