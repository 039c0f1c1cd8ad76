"""Many whole sequences are predicted in parallel on a torch device, such as CUDA."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.state_space.equations import ByRole, Equations, outputs
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.checks import checked_inputs
from slide_fmu.surrogate.surrogate import Surrogate

NUMBERS_AT_ONCE = 1 << 28
"""Largest number of values, in single precision, for one block: about a gigabyte."""


@final
class DeviceSurrogate:
    """A DeviceSurrogate predicts sequences on a device; see ``device_surrogate``."""

    def __init__(self, surrogate: Surrogate, device: str) -> None:
        network = surrogate.network
        if not isinstance(network, StateSpace):
            raise TypeError(
                f"surrogate {surrogate.name!r} has a network of the family "
                f"{type(network).__name__}; expected StateSpace: use NativeSurrogate"
            )
        try:
            self.device = torch.device(device)
            torch.zeros(1, device=self.device)
        except (RuntimeError, AssertionError) as error:
            raise ValueError(
                f"device {device!r} cannot be used ({error}); expected one that torch finds here, "
                "such as cuda, or cpu"
            ) from error
        self.surrogate, self._network = surrogate, network
        arrays = {name: self._there(part) for name, part in network.cell.arrays().items()}
        self._cell = network.cell.with_arrays(arrays)

    def predict(self, sequences: NDArray[Any]) -> FloatArray:
        """Predict sequences (B, N, n_inputs) in their units: outputs at samples 1 .. N.

        Raises:
            ValueError: wrong shape, or values that are not finite.
        """
        checked = checked_inputs(sequences, self.surrogate.inputs, "sequences, ")
        parts = [self.evaluate(block) for block in self.blocks(checked)]
        values = np.concatenate([part.cpu().numpy() for part in parts], axis=1)
        scaled = np.moveaxis(values, 0, 1).astype(np.float64)
        return np.asarray(self.surrogate.output_scaling.invert(scaled))

    def blocks(self, sequences: FloatArray) -> Iterator[torch.Tensor]:
        """Yield the features of sequences in blocks, on the device: (n_in - 1 + N, B, n_signals).

        They are formed by numpy. The first input is held for n_in samples before.
        """
        before = self.surrogate.window.n_in - 1
        cell = self._network.cell
        each = (sequences.shape[1] + before) * (
            self._network.features.n_signals + 2 * len(cell.w) + 3 * len(cell.a)
        )
        count = max(1, NUMBERS_AT_ONCE // each)
        for first in range(0, len(sequences), count):
            scaled = self.surrogate.input_scaling.apply(sequences[first : first + count])
            held = np.pad(scaled, ((0, 0), (before, 0), (0, 0)), mode="edge")
            yield self._there(np.moveaxis(self._network.features.along(held), 1, 0))

    def evaluate(self, features: torch.Tensor) -> torch.Tensor:
        """Run the cell along the features of a block; the scaled outputs are (N, B, n_outputs)."""
        with torch.no_grad():
            inputs = ByRole.of(self._network.roles, features)
            start = torch.zeros(features.shape[1], len(self._cell.a), device=self.device)
            states = Equations(self._cell, inputs, self._network.turned, torch).run(start)
            last = slice(self.surrogate.window.n_in - 1, None)
            of_last: torch.Tensor = outputs(self._cell, states[last], inputs.part(last))
            return of_last

    def _there(self, array: NDArray[Any]) -> torch.Tensor:
        return torch.from_numpy(np.ascontiguousarray(array, dtype=np.float32)).to(self.device)
