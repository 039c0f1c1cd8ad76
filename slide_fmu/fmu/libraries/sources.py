"""The ``sources`` folder of an FMU (FMI 2.0.4, section 2.3) has the runtime with the weights.

Each file of the runtime begins with one more line, ``#include "own_names.h"``. A file of
``runtime/source`` replaces another: it has the surrogate file as an array of bytes. There is one
kernel, for the processor of the compiler (``SLIDE_ONE_KERNEL``). Scalar sources, for controllers,
use no extension of C99 (``SLIDE_SCALAR``) and no heap memory: the file in ``runtime/scalar``
replaces another one. The headers of the FMI project are in the same folder, with their own licence
in them.
"""

from __future__ import annotations

import re
from typing import Literal

from slide_fmu.fmu.description.build_description import build_description
from slide_fmu.fmu.description.twincat import twincat_description
from slide_fmu.fmu.libraries.build import (
    RUNTIME,
    SOURCE_FOLDERS,
    BuildError,
    runtime_files,
    standard_headers,
)
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.fmu.native_library import memory_sizes

Sources = bool | Literal["scalar"]
"""Whether an FMU has C sources: none, sources with vector types, or scalar ones."""

STEPS_PER_SAMPLE = (32, 16, 8, 4, 2)
"""Allowed values of the macro ``SLIDE_STEPS_PER_SAMPLE``; the libraries use the first."""

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
"""Rule for function names in ``fmi2Functions.h`` of fmpy, and in the standard. The header of FMI
3.0 in fmpy follows the standard."""

_INTERNAL = re.compile(r"\b(slide_\w+)(?=[(;,])")


def source_members(
    name: str, payload: bytes, fmi: FmiVersion = 2, scalar: bool = False
) -> dict[str, bytes]:
    """Return the contents of the files of the folder, by their names in the FMU.

    Args:
        name: the model identifier; the program's internal functions start with it, so that several
            source FMUs can be linked into one program.
        payload: the surrogate file.
        fmi: version of the standard.
        scalar: whether to write scalar C99, without dynamic memory.

    Raises:
        BuildError: the headers of the standard are missing or unknown.
        NativeError: the memory of scalar sources cannot be measured without a compiled library.
    """
    replaced = [RUNTIME / "source", *([RUNTIME / "scalar"] if scalar else [])]
    files = [*runtime_files(folders=SOURCE_FOLDERS[fmi])]
    files += [path for folder in replaced for path in sorted(folder.glob("*.c"))]
    texts = {path.name: path.read_text("utf-8") for path in files}
    headers = "\n".join(texts[file] for file in texts if file.endswith(".h"))
    for file in texts:
        if file.endswith(".c"):
            texts[file] = f'#include "{NAMES}"\n\n{texts[file]}'
    texts |= {header.name: header.read_text("utf-8") for header in standard_headers(fmi)}
    if fmi == 2:
        texts[_FUNCTIONS] = _with_prefix(texts[_FUNCTIONS])
    reference = "unsigned int" if fmi == 2 else "uint32_t"
    macros = f"#define SLIDE_ONE_KERNEL\n#define SLIDE_REFERENCE {reference}\n"
    macros += _scalar_macros(payload, fmi) if scalar else ""
    texts |= {NAMES: macros + _own_names(name, headers, fmi), "surrogate.h": _as_array(payload)}
    members = {f"{FOLDER}/{file}": text.encode("utf-8") for file, text in texts.items()}
    if fmi == 3:
        description = build_description(name, compiled_files(3), scalar)
        members[f"{FOLDER}/buildDescription.xml"] = description
    if scalar:
        members[f"{FOLDER}/CustomFMU.xml"] = twincat_description()
    return members


def compiled_files(fmi: FmiVersion = 2) -> list[str]:
    """Return the names of the files to compile, for the descriptions of FMUs."""
    return [path.name for path in runtime_files(".c", SOURCE_FOLDERS[fmi])]


def _with_prefix(functions: str) -> str:
    """Make ``fmi2Functions.h`` of fmpy prefix names with ``FMI2_FUNCTION_PREFIX``."""
    if _NO_PREFIX not in functions:
        raise BuildError(f"{_FUNCTIONS} of fmpy has no {_NO_PREFIX!r}: pip install fmpy==0.3.32")
    return functions.replace(_NO_PREFIX, _PREFIX)


def _scalar_macros(payload: bytes, fmi: FmiVersion) -> str:
    """Return the sizes of the static arrays of ``runtime/scalar/memory.c``, as macros."""
    usual = STEPS_PER_SAMPLE[0]
    lines = [
        "#define SLIDE_SCALAR",
        "/* Communication steps that are distinguished in a sample step; and bytes of an instance",
        " * and of a saved state on any processor: those with 32-bit pointers need less. */",
        "#if !defined(SLIDE_STEPS_PER_SAMPLE)",
        f"#define SLIDE_STEPS_PER_SAMPLE {usual}",
        "#endif",
    ]
    for steps in STEPS_PER_SAMPLE:
        instance, saved_state = memory_sizes(payload, fmi, steps)
        lines += [
            f"#{'if' if steps == usual else 'elif'} SLIDE_STEPS_PER_SAMPLE == {steps}",
            f"#define SLIDE_INSTANCE_BYTES {instance}",
            f"#define SLIDE_SAVED_STATE_BYTES {saved_state}",
        ]
    known = ", ".join(map(str, STEPS_PER_SAMPLE))
    lines += ["#else", f'#error "SLIDE_STEPS_PER_SAMPLE: expected one of {known}"', "#endif"]
    return "\n".join(lines) + "\n"


def _own_names(name: str, headers: str, fmi: FmiVersion) -> str:
    """Return the header that gives all internal functions their own names."""
    internal = sorted(set(_INTERNAL.findall(headers)))
    lines = [
        f"/* Names of {name}'s own. FMI functions have those of the standard, as in a shared",
        f" * library; compile with -DFMI{fmi}_FUNCTION_PREFIX={name}_ to link several FMUs into",
        " * one program. */",
        "#define SLIDE_KERNEL slide_kernel_baseline",
        *(f"#define {function} {name}_{function}" for function in internal),
    ]
    return "\n".join(lines) + "\n"


def _as_array(payload: bytes) -> str:
    """Return the surrogate file as a C array."""

    starts = range(0, len(payload), BYTES_IN_A_LINE)
    rows = (",".join(map(str, payload[first : first + BYTES_IN_A_LINE])) for first in starts)
    values = ",\n".join(rows)
    return f"static const unsigned char surrogate[{len(payload)}] = {{\n{values}}};\n"
