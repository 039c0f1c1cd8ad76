"""Compile the C runtime for all platforms with the compiler of the PyPI package ``ziglang``.

Run ``python -m slide_fmu.fmu.libraries.build`` by hand; after a change of the runtime,
``--record`` writes the hashes of its libraries. ``hatch_build.py`` calls it when a wheel is built.
It imports only the standard library, so that it runs before the package is installed.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.machinery
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

RUNTIME = Path(__file__).parents[1] / "runtime"
BINARIES = Path(__file__).parents[1] / "binaries"
BUILD = Path(__file__).parents[3] / "build" / "runtime"
STAMP = "sources.sha256"

TARGETS = {
    "x86_64-linux/slide.so": "x86_64-linux-gnu.2.17",
    "x86_64-windows/slide.dll": "x86_64-windows-gnu",
    "x86_64-darwin/slide.dylib": "x86_64-macos.11.0",
    "aarch64-darwin/slide.dylib": "aarch64-macos.11.0",
    "aarch64-linux/slide.so": "aarch64-linux-gnu.2.17",
}
"""Libraries below ``binaries``, with the target of each. Folders have the platform names of FMI
3.0."""

PAGE_LIBRARY = "wasm32-wasi/slide.wasm"
"""The runtime as WebAssembly, for pages (``slide_fmu/apps/page``); no FMU holds it."""

PYTHON_LIBRARIES = {
    name.replace("slide.", "slide_python."): target for name, target in TARGETS.items()
}
"""The same libraries with the functions for Python; no FMU holds them."""

LIBRARIES = {**TARGETS, **PYTHON_LIBRARIES, PAGE_LIBRARY: "wasm32-wasi"}
"""All libraries, with the target of each."""

HASHES = Path(__file__).parent / "hashes.sha256"
"""SHA-256 of every library from the pinned compiler, in the format of sha256sum."""

BASELINE = {"x86_64": "x86_64_v2", "aarch64": "baseline", "wasm32": "generic+simd128"}
"""Processor that the code is compiled for, by architecture. Browsers have had the vectors of
WebAssembly since 2023."""

AVX2 = "x86_64_v2+avx2+fma-slow_unaligned_mem_32"
"""The parts of x86-64-v3 that kernels use. Processors of v2 read 32 unaligned bytes at once
slowly; the code must not split such reads on others for that."""

KERNELS = {
    "x86_64": {
        "slide_kernel_baseline": BASELINE["x86_64"],
        "slide_kernel_avx2": AVX2,
        "slide_kernel_avx512": f"{AVX2}+avx512f+avx512dq+avx512bw+avx512vl",
    },
    "aarch64": {"slide_kernel_baseline": BASELINE["aarch64"]},
    "wasm32": {"slide_kernel_baseline": BASELINE["wasm32"]},
}
"""Kernel tables with the instruction set of each, by architecture."""

WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wmissing-prototypes", "-Werror"]
CODE = [
    "-fvisibility=hidden",
    "-fno-math-errno",
    "-ffunction-sections",
    "-fno-unwind-tables",
    "-fno-asynchronous-unwind-tables",
    "-fno-stack-protector",
    "-DNDEBUG",
]
FAST = "-O3"
SMALL = "-Os"
"""Optimisation outside ``HOT_FOLDERS``, where speed would only make FMUs larger. ``HOT_FOLDERS``
take most of the time of a step."""

LINK = ["-s", "-lm", "-fno-sanitize=undefined"]
"""Without the last one, zig compiles a library of its sanitizer for each target, which nothing
uses."""
LINK_OF = {
    "linux": ["-shared", "-Wl,-Bsymbolic", "-Wl,--gc-sections"],
    "windows": ["-shared", "-Wl,--gc-sections"],
    "macos": ["-shared", "-Wl,-install_name,@rpath/slide.dylib", "-Wl,-dead_strip"],
    "wasi": ["-mexec-model=reactor", "-Wl,--gc-sections", "-Wl,--export-dynamic"],
}
"""Further options of the linker, by operating system."""


PER_KERNEL = {
    "kernel.c": (FAST, FAST),
    "record_back.c": (SMALL, SMALL),
    "record_forward.c": (FAST, FAST),
    "record_signals.c": (FAST, SMALL),
}
"""Files that are compiled once for each instruction set, with their options: the usual ones, and
those for the slowest of several. Every other file is compiled once."""

HOT_FOLDERS = ("features", "kernel")
"""Folders whose files are compiled for speed."""

LIBRARY_FOLDERS = (
    *("bytes", "kernel", "features", "network", "window", "derivative"),
    *("calls", "fmi2", "fmi3", "records", "native"),
)
"""Folders of the runtime whose files form the library, from the bottom up."""

PYTHON_FOLDERS = ("records", "native")
"""Folders that only the libraries for Python have."""

PAGE_FOLDERS = (
    *(name for name in LIBRARY_FOLDERS if name not in ("fmi2", "fmi3", *PYTHON_FOLDERS)),
    "wasm",
)
"""Folders whose files form the library of pages; ``wasm`` replaces some files of the others."""

SOURCE_FOLDERS = {
    fmi: tuple(name for name in LIBRARY_FOLDERS if name not in (other, *PYTHON_FOLDERS))
    for fmi, other in ((2, "fmi3"), (3, "fmi2"))
}
"""Folders that a source FMU needs, by the major version of the standard; the folders ``source``
and ``scalar`` replace some of their files."""

STANDARD_HEADERS = {
    2: ("fmi2TypesPlatform.h", "fmi2FunctionTypes.h", "fmi2Functions.h"),
    3: ("fmi3PlatformTypes.h", "fmi3FunctionTypes.h", "fmi3Functions.h"),
}
"""The headers that the FMI project publishes, by the major version of the standard."""


class BuildError(RuntimeError):
    """The compiler or a header is missing, or the compiler refused the sources."""


def digest() -> str:
    """Return the SHA-256 of all that determines the libraries: sources, headers, this file."""
    total = hashlib.sha256()
    files = runtime_files(folders=(*LIBRARY_FOLDERS, "wasm"))
    for path in [*files, *standard_headers(2), *standard_headers(3), Path(__file__)]:
        total.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return total.hexdigest()


def runtime_files(suffix: str = "", folders: tuple[str, ...] = LIBRARY_FOLDERS) -> list[Path]:
    """Return the files of some folders of the runtime, sorted by name; names are unique.

    Args:
        suffix: ``.c`` or ``.h``; both if empty.
        folders: below ``runtime``.
    """
    files = [
        path for folder in folders for path in (RUNTIME / folder).glob(f"*{suffix or '.[ch]'}")
    ]
    return sorted(files, key=lambda path: path.name)


def include_flags() -> list[str]:
    """Return the compiler options for the headers of the runtime and of the standards."""
    own = [f"-I{RUNTIME / folder}" for folder in LIBRARY_FOLDERS]
    return [
        *own,
        "-isystem",
        str(standard_headers(2)[0].parent),
    ]  # system headers give no warnings


def standard_headers(fmi: int) -> list[Path]:
    """Return the headers of FMI 2.0 or FMI 3.0 in the package fmpy, without importing it.

    Raises:
        BuildError: the package or one of them is missing.
    """
    package = importlib.machinery.PathFinder.find_spec("fmpy")
    places = [] if package is None else list(package.submodule_search_locations or ())
    for place in places:
        headers = [Path(place, "c-code", name) for name in STANDARD_HEADERS[fmi]]
        if all(header.is_file() for header in headers):
            return headers
    raise BuildError(
        f"the headers {', '.join(STANDARD_HEADERS[fmi])} of FMI {fmi}.0 are missing; expected in "
        "the folder c-code of the module fmpy: pip install fmpy"
    )


def build_all(force: bool = False) -> list[Path]:
    """Compile all libraries, unless they were built from the present sources.

    Afterwards the folder holds only these libraries: a wheel takes it as it is.

    Args:
        force: compile in any case.

    Returns:
        Paths of the libraries.

    Raises:
        BuildError: the message has the output of the compiler.
    """
    libraries = [BINARIES / name for name in LIBRARIES]
    stamp = BINARIES / STAMP
    _remove_others({*libraries, stamp})
    present = stamp.is_file() and all(library.is_file() for library in libraries)
    if not force and present and stamp.read_text() == digest():
        return libraries
    for target in sorted(set(LIBRARIES.values())):
        build_target(target)
    stamp.write_text(digest())
    return libraries


def _remove_others(kept: set[Path]) -> None:
    """Remove files of earlier versions, and of interrupted builds, from the libraries."""
    for path in sorted(
        BINARIES.rglob("*"), reverse=True
    ):  # the content of a folder before the folder
        if path.is_dir() and not path.is_symlink():
            if not any(path in file.parents for file in kept):
                path.rmdir()
        elif path not in kept:
            path.unlink()


def compile_objects(target: str) -> dict[Path, str]:
    """Compile the sources for a target, the kernels once for each instruction set.

    Returns:
        The objects, with the folder of each one's source.

    Raises:
        BuildError: the message has the output of the compiler.
    """
    folder = BUILD / target
    folder.mkdir(parents=True, exist_ok=True)
    architecture = target.split("-")[0]
    position = [] if "windows" in target or "wasi" in target else ["-fPIC"]
    choice = ["-DSLIDE_ONE_KERNEL"] if len(KERNELS[architecture]) == 1 else []
    common = ["-target", target, *WARNINGS, *CODE, *position, *choice, *include_flags()]
    units: dict[str, list[str]] = {}
    folders: dict[str, str] = {}
    for source in compiled_sources(target):
        compiled = ["-c", str(source.relative_to(RUNTIME))]
        if source.name in PER_KERNEL:
            for table, processor in KERNELS[architecture].items():
                slowest = not choice and table == "slide_kernel_baseline"
                level = PER_KERNEL[source.name][slowest]
                flags = [level, "-mcpu=" + processor, "-ffp-contract=on"]
                units[f"{source.stem}_{table}"] = [*flags, f"-DSLIDE_KERNEL={table}", *compiled]
                folders[f"{source.stem}_{table}"] = source.parent.name
        else:
            level = FAST if source.parent.name in HOT_FOLDERS else SMALL
            flags = [level, "-mcpu=" + BASELINE[architecture], "-ffp-contract=off"]
            units[source.stem] = [*flags, *compiled]
            folders[source.stem] = source.parent.name
    commands = {folder / f"{stem}.o": [*common, *unit] for stem, unit in units.items()}
    arguments = [[*command, "-o", str(object_)] for object_, command in commands.items()]
    with ThreadPoolExecutor(os.cpu_count()) as threads:  # each waits for a compiler
        list(threads.map(run_compiler, arguments))
    return {object_: folders[object_.stem] for object_ in commands}


def compiled_sources(target: str) -> list[Path]:
    """List the files that form the library of a target; files of ``wasm`` replace others."""
    folders = PAGE_FOLDERS if "wasi" in target else LIBRARY_FOLDERS
    replaced = {path.name for path in (RUNTIME / "wasm").glob("*.c")} if "wasi" in target else ()
    return [
        path
        for path in runtime_files(".c", folders)
        if path.name not in replaced or path.parent.name == "wasm"
    ]


def build_target(target: str) -> None:
    """Compile all libraries of a target.

    Raises:
        BuildError: the message has the output of the compiler.
    """
    objects = compile_objects(target)
    for name in (name for name, of in LIBRARIES.items() if of == target):
        whole = name in PYTHON_LIBRARIES
        linked = [o for o, folder in objects.items() if whole or folder not in PYTHON_FOLDERS]
        _link(name, target, linked)


def _link(name: str, target: str, objects: list[Path]) -> None:
    folder = BUILD / target
    library = folder / Path(name).name
    link = [*LINK, *LINK_OF[target.split("-")[1].split(".")[0]]]
    run_compiler(["-target", target, *map(str, objects), *link, "-o", str(library)])
    final = BINARIES / name
    final.parent.mkdir(parents=True, exist_ok=True)
    staged = folder / f"{final.name}.{os.getpid()}"
    staged.write_bytes(_without_time(library.read_bytes()))
    staged.replace(final)  # a process may have loaded the old library


def _without_time(library: bytes) -> bytes:
    """Zero the time of linking in a Windows library's header: same sources, same bytes."""
    if library[:2] != b"MZ":
        return library
    at = int.from_bytes(library[0x3C:0x40], "little") + 8
    return library[:at] + bytes(4) + library[at + 4 :]


