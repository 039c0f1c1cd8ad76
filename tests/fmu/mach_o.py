"""A reader of Mach-O libraries (Apple's ``<mach-o/loader.h>``), as far as the tests look."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator
from dataclasses import dataclass

X86_64, ARM64 = 0x01000007, 0x0100000C
DYNAMIC_LIBRARY = 6
ID_DYLIB, LOAD_DYLIB, CODE_SIGNATURE, BUILD_VERSION = 0xD, 0xC, 0x1D, 0x32
DYLD_INFO_ONLY = 0x80000022
SIGNATURE, CODE_DIRECTORY, AD_HOC = 0xFADE0CC0, 0xFADE0C02, 0x2


def slices(library: bytes) -> dict[int, bytes]:
    """Parts of a universal library by type of processor."""
    magic, count = struct.unpack_from(">II", library)
    assert magic == 0xCAFEBABE
    parts = {}
    for index in range(count):
        row = struct.unpack_from(">IIIII", library, 8 + 20 * index)
        processor, _, offset, size, alignment = row
        assert offset % (1 << alignment) == 0
        parts[processor] = library[offset : offset + size]
        assert len(parts[processor]) == size
    return parts


@dataclass(frozen=True)
class MachO:
    """One 64-bit library."""

    content: bytes

    @property
    def processor(self) -> int:
        magic, processor, _, kind = struct.unpack_from("<IIII", self.content)
        assert (magic, kind) == (0xFEEDFACF, DYNAMIC_LIBRARY)
        return int(processor)

    def commands(self, kind: int) -> list[bytes]:
        """Load commands of one kind, without their first eight bytes."""
        (count,), at, commands = struct.unpack_from("<I", self.content, 16), 32, []
        for _ in range(count):
            command, size = struct.unpack_from("<II", self.content, at)
            if command == kind:
                commands.append(self.content[at + 8 : at + size])
            at += size
        return commands

    def libraries(self, kind: int) -> list[str]:
        """Names in the commands ID_DYLIB or LOAD_DYLIB."""
        return [command[16:].rstrip(b"\0").decode() for command in self.commands(kind)]

    def exported(self) -> set[str]:
        """Names of exported symbols, from the trie that the loader reads."""
        (start,) = (struct.unpack("<10I", c)[8] for c in self.commands(DYLD_INFO_ONLY))
        return set(self._names(start, start, ""))

    def _names(self, trie: int, node: int, prefix: str) -> Iterator[str]:
        """Names below a node; sizes and places are numbers of seven bits a byte."""
        size, at = self._number(node)
        if size > 0:
            yield prefix
        at += size
        children = self.content[at]
        at += 1
        for _ in range(children):
            end = self.content.index(b"\0", at)
            label = self.content[at:end].decode()
            child, at = self._number(end + 1)
            yield from self._names(trie, trie + child, prefix + label)

    def _number(self, at: int) -> tuple[int, int]:
        """A number in LEB128, and the place after it."""
        value = shift = 0
        while True:
            byte = self.content[at]
            value |= (byte & 0x7F) << shift
            at, shift = at + 1, shift + 7
            if not byte & 0x80:
                return value, at

    def has_valid_ad_hoc_signature(self) -> bool:
        """Is there a code directory, marked ad hoc, whose hashes are those of the pages?"""
        commands = self.commands(CODE_SIGNATURE)
        if not commands:
            return False
        start, _ = struct.unpack("<II", commands[0])
        magic, _, blobs = struct.unpack_from(">III", self.content, start)
        assert magic == SIGNATURE
        for index in range(blobs):
            (offset,) = struct.unpack_from(">I", self.content, start + 16 + 8 * index)
            (kind,) = struct.unpack_from(">I", self.content, start + offset)
            if kind == CODE_DIRECTORY:
                return self._pages_match(start + offset)
        return False

    def _pages_match(self, directory: int) -> bool:
        flags, hashes = struct.unpack_from(">II", self.content, directory + 12)
        pages, limit = struct.unpack_from(">II", self.content, directory + 28)
        size, _, _, exponent = struct.unpack_from(">BBBB", self.content, directory + 36)
        at, page = directory + hashes, 1 << exponent
        return bool(flags & AD_HOC) and all(
            hashlib.sha256(self.content[k * page : min((k + 1) * page, limit)]).digest()
            == self.content[at + k * size : at + (k + 1) * size]
            for k in range(pages)
        )
