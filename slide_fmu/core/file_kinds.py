"""The suffix of a file's name says its kind, for messages about files of the wrong kind."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class FileKind:
    """A FileKind says what kind of file a name belongs to, and what a user can do with it.

    Attributes:
        what: the kind, with its article.
        remedy: what to do with the file; ``NAME`` stands for the file's name.
    """

    what: str
    remedy: str


def _of_tool(tool: str) -> FileKind:
    remedy = f"export the model from {tool} as an FMU for co-simulation, and name that"
    return FileKind(f"a file of {tool}", remedy)


_FMU = FileKind(
    "an FMU", "slide-fmu info NAME says what it is, slide-fmu init NAME starts from it"
)
_RECIPE = FileKind("a recipe or a task", "slide-fmu run NAME writes an FMU, and says where")
_PYTHON = FileKind("a Python file", "slide-fmu init NAME writes a first recipe for its model")
_RECORD = FileKind("a measured record", "slide-fmu init NAME writes a first recipe for it")
_SPREADSHEET = FileKind("a spreadsheet", "save its sheet as CSV, and name that file")

RECORD_FORMATS: dict[str, str] = {
    ".csv": "CSV",
    ".tsv": "CSV",
    ".txt": "CSV",
    ".parquet": "Parquet",
    ".h5": "HDF5",
    ".hdf5": "HDF5",
    ".hdf": "HDF5",
    ".mat": "MAT",
    ".npy": "NumPy",
    ".npz": "NumPy",
}
"""Formats of measured records by suffix, in lower case."""

SPREADSHEETS = (".xlsx", ".xls", ".xlsm", ".ods")
"""Suffixes of spreadsheets, which hold several tables."""

KINDS: dict[str, FileKind] = {
    ".fmu": _FMU,
    ".toml": _RECIPE,
    ".py": _PYTHON,
    **dict.fromkeys(RECORD_FORMATS, _RECORD),
    **dict.fromkeys(SPREADSHEETS, _SPREADSHEET),
    **dict.fromkeys((".slx", ".mdl", ".slxp"), _of_tool("Simulink")),
    **dict.fromkeys((".mo", ".mos", ".moe"), _of_tool("Modelica")),
    **dict.fromkeys((".xcos", ".zcos"), _of_tool("Xcos")),
    **dict.fromkeys((".rfmbd", ".rdyn"), _of_tool("RecurDyn")),
    ".ame": _of_tool("Amesim"),
    ".adm": _of_tool("Adams"),
    ".spck": _of_tool("Simpack"),
    ".msim": _of_tool("MapleSim"),
}
"""Kinds of files by suffix, in lower case."""


def record_formats() -> str:
    """Name the formats of measured records: ``CSV, Parquet, ... or MAT``."""
    *first, final = dict.fromkeys(RECORD_FORMATS.values())
    return f"{', '.join(first)} or {final}"


def file_of_another_kind(path: str | Path, expected: str) -> str | None:
    """Describe the kind of a file by its suffix, and the kind expected; None if it is unknown.

    The message continues the file's name: ``is a recipe or a task by its name; expected ...``.
    """
    kind = KINDS.get(Path(path).suffix.lower())
    if kind is None:
        return None
    remedy = kind.remedy.replace("NAME", Path(path).name)
    return f"is {kind.what} by its name; expected {expected}: {remedy}"