def hashes() -> str:
    """Return the SHA-256 of the existing libraries, one line each."""
    lines = [
        f"{hashlib.sha256((BINARIES / name).read_bytes()).hexdigest()}  {name}\n"
        for name in LIBRARIES
    ]
    return "".join(lines)


def run_compiler(arguments: list[str]) -> None:
    """Run the compiler of ``ziglang`` in the folder of the sources.

    Raises:
        BuildError: the message has the output of the compiler.
    """
    cache = str(BUILD / "cache")
    environment = {**os.environ, "ZIG_LOCAL_CACHE_DIR": cache, "ZIG_GLOBAL_CACHE_DIR": cache}
    command = [sys.executable, "-m", "ziglang", "cc", *arguments]
    result = subprocess.run(
        command, cwd=RUNTIME, env=environment, capture_output=True, text=True, check=False
    )
    if result.returncode != 0:
        raise BuildError(
            f"compiling the FMU runtime failed: {' '.join(arguments)}\n{result.stderr}\n"
            "If the module ziglang is missing: pip install ziglang"
        )


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description="Compile the C runtime for all platforms, where its sources have changed."
    )
    parser.add_argument("--force", action="store_true", help="compile it in any case")
    parser.add_argument(
        "--record", action="store_true", help="write the hashes of the libraries down"
    )
    arguments = parser.parse_args()
    for built in build_all(force=arguments.force):
        print(built)
    if arguments.record:
        HASHES.write_text(hashes())


if __name__ == "__main__":
    main()
