"""Communication steps of an instance of an FMU of FMI 2.0 that C repeats, for benchmarks."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray

SOURCE = Path(__file__).parent / "c" / "steps.c"
CALLS = ("fmi2SetReal", "fmi2DoStep", "fmi2GetReal", "fmi2GetBoolean")


class _Functions(ctypes.Structure):
    """The functions of an FMU that ``c/steps.c`` calls."""

    _fields_ = [(name, ctypes.c_void_p) for name in CALLS]


class _Steps(ctypes.Structure):
    """The steps of ``c/steps.c``."""

    _fields_ = [
        *[(name, ctypes.c_void_p) for name in ("inputs_at", "outputs_at", "booleans_at")],
        *[(f"n_{name}", ctypes.c_size_t) for name in ("inputs", "outputs", "booleans", "steps")],
        *[(name, ctypes.c_void_p) for name in ("times", "lengths", "inputs", "outputs")],
        *[(name, ctypes.c_void_p) for name in ("booleans", "seconds")],
    ]


class CSteps:
    """CSteps repeat communication steps of one instance inside C.

    Args:
        steps: the library of ``c/steps.c`` (``load_steps``).
        library: that of the FMU, which has made the instance.
        instance: its address.
        inputs: value references of the real inputs.
        outputs: value references of the real variables that are read after each step.
        booleans: value references of the Boolean variables that are read after each step.
    """

    def __init__(
        self,
        steps: ctypes.CDLL,
        library: ctypes.CDLL,
        instance: Any,
        inputs: Sequence[int],
        outputs: Sequence[int],
        booleans: Sequence[int] = (),
    ) -> None:
        self._steps, self._instance = steps, instance
        addresses = [ctypes.cast(getattr(library, name), ctypes.c_void_p) for name in CALLS]
        self._functions = _Functions(*addresses)
        kinds = (inputs, outputs, booleans)
        self._at = [np.asarray(references, dtype=np.uint32) for references in kinds]

    def run(
        self, times: FloatArray, lengths: FloatArray, inputs: FloatArray
    ) -> tuple[FloatArray, float]:
        """Do some steps.

        Args:
            times: begin of each step in s, shape (N,).
            lengths: length of each step in s, shape (N,).
            inputs: what is set before each step, shape (N, n_inputs).

        Returns:
            The outputs after each step, shape (N, n_outputs), and the processor time in s of all
            steps, which other programs do not lengthen.

        Raises:
            RuntimeError: a call failed.
        """
        given = [np.ascontiguousarray(each, dtype=np.float64) for each in (times, lengths, inputs)]
        outputs = np.empty((len(times), len(self._at[1])))
        booleans, seconds = np.empty(len(self._at[2]), dtype=np.intc), np.empty(1)
        of = _Steps(
            *(references.ctypes.data for references in self._at),
            *(len(references) for references in self._at),
            len(times),
            *(values.ctypes.data for values in (*given, outputs, booleans, seconds)),
        )
        call = ctypes.byref(self._functions), self._instance, ctypes.byref(of)
        status = self._steps.steps_run(*call)
        if status != 0:
            raise RuntimeError(f"a step failed with status {status}")
        return outputs, float(seconds[0])


def load_steps(folder: Path) -> ctypes.CDLL:
    """Compile ``c/steps.c`` with the compiler of this computer and load it.

    Args:
        folder: where its library goes.

    Raises:
        subprocess.CalledProcessError: the compiler refused it.
    """
    library = folder / "steps.so"
    command = ["cc", "-std=c99", "-O2", "-shared", "-fPIC", str(SOURCE), "-o", str(library)]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(library))
