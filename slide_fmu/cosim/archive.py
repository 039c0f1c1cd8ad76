"""The archive of an FMU is checked before anything in it is unpacked or run."""

from __future__ import annotations

import hashlib
import re
import stat
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

from slide_fmu.core.zip_directory import leaves, open_archive
from slide_fmu.fmu.export import LARGEST, SURROGATE, read_member
from slide_fmu.fmu.hashes import HASHES
from slide_fmu.fmu.libraries.platforms import FmiVersion, libraries
from slide_fmu.fmu.libraries.sources import FOLDER, source_members
from slide_fmu.fmu.native_library import NativeError

BINARIES = "binaries/"
"""Folder of the libraries of an FMU (FMI 2.0, section 2.3; FMI 3.0, section 2.5)."""

LINE = re.compile(r"([0-9a-f]{64})  (.+)")
"""A line of the list of hashes."""

SHOWN = 5
"""Largest number of members that a message names."""

UNUSUAL = re.compile(r'[\x00-\x1f\x7f<>:"|?*\\]')
"""Characters that some systems do not allow in names, so that they unpack to other names."""


def archive_problems(path: Path) -> list[str]:
    """Name members that leave the folder of the FMU, occur twice, or unpack to very much.

    Links are named too, as are members that systems or importers unpack to different places: the
    files that are checked would not be the files that are run.

    Raises:
        zipfile.BadZipFile, OSError: the file is not an archive, or cannot be read.
    """
    with open_archive(path, outside=True) as archive:
        members = archive.infolist()
    names = Counter(member.filename for member in members)
    problems = [
        f"member {name!r} leaves the folder of the FMU; expected names below it: do not unpack it"
        for name in names
        if leaves(name)
    ]
    problems += [
        f"member {name!r} is there {count} times; expected once: importers may read either"
        for name, count in names.items()
        if count > 1
    ]
    problems += [
        f"member {member.filename!r} is a link; expected files and folders: do not unpack it"
        for member in members
        if stat.S_ISLNK(member.external_attr >> 16)
    ]
    problems += _ambiguous(names)
    begin = min((member.header_offset for member in members), default=0)
    if begin > 0:
        problems.append(
            f"the archive begins with {begin} bytes that are no member; expected none, since "
            "importers may find other members there: do not unpack it"
        )
    size = sum(member.file_size for member in members)
    if size > LARGEST:
        problems.append(
            f"the FMU unpacks to {size / 1e9:.3g} GB; expected at most {LARGEST / 1e9:.3g} GB: do "
            "not unpack it"
        )
    return problems


def library_problems(path: Path, name: str, fmi: FmiVersion, trusted: bool) -> list[str]:
    """Name the libraries of an FMU, for any platform, that differ from this version's.

    Args:
        path: the FMU.
        name: its model identifier.
        fmi: its version of the standard.
        trusted: whether to accept other libraries, such as those that users compile from the
            sources.

    Raises:
        FileNotFoundError: the runtime has not been compiled here.
        FmuError, OSError: the file cannot be read.
    """
    known = libraries(name, fmi)
    problems = []
    for member, expected in known.items():
        content = read_member(path, member)
        if content is None:
            problems.append(f"binary {member} is missing; export again")
        elif content != expected and not trusted:
            problems.append(
                f"binary {member} has the SHA-256 hash {_hash(content)}; expected "
                f"{_hash(expected)}: it is damaged, foreign, or of another version "
                "of slide-fmu; export again, or run it all the same (--run)"
            )
    if trusted:
        return problems
    with open_archive(path) as archive:
        names = [name for name in archive.namelist() if not name.endswith("/")]
    others = {name for name in names if name.casefold().startswith(BINARIES)}
    problems += [
        f"binary {member} is not of slide-fmu; expected {', '.join(known)}: export again"
        for member in sorted(others - set(known))
    ]
    return problems


