"""The ``sources`` folder of an FMU (FMI 2.0.4, section 2.3): the runtime with the weights in it.

The runtime's own files, each with one line before it, ``#include "own_names.h"``. One is replaced
by that in ``runtime/source``: the surrogate file is an array of bytes in the program. There is one
kernel, for the processor that it is compiled for (``SLIDE_ONE_KERNEL``). The headers of the FMI
project lie beside them, under its own licence, which stands in them.
"""

from __future__ import annotations

import re

from slide_fmu.fmu.libraries.build import (
    RUNTIME,
    SOURCE_FOLDERS,
    BuildError,
    runtime_files,
    standard_headers,
)

FOLDER = "sources"
NAMES = "own_names.h"
BYTES_IN_A_LINE = 24

_FUNCTIONS = "fmi2Functions.h"
_NO_PREFIX = "#define fmi2FullName(name) name\n"
_PREFIX = f"""#if defined(FMI2_FUNCTION_PREFIX)
#define fmi2Paste(a, b) a##b
#define fmi2PasteB(a, b) fmi2Paste(a, b)
#define fmi2FullName(name) fmi2PasteB(FMI2_FUNCTION_PREFIX, name)
#else
{_NO_PREFIX}#endif
"""
"""How ``fmi2Functions.h`` forms the names of functions in fmpy, and in the standard."""

_INTERNAL = re.compile(r"\b(slide_\w+)(?=[(;,])")


def source_members(name: str, payload: bytes) -> dict[str, bytes]:
    """Write the files of the folder, by their names in the FMU.

    Args:
        name: the model identifier; begins the names of the program's internal functions, so that
            several source FMUs may be linked into one program.
        payload: the surrogate file.

    Raises:
        BuildError: the headers of FMI 2.0 are missing, or others than are known.
    """
    files = runtime_files(folders=SOURCE_FOLDERS)
    texts = {path.name: path.read_text("utf-8") for path in files}
    texts |= {path.name: path.read_text("utf-8") for path in (RUNTIME / "source").glob("*.c")}
    names = _own_names(name, "\n".join(texts[file] for file in texts if file.endswith(".h")))
    for file in texts:
        if file.endswith(".c"):
            texts[file] = f'#include "{NAMES}"\n\n{texts[file]}'
    texts |= {header.name: header.read_text("utf-8") for header in standard_headers(2)}
    if _NO_PREFIX not in texts[_FUNCTIONS]:
        raise BuildError(f"{_FUNCTIONS} of fmpy has no {_NO_PREFIX!r}: pip install fmpy==0.3.32")
    texts[_FUNCTIONS] = texts[_FUNCTIONS].replace(_NO_PREFIX, _PREFIX)
    texts |= {NAMES: names, "surrogate.h": _as_array(payload)}
    return {f"{FOLDER}/{file}": text.encode("utf-8") for file, text in texts.items()}


def compiled_files() -> list[str]:
    """Name the files to compile, for the element ``SourceFiles``."""
    return [path.name for path in runtime_files(".c", SOURCE_FOLDERS)]


def _own_names(name: str, headers: str) -> str:
    """The header that gives all internal functions names of their own."""
    internal = sorted(set(_INTERNAL.findall(headers)))
    lines = [
        f"/* Names of {name}'s own. FMI functions have those of the standard, as in a shared",
        f" * library; compile with -DFMI2_FUNCTION_PREFIX={name}_ to link several FMUs into one",
        " * program. */",
        "#define SLIDE_ONE_KERNEL",
        "#define SLIDE_KERNEL slide_kernel_baseline",
        *(f"#define {function} {name}_{function}" for function in internal),
    ]
    return "\n".join(lines) + "\n"


def _as_array(payload: bytes) -> str:
    """The surrogate file as C array."""

    starts = range(0, len(payload), BYTES_IN_A_LINE)
    rows = (",".join(map(str, payload[first : first + BYTES_IN_A_LINE])) for first in starts)
    values = ",\n".join(rows)
    return f"static const unsigned char surrogate[{len(payload)}] = {{\n{values}}};\n"
