"""Where the compiled libraries lie in an FMU: the names of platforms in FMI 2.0 and FMI 3.0."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from slide_fmu.fmu.libraries.build import BINARIES, TARGETS
from slide_fmu.fmu.libraries.universal import universal_library

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
"""By standard: folder below ``binaries`` of an FMU, and the compiled libraries that it holds as
one file. FMI 2.0 (section 2.3) has no folder for Linux on aarch64, and one for macOS, whose
library is universal; folders of FMI 3.0 (platform tuples) are of one architecture."""


def library_members(name: str, fmi: FmiVersion) -> dict[str, tuple[str, ...]]:
    """Name the libraries in an FMU with a model identifier, and the compiled ones in each."""
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
        parts = [_compiled(source) for source in sources]
        contents[member] = parts[0] if len(parts) == 1 else universal_library(parts)
    return contents


def _compiled(source: str) -> bytes:
    path = BINARIES / source
    if not path.is_file():
        raise FileNotFoundError(
            f"the compiled runtime {path} is missing; run: python -m slide_fmu.fmu.libraries.build"
        )
    return path.read_bytes()
