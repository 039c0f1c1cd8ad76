"""A surrogate is written to an FMU file and read back."""

from __future__ import annotations

import json
import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import IO, Any

from slide_fmu.core.figures import JsonObject
from slide_fmu.core.file_kinds import file_of_another_kind
from slide_fmu.core.files import write_zip
from slide_fmu.core.zip_directory import open_archive
from slide_fmu.fmu.attachments.files import LICENSES, attached_files
from slide_fmu.fmu.description.fmi2 import TOOL, guid_of, model_description
from slide_fmu.fmu.description.fmi3 import model_description3
from slide_fmu.fmu.hashes import HASHES, hash_list
from slide_fmu.fmu.libraries.platforms import FmiVersion, libraries
from slide_fmu.fmu.libraries.sources import Sources, compiled_files, source_members
from slide_fmu.importer.errors import FmuError
from slide_fmu.importer.file import REMEDY
from slide_fmu.surrogate.payload import MAGIC, PayloadError, require_lengths
from slide_fmu.surrogate.surrogate import Surrogate

DESCRIPTION = "modelDescription.xml"
DOCUMENTATION, EXTRA = "documentation", "extra"
"""Folders for files that the runtime does not read."""
SURROGATE = "resources/surrogate.slide"
PROVENANCE = "resources/provenance.json"
PROVENANCE_FORMAT = 2
"""Format of the provenance. It is raised when a change of the recipe or of the measured figures
makes older FMUs unreadable; FMUs of other formats are refused."""

LARGEST = 2_000_000_000
"""Largest size of members in bytes, together or alone, to unpack: surrogates are small."""

LARGEST_TEXT = 20_000_000
"""Largest size of texts to parse, in bytes: in memory they take up to a hundred times more."""

LARGEST_SURROGATE = 200_000_000
"""Largest size of a surrogate in an FMU, in bytes: enough for fifty million weights."""

PARSED = {".csv", ".exp", ".json", ".srmd", ".ssv", ".xml"}
"""Archive members with these suffixes are texts that are parsed."""

Provenance = Mapping[str, Any]
"""The origin of an FMU, as its JSON holds it: ``recipe``, the text; the ``resolved`` values;
``seeds`` and ``versions``; the ``measured`` figures; the version that the documents are
``written_by``; and values of records and apps."""


def export_fmu(
    surrogate: Surrogate,
    path: str | Path,
    *,
    fmi: FmiVersion = 2,
    provenance: Provenance | None = None,
    documentation: Mapping[str, bytes] | None = None,
    extra: Mapping[str, bytes] | None = None,
    sources: Sources = False,
) -> Path:
    """Write a surrogate as co-simulation FMU; the same arguments give the same bytes.

    Args:
        surrogate: its name becomes the model identifier.
        path: the FMU file; an old file is replaced as a whole.
        fmi: version of the standard: 2.0 or 3.0.
        provenance: origin of the surrogate, as JSON values.
        documentation: files of the documentation folder, by name; ``index.html`` is the first
            page. The folder ``licenses`` is always written.
        extra: files of the folder ``extra``, by name; the runtime does not read them.
        sources: whether to write the C sources too, for targets without a compiled library;
            "scalar": sources without vector types and dynamic memory, for controllers.

    Returns:
        The path.

    Raises:
        ValueError: names of variables, documentation or extra files are not usable.
        FileNotFoundError: the runtime has not been compiled.
        NativeError: scalar sources need a compiled library for this computer, and there is none.
        OSError: the file cannot be written.
    """
    path = Path(path)
    if path.suffix != ".fmu":
        raise ValueError(f"FMU {str(path)!r}; expected a name ending in .fmu")
    payload = surrogate.to_bytes()
    if fmi == 3:
        description = model_description3(surrogate, guid_of(payload))
    else:
        files = compiled_files() if sources else ()
        description = model_description(surrogate, guid_of(payload), files)
    members = {
        DESCRIPTION: description,
        SURROGATE: payload,
        **libraries(surrogate.name, fmi),
        **(source_members(surrogate.name, payload, fmi, sources == "scalar") if sources else {}),
    }
    if provenance is not None:
        stated = {**provenance, "format": PROVENANCE_FORMAT}
        text = json.dumps(stated, sort_keys=True, indent=2, ensure_ascii=False)
        members[PROVENANCE] = text.encode("utf-8")
    for folder, files_of in ((DOCUMENTATION, documentation), (EXTRA, extra)):
        for name, content in (files_of or {}).items():
            members[f"{folder}/{_checked_name(folder, name)}"] = content
    members |= attached_files(fmi)
    members.pop(HASHES, None)
    write_zip(path, {**members, HASHES: hash_list(members)})
    return path


