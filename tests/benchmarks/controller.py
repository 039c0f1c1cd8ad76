"""A source FMU on a Cortex-M7: instructions and stack of its steps, and memory.

    python tests/benchmarks/controller.py fmus/duffing/duffing.fmu --json -

The FMU is written again with scalar sources, compiled by ``arm-none-eabi-gcc`` with a small
program (``c/controller.c``), and run without operating system on the machine ``mps2-an500`` of
``qemu-system-arm``, over the trajectory that the FMU carries. QEMU counts instructions
(``-icount shift=0``: 1 ns each), read by the timer SysTick in steps of 40; it knows neither caches
nor waiting times of memory, so these are no cycles. Stack is what calls wrote over of a pattern.
``step`` sets the inputs, does a step of the sample length and reads the outputs, its smallest and
largest number over all steps but the first, which takes in what was before the start;
``read_of_errors`` reads error estimates and error bounds besides. A program in which the heap is
asked for memory, a second instance is not refused, or an output differs from the library's by more
than 2e-6 of its range fails.
"""

from __future__ import annotations

import argparse
import struct
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write
from source_case import SourceCase, open_case

from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.check import OUTPUT_TOLERANCE

C = Path(__file__).parent / "c"
COMPILER = "arm-none-eabi-gcc"
PROCESSOR = ("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard")
STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror")
MACROS = ("-DSLIDE_STEPS_PER_SAMPLE=2", "-DSLIDE_SAVED_STATES=0", "-DSLIDE_QUIET")
"""What a controller that steps by the sample step needs, and no more."""

MACHINE = ("-M", "mps2-an500", "-icount", "shift=0", "-nographic", "-monitor", "none")
HOST = ("-serial", "none", "-semihosting-config", "enable=on,target=native")
LIMIT = 600
"""Seconds after which QEMU is stopped."""


def build(case: SourceCase, folder: Path, steps: int, optimize: str) -> Path:
    """Compile the sources strictly, and link them with the program.

    Raises:
        subprocess.CalledProcessError: the compiler refused them.
    """
    (folder / "controller_case.h").write_text(case_header(case, steps))
    common = [COMPILER, *PROCESSOR, optimize, "-ffunction-sections", "-fdata-sections", *MACROS]
    sources = [str(path) for path in sorted(case.sources.glob("*.c"))]
    subprocess.run([*common, *STRICT, "-c", *sources], check=True, cwd=folder)
    program = folder / "controller.elf"
    own = ["-std=gnu99", f"-I{case.sources}", f"-I{folder}", str(C / "controller.c")]
    objects = [str(path) for path in sorted(folder.glob("*.o"))]
    link = ["-T", str(C / "controller.ld"), "-nostartfiles", "--specs=nosys.specs"]
    last = ["-Wl,--gc-sections", "-lm", "-o", str(program)]
    subprocess.run([*common, *own, *objects, *link, *last], check=True)
    return program


def case_header(case: SourceCase, steps: int) -> str:
    """What the program includes: identity, variables and inputs."""
    inputs = case.inputs[:steps]
    values = ",\n".join("{" + ",".join(v.hex() for v in row.tolist()) + "}" for row in inputs)
    macros = {
        "GUID": f'"{case.description.guid}"',
        "STEPS": str(len(inputs)),
        "STEP": case.surrogate.window.step.hex(),
        "N_INPUTS": str(inputs.shape[1]),
        "INPUTS": _listed(case.input_references),
        "OUTPUTS": _listed(case.output_references),
        "COSTLY": _listed(case.costly_references),
        "INPUT_VALUES": "{" + values.replace("\n", " ") + "}",
    }
    return "".join(f"#define CASE_{name} {value}\n" for name, value in macros.items())


def _listed(references: np.ndarray) -> str:
    return "{" + ",".join(map(str, references)) + "}"


def run(program: Path) -> tuple[dict[str, int], FloatArray]:
    """Run the program; its figures by name, and its outputs in order.

    Raises:
        RuntimeError: it failed.
        subprocess.TimeoutExpired: it does not end.
    """
    command = ["qemu-system-arm", *MACHINE, *HOST, "-kernel", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, check=False)
    lines = (done.stdout + done.stderr).splitlines()
    outputs = [line.split()[1] for line in lines if line.startswith("output ")]
    values = [struct.unpack(">d", bytes.fromhex(text))[0] for text in outputs]
    words = [line.split() for line in lines if not line.startswith("output ")]
    figures = {w[0]: int(w[1]) for w in words if len(w) == 2 and w[1].isdigit()}
    if figures.get("heap") != 0:
        raise RuntimeError("\n".join(line for line in lines if not line.startswith("output ")))
    return figures, np.array(values)


def sizes(program: Path) -> dict[str, int]:
    """Bytes of code and constants, and of variables: all static, with the program's stack."""
    text = subprocess.run(
        ["arm-none-eabi-size", str(program)], capture_output=True, text=True, check=True
    ).stdout.splitlines()[1]
    code, data, zeros = map(int, text.split()[:3])
    return {"read_only_bytes": code, "writable_bytes_with_64_KiB_of_stack": data + zeros}


def measure_fmu(fmu: Path, steps: int, optimize: str) -> dict[str, Any]:
    """Figures of one FMU.

    Raises:
        RuntimeError: an output differs from the library's.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        case = open_case(fmu, folder, "scalar")
        program = build(case, folder, steps, optimize)
        figures, outputs = run(program)
        found = outputs.reshape(-1, case.outputs.shape[1])
        differences = np.abs(found - case.outputs[: len(found)]) / case.ranges
        deviation = float(differences.max())
        if not deviation <= OUTPUT_TOLERANCE:
            raise RuntimeError(f"{fmu}: outputs differ by {deviation:.3g} of their range")
        del figures["heap"]
        return {"steps": len(found), "deviation": deviation, **figures, **sizes(program)}


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Figures of all FMUs."""
    figures, show = {}, bar("FMUs")
    for number, fmu in enumerate(arguments.fmus):
        figures[fmu.stem] = measure_fmu(fmu, arguments.steps, arguments.optimize)
        show(number + 1, len(arguments.fmus))
    return {"optimize": arguments.optimize, "macros": MACROS, "fmus": figures}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmus", type=Path, nargs="+")
    parser.add_argument("--steps", type=int, default=1000, help="of the trajectory, at most")
    parser.add_argument("--optimize", default="-O2")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
