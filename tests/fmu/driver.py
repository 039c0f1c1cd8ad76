"""Build the C driver together with the runtime's sources."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from slide_fmu.fmu.libraries.build import BUILD, PER_KERNEL, WARNINGS, include_flags, runtime_files

NAMES = ("driver.c", "cell_driver.c")
DRIVERS = [Path(__file__).parent / "c" / name for name in NAMES]
SANITIZE = ["-g", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"]


def host_compilers() -> list[tuple[list[str], list[str]]]:
    """Compilers of this machine, best first, each with its sanitizer flags."""
    both = ["-fsanitize=address,undefined", *SANITIZE]
    compilers = [([path], both) for name in ("gcc", "clang") if (path := shutil.which(name))]
    zig = [sys.executable, "-m", "ziglang", "cc"]
    return [*compilers, (zig, ["-fsanitize=undefined", *SANITIZE])]


def run_compiler(command: list[str], arguments: list[str]) -> subprocess.CompletedProcess[str]:
    cache = str(BUILD / "cache")
    environment = {**os.environ, "ZIG_LOCAL_CACHE_DIR": cache, "ZIG_GLOBAL_CACHE_DIR": cache}
    return subprocess.run(
        [*command, *arguments], env=environment, capture_output=True, text=True, check=False
    )


def sanitizing_compiler(
    folder: Path, wanted: list[str] | None = None
) -> tuple[list[str], list[str]] | None:
    """The first compiler whose sanitized programs run, with its flags, or None.

    Args:
        wanted: flags; each compiler's own, for wrong addresses and behaviour, if None.
    """
    source, program = folder / "probe.c", folder / "probe"
    source.write_text("int main(void) { return 0; }\n")
    for command, own in host_compilers():
        flags = own if wanted is None else wanted
        built = run_compiler(command, [*flags, str(source), "-o", str(program)])
        if built.returncode == 0 and subprocess.run([program], check=False).returncode == 0:
            return command, flags
    return None


def required_sanitizer(
    folder: Path, wanted: list[str] | None = None
) -> tuple[list[str], list[str]]:
    """The same compiler and flags; the test is skipped where there are none."""
    compiler = sanitizing_compiler(folder, wanted)
    if compiler is None:
        pytest.skip(f"no compiler here can run sanitized programs ({wanted or 'its own flags'})")
    return compiler


def build_driver(command: list[str], flags: list[str], program: Path) -> Path:
    """Compile the driver and link it with the runtime; all warnings are errors.

    Args:
        command: the compiler.
        flags: for compiling and linking.
        program: the file to write; object files go beside it.
    """
    return build_program(command, flags, program, DRIVERS, {})


def build_program(
    command: list[str],
    flags: list[str],
    program: Path,
    own: list[Path],
    defines: dict[str, list[str]],
) -> Path:
    """Compile sources of a test and link them with the runtime; all warnings are errors.

    Also names that hide others: such a one once wrote results beside their places.

    Args:
        command: the compiler.
        flags: for compiling and linking.
        program: the file to write; object files go beside it.
        own: sources of the test.
        defines: more flags for sources of the runtime, by their names without the ending.
    """
    wide = ["-mavx2", "-mfma", "-ffp-contract=fast"]
    widest = [*wide, "-mavx512f", "-mavx512dq", "-mavx512bw", "-mavx512vl"]
    units: list[tuple[Path, str, list[str]]] = [(path, f"own_{path.stem}", []) for path in own]
    for path in runtime_files(".c"):
        if path.name in PER_KERNEL:
            for name, processor in (("baseline", []), ("avx2", wide), ("avx512", widest)):
                table = f"-DSLIDE_KERNEL=slide_kernel_{name}"
                units.append((path, f"{path.stem}_{name}", [table, *processor]))
        else:
            units.append((path, path.stem, defines.get(path.stem, [])))
    objects = []
    for source, stem, extra in units:
        objects.append(str(program.with_name(f"{stem}.o")))
        arguments = [*WARNINGS, "-Wshadow", *flags, "-O1", "-msse4.2", *extra, *include_flags()]
        arguments.append("-c")
        built = run_compiler(command, [*arguments, str(source), "-o", objects[-1]])
        assert built.returncode == 0, built.stderr
    linked = run_compiler(command, [*flags, *objects, "-lm", "-o", str(program)])
    assert linked.returncode == 0, linked.stderr
    return program