def load(path: str | Path) -> Surrogate:
    """Read the surrogate out of an FMU or of a surrogate file.

    The content of the file decides what it is, not its name. The surrogate computes in numpy the
    same results as the FMU in C.

    Args:
        path: an FMU that slide-fmu wrote (``.fmu``), or a surrogate file from a run folder
            (``surrogate.slide``).

    Returns:
        The surrogate, with its error estimator if it has one.

    Raises:
        FileNotFoundError: there is no such file.
        FmuError: the file is neither, or an FMU that slide-fmu did not write, or damaged.
        PayloadError: the surrogate file is damaged, or of another version.
        OSError: the file cannot be read.
    """
    if not isinstance(path, str | Path):
        raise FmuError(f"load({path!r}); expected the path of an FMU or of a surrogate file")
    if not Path(path).is_file():
        raise FileNotFoundError(
            f"{str(path)!r} is no file; expected an FMU that slide-fmu wrote (.fmu), or the "
            "surrogate.slide of a run folder: correct the path"
        )
    path = Path(path)
    with path.open("rb") as file:
        beginning = file.read(len(MAGIC))
    if beginning == MAGIC:
        return Surrogate.from_bytes(path.read_bytes())
    if zipfile.is_zipfile(path):
        return read_fmu(path)[0]
    raise FmuError(
        f"{path} begins with {beginning!r} and is neither an FMU nor a surrogate file; expected "
        "an FMU that slide-fmu wrote (.fmu), or the surrogate.slide of a run folder"
    )


def read_fmu(path: Path) -> tuple[Surrogate, Provenance | None]:
    """Read the surrogate and its provenance from an FMU.

    Raises:
        FmuError: the file is not an FMU, not an FMU of slide-fmu, damaged, or its provenance has
            the format of another version.
        OSError: the file cannot be read.
    """
    beginning = read_member(path, SURROGATE, len(MAGIC))
    if beginning is None:
        if read_member(path, DESCRIPTION) is None:
            raise FmuError(f"{path} is no FMU: expected {DESCRIPTION} in it; {REMEDY}")
        tool = _tool_of(path)
        if tool == TOOL:
            raise FmuError(
                f"{path} has no {SURROGATE}, which holds the surrogate; expected it in every FMU "
                f"of slide-fmu; {REMEDY}"
            )
        if read_member(path, f"{LICENSES}/slide-fmu.txt") is not None:
            raise FmuError(
                f"{path} was written by slide-fmu reference and holds no surrogate; expected the "
                "FMU of one: make it of the same model (slide-fmu init, then slide-fmu run)"
            )
        by = "" if tool is None else f" but by {tool!r}"
        raise FmuError(
            f"{path} was not made by slide-fmu{by}: expected {SURROGATE} in it; an "
            "FMU of another tool can be a model to learn from (slide-fmu init FMU), and fmpy "
            "checks it (fmpy validate FMU)"
        )
    provenance = _read_provenance(path)
    try:
        if beginning != MAGIC:  # it is not a surrogate, so nothing more is unpacked
            Surrogate.from_bytes(beginning)
        with _opened(path, SURROGATE) as member:
            if member is not None:
                require_lengths(*member)
        surrogate = Surrogate.from_bytes(read_member(path, SURROGATE) or b"")
    except PayloadError as error:
        raise FmuError(f"{path}: {error}; {REMEDY}") from error
    return surrogate, provenance


def _read_provenance(path: Path) -> Provenance | None:
    """Read the origin of a surrogate; None if the FMU does not contain it."""
    provenance = read_json(path, PROVENANCE)
    if provenance is not None and provenance.pop("format", None) != PROVENANCE_FORMAT:
        versions = provenance.get("versions")
        by = versions.get("slide-fmu") if isinstance(versions, dict) else None
        raise FmuError(
            f"{path} was made by another state of slide-fmu ({by or 'its version is not known'}), "
            "in a form that this version does not read; run its recipe again with this version, "
            "or use the version that made it"
        )
    return provenance


