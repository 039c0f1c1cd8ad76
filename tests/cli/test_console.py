"""Messages of the console script: wrapped on a terminal only."""

from __future__ import annotations

import errno
import io
import json
import os
import pty
import subprocess
import sys
import time
from pathlib import Path

import pytest

from slide_fmu.cli import console
from slide_fmu.cli.app import OF_APPS, SUBCOMMANDS, name_of
from slide_fmu.cli.console import GOES_ON, KILLED, STOPPED, errors, progress_bars
from slide_fmu.report.console import print_noise, print_rows
from slide_fmu.report.progress_display import Messages
from slide_fmu.report.verdict import verdict
from slide_fmu.validation.error_figures import OutputFigures
from tests.figures import filled
from tests.limits import HANGS
from tests.report.made_rows import MEASURED, row

COMMAND = [sys.executable, "-m", "slide_fmu"]


def narrow(**more: str) -> dict[str, str]:
    """The environment of a terminal of 60 columns."""
    return {**os.environ, "COLUMNS": "60", "PYTHONIOENCODING": "utf-8", **more}


def absent(folder: Path) -> Path:
    """A path that no file has, longer than a narrow terminal."""
    return folder / ("there is no such file " * 6).strip() / "absent.toml"


@pytest.mark.extended
@pytest.mark.parametrize("more", [{}, {"FORCE_COLOR": "1"}, {"TERM": "dumb"}], ids=str)
def test_error_message_in_a_pipe_is_one_line_whatever_the_terminal(
    tmp_path: Path, more: dict[str, str]
) -> None:
    recipe = absent(tmp_path)
    done = subprocess.run(
        [*COMMAND, "window", str(recipe)],
        capture_output=True,
        text=True,
        check=False,
        env=narrow(**more),
    )
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.removeprefix("\x1b[31m").startswith("error: ")
    assert str(recipe) in line
    assert done.stdout == ""


def test_usage_error_in_a_pipe_is_one_line(tmp_path: Path) -> None:
    option = "--an-option-that-no-subcommand-has-and-that-is-longer-than-a-narrow-terminal"
    done = subprocess.run(
        [*COMMAND, "train", str(absent(tmp_path)), option],
        capture_output=True,
        text=True,
        check=False,
        env=narrow(),
    )
    assert done.returncode == 2
    assert f"Error: No such option: {option}" in done.stderr.splitlines()


@pytest.mark.parametrize("columns", ["40", "300"])
def test_help_in_a_pipe_has_whole_summaries_whatever_the_terminal(columns: str) -> None:
    done = subprocess.run(
        [*COMMAND, "--help"],
        capture_output=True,
        text=True,
        check=True,
        env=narrow(COLUMNS=columns),
    )
    lines = done.stdout[done.stdout.index("Commands:") :].splitlines()[1:]
    names = [name_of(each) for each in (*SUBCOMMANDS, *OF_APPS)]
    assert [line.split()[0] for line in lines] == names
    for line, subcommand in zip(lines, (*SUBCOMMANDS, *OF_APPS), strict=True):
        assert line.endswith(f"  {subcommand.__doc__}")


@pytest.mark.extended
def test_error_message_on_a_terminal_is_wrapped_to_its_width(tmp_path: Path) -> None:
    master, terminal = pty.openpty()
    try:
        done = subprocess.run(
            [*COMMAND, "window", str(absent(tmp_path))],
            stdout=subprocess.DEVNULL,
            stderr=terminal,
            check=False,
            env=narrow(TERM="xterm"),
        )
        said = os.read(master, 1 << 16).decode()
    finally:
        os.close(terminal)
        os.close(master)
    assert done.returncode == 1
    plain = said.replace("\x1b[31m", "").replace("\x1b[0m", "").splitlines()
    assert len(plain) > 2
    assert max(map(len, plain)) <= 60


def test_what_a_model_prints_does_not_join_the_figures(capfd: pytest.CaptureFixture[str]) -> None:
    with console.progress_bars():
        print("a model")
        os.write(1, b"a worker process\n")
    console.write_json("-", {"figure": 1.0})
    printed = capfd.readouterr()
    assert json.loads(printed.out) == {"figure": 1.0}
    assert "a model\n" in printed.err
    assert "a worker process\n" in printed.err


