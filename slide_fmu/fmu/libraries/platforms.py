"""FMI 2.0 and FMI 3.0 name platforms differently; here are the library folders of both.

FMI 2.0 has one folder for macOS, whose library is a universal Mach-O file: libraries of several
architectures in one. Apple's ``<mach-o/fat.h>`` defines its layout: a big-endian header with the
position of each architecture's library in the file.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Literal

from slide_fmu.fmu.libraries.build import BINARIES, RUNTIME, STAMP, TARGETS, BuildError, digest

COMMAND = "python -m slide_fmu.fmu.libraries.build"
"""It compiles the libraries."""

CLONE = Path(__file__).parents[3]
"""Folder of the repository, where the package is used from a clone."""

FmiVersion = Literal[2, 3]
"""Major version of the standard."""

DARWIN = ("x86_64-darwin/slide.dylib", "aarch64-darwin/slide.dylib")

PLATFORMS: Mapping[FmiVersion, Mapping[str, tuple[str, ...]]] = {
    2: {
        "linux64": ("x86_64-linux/slide.so",),
        "win64": ("x86_64-windows/slide.dll",),
        "darwin64": DARWIN,
    },
    3: {target.split("/")[0]: (target,) for target in TARGETS},
}
"""By standard: folder below ``binaries`` of an FMU, and the compiled libraries in its one file.
FMI 2.0 (section 2.3) has no folder for Linux on aarch64; a folder of FMI 3.0 (platform tuple) has
one architecture."""

FAT_MAGIC = 0xCAFEBABE
MACH_O_64 = b"\xcf\xfa\xed\xfe"
"""First bytes of a little-endian 64-bit Mach-O file."""

ALIGNMENT = 14
"""Parts begin at a multiple of 2 to this power: the page size of arm64."""


class OldLibrariesError(RuntimeError):
    """The compiled libraries were built from other sources than the present ones."""


def library_members(name: str, fmi: FmiVersion) -> dict[str, tuple[str, ...]]:
    """Return the libraries of an FMU with a model identifier, with the compiled ones in each."""
    return {
        f"binaries/{platform}/{name}.{sources[0].rpartition('.')[2]}": sources
        for platform, sources in PLATFORMS[fmi].items()
    }


def libraries(name: str, fmi: FmiVersion) -> dict[str, bytes]:
    """Read all libraries of an FMU with a model identifier.

    Raises:
        FileNotFoundError: the runtime has not been compiled.
    """
    contents = {}
    for member, sources in library_members(name, fmi).items():
        parts = [compiled(source) for source in sources]
        contents[member] = parts[0] if len(parts) == 1 else universal_library(parts)
    return contents


def compiled(source: str) -> bytes:
    """Read a compiled library, by its name below ``binaries``.

    Raises:
        FileNotFoundError: the runtime has not been compiled.
        OldLibrariesError: it was compiled from other sources.
    """
    path = BINARIES / source
    if not path.is_file():
        raise FileNotFoundError(f"the compiled runtime {path} is missing; run: {COMMAND}")
    require_new_libraries()
    return path.read_bytes()


def require_new_libraries() -> None:
    """Refuse libraries that are older than the sources; missing ones are not told here.

    Only a clone has sources that change: an installed package holds the libraries of its own, and
    maybe other headers than those that they were compiled with.

    Raises:
        OldLibrariesError: the message has the command that builds them.
    """
    stamp = BINARIES / STAMP
    if not (CLONE / "pyproject.toml").is_file() or not stamp.is_file():
        return
    with suppress(BuildError):  # headers of the standards are missing: nobody knows
        if stamp.read_text() != _digest():
            raise OldLibrariesError(
                f"the compiled runtime in {BINARIES} is older than its sources in {RUNTIME}; "
                f"expected one of these sources; run: {COMMAND}"
            )


@cache
def _digest() -> str:
    """Return the digest of the sources, which no process changes that uses the libraries."""
    return digest()


def universal_library(libraries: Sequence[bytes]) -> bytes:
    """Join libraries of different architectures; the same libraries give the same bytes.

    Args:
        libraries: 64-bit Mach-O files.

    Raises:
        ValueError: one is not such a file, or two have the same architecture.
    """
    page = 1 << ALIGNMENT
    header = struct.pack(">II", FAT_MAGIC, len(libraries))
    body = b"\0" * page
    architectures = [_architecture(library) for library in libraries]
    if len(set(architectures)) < len(architectures):
        raise ValueError(f"Mach-O files of architectures {architectures}; expected different ones")
    for (processor, subtype), library in zip(architectures, libraries, strict=True):
        header += struct.pack(">IIIII", processor, subtype, len(body), len(library), ALIGNMENT)
        body += library + b"\0" * (-len(library) % page)
    return header + body[len(header) :]


def _architecture(library: bytes) -> tuple[int, int]:
    """Return type and subtype of the processor, from the header of a Mach-O file."""
    if library[:4] != MACH_O_64:
        raise ValueError(f"a file that begins with {library[:4]!r}; expected a 64-bit Mach-O file")
    processor, subtype = struct.unpack_from("<II", library, 4)
    return processor, subtype