def _tool_of(path: Path) -> str | None:
    """Return the tool that made an FMU, if the FMU names it."""
    tool = re.search(rb'generationTool="([^"]*)"', read_member(path, DESCRIPTION) or b"")
    return None if tool is None else tool[1].decode("utf-8", "replace")


def read_json(path: Path, name: str) -> JsonObject | None:
    """Read a JSON object in an FMU; None if there is no such file; null stands for NaN.

    Raises:
        FmuError: the file is not a zip archive or is damaged, or has no JSON object.
        OSError: the file cannot be read.
    """
    text = read_member(path, name)
    if text is None:
        return None
    try:
        content = json.loads(text, parse_constant=lambda constant: None)
        # lone surrogate characters and infinite numbers could not be written again
        json.dumps(content, ensure_ascii=False, allow_nan=False).encode("utf-8")
    except (ValueError, RecursionError) as error:
        raise FmuError(f"{path}: {name} is no JSON: {error}; {REMEDY}") from error
    if not isinstance(content, dict):
        raise FmuError(f"{path}: {name} holds no JSON object; {REMEDY}")
    return content


def read_member(path: Path, name: str, beginning: int | None = None) -> bytes | None:
    """Read one file of an FMU; None if it has no such file.

    Args:
        path: the FMU.
        name: name of the file in it.
        beginning: largest number of bytes to read; all if None.

    Raises:
        FmuError: the file is not a zip archive or is damaged, or the content is very large.
        OSError: the file cannot be read.
    """
    with _opened(path, name) as member:
        if member is None:
            return None
        return member[0].read() if beginning is None else member[0].read(beginning)


@contextmanager
def _opened(path: Path, name: str) -> Iterator[tuple[IO[bytes], int] | None]:
    """Open one file of an FMU, with its size in bytes; None if it has no such file."""
    try:
        with open_archive(path) as archive:
            if name not in archive.namelist():
                yield None
                return
            size, most = archive.getinfo(name).file_size, _most_bytes(name)
            if size > most:
                raise FmuError(f"{path}: {name} has {size} bytes; expected at most {most}")
            with archive.open(name) as file:
                yield file, size
    except (zipfile.BadZipFile, zlib.error, EOFError) as error:
        raise _no_archive(path, error) from error
    except (NotImplementedError, RuntimeError) as error:
        raise FmuError(f"{path}: cannot unpack {name}: {error}; {REMEDY}") from error
    except OSError as error:
        if error.filename is not None:
            raise
        raise FmuError(
            f"{path} is damaged: its directory points elsewhere: {error}; {REMEDY}"
        ) from error


def _most_bytes(name: str) -> int:
    """Return the largest number of bytes that a file of an FMU may have."""
    if name == SURROGATE:
        return LARGEST_SURROGATE
    return LARGEST_TEXT if PurePosixPath(name).suffix in PARSED else LARGEST


def read_folder(path: Path, folder: str) -> dict[str, bytes]:
    """Read the files of a folder of an FMU, by name; empty if there is no such folder.

    Raises:
        FmuError: the file is not a zip archive or is damaged, or the content is very large.
        OSError: the file cannot be read.
    """
    try:
        with open_archive(path) as archive:
            names = [name for name in archive.namelist() if name.startswith(f"{folder}/")]
    except zipfile.BadZipFile as error:
        raise _no_archive(path, error) from error
    members = {name: read_member(path, name) for name in names if not name.endswith("/")}
    return {n.removeprefix(f"{folder}/"): text for n, text in members.items() if text is not None}


def _no_archive(path: Path, error: Exception) -> FmuError:
    """Return an error: a file is not an FMU, with the kind that its name suggests."""
    other = file_of_another_kind(path, "an FMU (.fmu)")
    if other is not None and path.suffix != ".fmu":
        return FmuError(f"{path} {other}")
    return FmuError(f"{path} is no FMU or is damaged: {error}; {REMEDY}")


def _checked_name(folder: str, name: str) -> str:
    path = PurePosixPath(name)
    if path.is_absolute() or not path.parts or ".." in path.parts or "\\" in name:
        raise ValueError(
            f"{folder} file {name!r}; expected a relative name inside the folder, with /"
        )
    return str(path)
