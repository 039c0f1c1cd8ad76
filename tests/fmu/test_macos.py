"""The libraries for macOS, which does not run here, are what its loader asks for."""

from __future__ import annotations

import re
import struct
import zipfile
from pathlib import Path

import pytest

from slide_fmu.fmu.export import export_fmu
from slide_fmu.fmu.libraries.build import BINARIES, RUNTIME
from slide_fmu.fmu.libraries.platforms import universal_library
from tests.fmu.mach_o import ARM64, BUILD_VERSION, ID_DYLIB, LOAD_DYLIB, X86_64, MachO, slices
from tests.fmu.samples import Shape, random_surrogate
from tests.fmu.standards import functions
from tests.refusals import refused

FOLDERS = {X86_64: "x86_64-darwin", ARM64: "aarch64-darwin"}
PLATFORM_MACOS, VERSION_11 = 1, 11 << 16
OF_THE_LINKER = {"__mh_dylib_header", "___dso_handle"}
"""The library's own address, under the names that the linker of the pinned compiler adds."""

NATIVE = "".join(
    path.read_text(encoding="utf-8") for path in sorted((RUNTIME / "native").glob("*.h"))
)


def _library(processor: int, name: str = "slide") -> bytes:
    return (BINARIES / FOLDERS[processor] / f"{name}.dylib").read_bytes()


@pytest.mark.parametrize("processor", FOLDERS)
def test_library_for_macos_names_its_platform_and_needs_the_system_alone(processor: int) -> None:
    library = MachO(_library(processor))
    assert library.processor == processor
    assert library.libraries(ID_DYLIB) == ["@rpath/slide.dylib"]
    assert library.libraries(LOAD_DYLIB) == ["/usr/lib/libSystem.B.dylib"]
    platform, oldest = struct.unpack_from("<II", library.commands(BUILD_VERSION)[0])
    assert (platform, oldest) == (PLATFORM_MACOS, VERSION_11)


@pytest.mark.parametrize("processor", FOLDERS)
def test_functions_of_both_standards_are_exported_and_for_python_own_ones_too(
    processor: int,
) -> None:
    own = re.findall(r"^SLIDE_Export .*?(slide_native_\w+)\(", NATIVE, re.MULTILINE)
    both = {f"_{name}" for name in (*functions(2), *functions(3))} | OF_THE_LINKER
    assert own
    assert MachO(_library(processor)).exported() == both
    assert MachO(_library(processor, "slide_python")).exported() == both | {f"_{o}" for o in own}


def test_arm_part_is_signed() -> None:
    """macOS loads no code for arm64 without; an ad-hoc signature is enough."""
    library = _library(ARM64)
    assert MachO(library).has_valid_ad_hoc_signature()
    changed = library[:5000] + bytes([library[5000] ^ 1]) + library[5001:]
    assert not MachO(changed).has_valid_ad_hoc_signature()


def test_fmi_2_holds_a_universal_library_of_both(tmp_path: Path) -> None:
    path = export_fmu(random_surrogate(Shape()), tmp_path / "m.fmu")
    with zipfile.ZipFile(path) as archive:
        library = archive.read("binaries/darwin64/sample.dylib")
    assert slices(library) == {processor: _library(processor) for processor in FOLDERS}


def test_other_files_are_not_joined() -> None:
    with refused(ValueError, "expected a 64-bit Mach-O file"):
        universal_library([_library(ARM64), b"MZ\0\0"])
    with refused(ValueError, "expected different ones"):
        universal_library([_library(ARM64)] * 2)
