"""Universal Mach-O files: libraries of several architectures of macOS in one file.

The layout is that of Apple's ``<mach-o/fat.h>``: a big-endian header that names, for each
architecture, the part of the file that holds its library.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

FAT_MAGIC = 0xCAFEBABE
MACH_O_64 = b"\xcf\xfa\xed\xfe"
"""First bytes of a little-endian 64-bit Mach-O file."""

ALIGNMENT = 14
"""Parts begin at a multiple of 2 to this power: the page size of arm64."""


def universal_library(libraries: Sequence[bytes]) -> bytes:
    """Join libraries of different architectures; the same libraries give the same bytes.

    Args:
        libraries: 64-bit Mach-O files.

    Raises:
        ValueError: one of them is no such file, or two are of the same architecture.
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
    """Type and subtype of the processor, from the header of a Mach-O file."""
    if library[:4] != MACH_O_64:
        raise ValueError(f"a file that begins with {library[:4]!r}; expected a 64-bit Mach-O file")
    processor, subtype = struct.unpack_from("<II", library, 4)
    return processor, subtype