def source_problems(path: Path, name: str, fmi: FmiVersion) -> list[str]:
    """Say whether the C sources of an FMU, if it has some, are those of this version.

    Importers compile and run them. Scalar sources can be compared only with a compiled library for
    this computer, which gives the memory they need.

    Args:
        path: the FMU.
        name: its model identifier.
        fmi: its version of the standard.

    Raises:
        FmuError, OSError: the file cannot be read.
    """
    with open_archive(path) as archive:
        members = [member for member in archive.namelist() if not member.endswith("/")]
    sources = {member for member in members if member.casefold().startswith(f"{FOLDER}/")}
    if not sources:
        return []
    try:
        scalar = any(member.endswith("CustomFMU.xml") for member in sources)
        known = source_members(name, read_member(path, SURROGATE) or b"", fmi, scalar)
    except NativeError as error:
        return [
            f"the {len(sources)} files in {FOLDER}/ cannot be compared with those of slide-fmu: "
            f"{error}; check the FMU on another computer, or take them as they are (--run)"
        ]
    every = sorted(sources | set(known))
    others = [member for member in every if read_member(path, member) != known.get(member)]
    if not others:
        return []
    return [
        f"{len(others)} of {len(every)} files in {FOLDER}/ are not those of slide-fmu, "
        f"{others[0]} first: they are damaged, foreign, or of another version of slide-fmu; "
        "export again, or take them as they are (--run)"
    ]


def hash_problems(path: Path, free: Collection[str] = ()) -> list[str]:
    """Compare the members of an FMU with its list.

    Args:
        path: the FMU, whose archive has no problems.
        free: folders whose files users may change, such as ``binaries/``.

    Raises:
        FmuError: the file is not an archive, or is damaged.
        OSError: it cannot be read.
    """
    content = read_member(path, HASHES)
    if content is None:
        return [
            f"{HASHES} is missing, the list of the hashes of all members; expected in every FMU "
            "of this version: export again"
        ]
    lines = content.decode("utf-8", "replace").splitlines()
    listed = {match[2]: match[1] for line in lines if (match := LINE.fullmatch(line)) is not None}
    with open_archive(path) as archive:
        names = {name for name in archive.namelist() if not name.endswith("/")} - {HASHES}
    kept = sorted(name for name in names | listed.keys() if not name.startswith(tuple(free)))
    missing = [name for name in kept if name not in names]
    added = [name for name in kept if name not in listed]
    both = [name for name in kept if name in names and name in listed]
    changed = [name for name in both if _sha256(path, name) != listed[name]]
    kinds = (("has another content", changed), ("is missing", missing), ("was added", added))
    return [
        f"{_listed(which)} {what} since the FMU was written, by the hashes in {HASHES}; get the "
        "file again, or write it again"
        for what, which in kinds
        if which
    ]


def _listed(names: list[str]) -> str:
    more = f" (and {len(names) - SHOWN} more)" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more


def _sha256(path: Path, name: str) -> str:
    return hashlib.sha256(read_member(path, name) or b"").hexdigest()


def _ambiguous(names: Iterable[str]) -> Iterator[str]:
    """Name members below the folder of the FMU whose place differs between systems."""
    places = defaultdict(list)
    for name in names:
        if leaves(name):
            continue
        parts = name.removesuffix("/").split("/")
        if any(part != part.rstrip(" .") or not part or UNUSUAL.search(part) for part in parts):
            yield (
                f"member {name!r} is unpacked to different places by different programs; expected "
                "plain names with one / between folders: do not unpack it"
            )
        places[unicodedata.normalize("NFC", "/".join(parts)).casefold()].append(name)
    for same in places.values():
        if len(same) > 1:
            yield (
                f"members {same} are one file on systems that do not distinguish capital and "
                "small letters; expected one of them: do not unpack it"
            )


def _hash(content: bytes) -> str:
    return f"{hashlib.sha256(content).hexdigest()[:12]}..."
