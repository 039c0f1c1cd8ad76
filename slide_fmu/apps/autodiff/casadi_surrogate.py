"""A surrogate is a CasADi function from a sequence to its outputs, with reverse derivatives.

CasADi keeps no reference to Python objects: the caller must keep a function as long as expressions
use it.
"""

from __future__ import annotations

from typing import final

import casadi
import numpy as np

from slide_fmu.core.shown import shown
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.native import NativeError, NativeSurrogate
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate


@final
class CasadiSurrogate(casadi.Callback):  # type: ignore[misc]
    """A CasadiSurrogate is a CasADi function; see ``casadi_function``."""

    def __init__(
        self, surrogate: Surrogate, samples: int, options: dict[str, object] | None = None
    ) -> None:
        if not isinstance(samples, int | np.integer) or samples < 1:
            raise ValueError(
                f"samples: {shown(samples)}; expected a whole number of at least 1, its length"
            )
        if not isinstance(surrogate.network, StateSpace):
            raise NativeError(
                f"no gradients of networks of type {type(surrogate.network).__name__} in the "
                "runtime; expected one of the family 'state_space'"
            )
        super().__init__()
        self._native, self._samples = NativeSurrogate(surrogate), int(samples)
        self._reverses: list[_Reverse] = []
        self.construct(surrogate.name, options or {})

    def get_n_in(self) -> int:
        return 1

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, _index: int) -> str:
        return "record"

    def get_name_out(self, _index: int) -> str:
        return "outputs"

    def get_sparsity_in(self, _index: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self._samples, len(self._native.surrogate.inputs))

    def get_sparsity_out(self, _index: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self._samples, len(self._native.surrogate.outputs))

    def eval(self, arguments: list[casadi.DM]) -> list[FloatArray]:
        return [self._native.predict(arguments[0].full())]

    def has_reverse(self, _count: int) -> bool:
        return True

    def get_reverse(
        self,
        count: int,
        name: str,
        names_in: list[str],
        names_out: list[str],
        options: dict[str, object],
    ) -> casadi.Function:
        reverse = _Reverse(self._native, self._samples, count, (names_in, names_out))
        reverse.construct(name, options)
        self._reverses.append(reverse)
        return reverse


class _Reverse(casadi.Callback):  # type: ignore[misc]
    """Maps a sequence, its outputs and several weights of them to the same number of gradients."""

    def __init__(
        self,
        native: NativeSurrogate,
        samples: int,
        count: int,
        names: tuple[list[str], list[str]],
    ) -> None:
        super().__init__()
        self._native, self._samples, self._count, self._names = native, samples, count, names
        surrogate = native.surrogate
        n_inputs, n_outputs = len(surrogate.inputs), len(surrogate.outputs)
        self._columns_in = (n_inputs, n_outputs, count * n_outputs)
        self._columns_out = count * n_inputs

    def get_n_in(self) -> int:
        return len(self._columns_in)

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, index: int) -> str:
        return self._names[0][index]

    def get_name_out(self, index: int) -> str:
        return self._names[1][index]

    def get_sparsity_in(self, index: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self._samples, self._columns_in[index])

    def get_sparsity_out(self, _index: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self._samples, self._columns_out)

    def eval(self, arguments: list[casadi.DM]) -> list[FloatArray]:
        sequence, weights = arguments[0].full(), arguments[2].full()
        apart = weights.reshape(self._samples, self._count, -1).transpose(1, 0, 2)
        sequences = np.broadcast_to(sequence, (self._count, *sequence.shape))
        slopes = self._native.vjp(sequences, apart)
        return [slopes.transpose(1, 0, 2).reshape(self._samples, self._columns_out)]
