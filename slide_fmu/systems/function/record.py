"""A reference system is made from one function of the user that simulates a whole record."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, final

import numpy as np

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.systems.base import System, read_only
from slide_fmu.systems.declared import Parameter, Parameters
from slide_fmu.systems.function.user_function import (
    called_with,
    numbers_of,
    require_arguments,
    require_signals,
)


@final
class RecordSystem(System):
    """A RecordSystem is a reference system made of one function: y = simulate(t, u, p).

    The function gets the times t of all samples in s, (N + 1,), the values u that the inputs have
    at these times, (N + 1, n_inputs), and the parameters as ``p.name``. It gives the outputs at
    these times, (N + 1, n_outputs). Between two samples a first-order hold moves linearly, as
    ``numpy.interp`` does; a zero-order hold has the value of the later one: u[k] has acted since
    t[k - 1], so that the output at t[k] follows from u[0] to u[k]. Before the start, u[0] has
    always acted: a function that knows the equilibrium under it starts there.
    """

    def __init__(
        self,
        simulate: Callable[..., Any],
        *,
        inputs: Sequence[Signal],
        outputs: Sequence[Signal],
        step: float,
        parameters: Mapping[str, Parameter] | None = None,
    ) -> None:
        """Take the function, which is not called yet.

        Args:
            simulate: function of (t, u, p).
            inputs, outputs: signals in channel order.
            step: sample step h in s.
            parameters: values that the function finds in p.

        Raises:
            LoadError: the function takes other arguments, or the signals do not belong together.
        """
        self.inputs, self.outputs, self.step = tuple(inputs), tuple(outputs), float(step)
        require_signals(self)
        require_arguments("simulate", simulate, ("t", "u", "p"), 3)
        self._simulate, self._p = simulate, Parameters(**(parameters or {}))

    def simulate(self, inputs: FloatArray) -> FloatArray:
        time = self.step * np.arange(len(inputs) + 1, dtype=np.float64)
        values = np.concatenate([inputs[:1], inputs])
        arguments = (read_only(time), read_only(values), self._p)
        result = called_with("simulate", self._simulate, arguments)
        outputs = numbers_of("simulate", result, "an array of numbers")
        one_column = outputs.ndim == 1 and len(self.outputs) == 1
        return outputs[:, None] if one_column else outputs