def test_progress_in_a_pipe_goes_on_where_the_work_turns_out_to_be_more(
    capfd: pytest.CaptureFixture[str],
) -> None:
    with console.progress_bars() as stages:
        progress = stages("search")
        for done in range(21):
            progress(done, 20)
        for done in range(21, 41):
            progress(done, 40)
    lines = capfd.readouterr().err.splitlines()
    assert lines[:2] == ["search: 0 of 20", "search: 20 of 20, took 0 s"]
    assert len(lines) <= 4
    assert lines[-1] == "search: 40 of 40, took 0 s"


def test_table_and_its_heading_in_a_pipe_are_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    messages = Messages(file=io.StringIO(), markup=False, highlight=False)
    kind = "a kind of input that has a longer name than any narrow terminal " * 2
    print_rows([*MEASURED, row(kind.strip())], messages)
    heading, *lines = messages.file.getvalue().splitlines()
    assert heading == "plain call, h = 20 ms, h/4 = 5 ms"
    (cells,) = [line for line in lines if kind.strip() in line]
    for cell in ("12", "1 %", "95 %", "96 %", "valid"):
        assert f" {cell} " in cells
    assert tuple(lines[-3:]) == verdict([*MEASURED, row(kind.strip())])


def test_noise_of_records_is_named_where_it_is_known() -> None:
    messages = Messages(file=io.StringIO(), markup=False, highlight=False)
    outputs = [
        filled(OutputFigures, name="y", relative_noise_floor=0.02, free_relative_rmse=0.5),
        filled(OutputFigures, name="z"),
    ]
    print_noise(outputs, messages)
    assert messages.file.getvalue() == ("y: 2 % is noise; free of the window the error is 50 %\n")


def test_figures_that_cannot_be_written_leave_the_old_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(staged: Path, content: bytes) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    place = tmp_path / "figures.json"
    console.write_json(str(place), {"a": 1})
    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(SystemExit):
        console.write_json(str(place), {"a": 2})
    assert "figures.json' cannot be written: the disk is full" in capsys.readouterr().err
    assert json.loads(place.read_text(encoding="utf-8")) == {"a": 1}


def test_figures_may_go_to_a_pipe_and_through_a_link(tmp_path: Path) -> None:
    (tmp_path / "link.json").symlink_to(tmp_path / "figures.json")
    console.write_json(str(tmp_path / "link.json"), {"a": 1})
    assert (tmp_path / "link.json").is_symlink()
    assert json.loads((tmp_path / "figures.json").read_text(encoding="utf-8")) == {"a": 1}
    reader, writer = os.pipe()
    console.write_json(f"/dev/fd/{writer}", {"a": 2})
    os.close(writer)
    with os.fdopen(reader) as pipe:
        assert json.load(pipe) == {"a": 2}


@pytest.mark.parametrize("stopped", [STOPPED, GOES_ON])
def test_interrupted_program_says_whether_its_work_is_kept(
    capsys: pytest.CaptureFixture[str], stopped: str
) -> None:
    with pytest.raises(SystemExit) as ended, progress_bars(stopped):
        raise KeyboardInterrupt
    assert ended.value.code == 130
    assert capsys.readouterr().err == f"{stopped}\n"


@pytest.mark.parametrize(("encoding", "shown"), [("ascii", "5 us, ?"), ("utf-8", "5 µs, √")])
def test_characters_that_the_encoding_lacks_are_replaced(
    monkeypatch: pytest.MonkeyPatch, encoding: str, shown: str
) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding=encoding))
    console.replace_unprintable()
    print("5 µs, √", end="", flush=True)
    assert raw.getvalue().decode(encoding) == shown


@pytest.mark.extended
def test_program_that_is_ended_leaves_no_unpacked_fmu(tmp_path: Path) -> None:
    fmu = Path(__file__).parents[2] / "fmus" / "linear" / "linear.fmu"
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    with subprocess.Popen([*COMMAND, "validate", str(fmu)], env=environment) as program:
        while not list(tmp_path.glob("*/modelDescription.xml")) and program.poll() is None:
            time.sleep(0.01)
        program.terminate()
        assert program.wait(HANGS) == KILLED
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (UnicodeEncodeError("utf-8", "a\udcff", 1, 2, "surrogates"), "bytes b'\\xff', which are"),
        (MemoryError(), "not enough memory: nothing is left"),
        (ImportError("x.so: failed to map segment from shared object"), "not enough memory: x.so"),
    ],
)
def test_names_of_other_encodings_and_a_full_memory_are_said(
    error: Exception, said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended, errors():
        raise error
    assert ended.value.code == 1
    assert said in " ".join(capfd.readouterr().err.split())
