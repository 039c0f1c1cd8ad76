"""A surrogate is a torch module: sequences in, outputs out, with gradients by the C runtime."""

from __future__ import annotations

from typing import Any, final

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.native import NativeSurrogate
from slide_fmu.surrogate.surrogate import Surrogate


@final
class TorchSurrogate(torch.nn.Module):
    """A TorchSurrogate is a torch module; see ``torch_module``."""

    def __init__(self, surrogate: Surrogate, threads: int | None = None) -> None:
        super().__init__()
        self._native, self._threads = NativeSurrogate(surrogate), threads

    def forward(self, sequences: torch.Tensor) -> torch.Tensor:
        """Predict sequences of shape (B, N, n_inputs), or (N, n_inputs) of one, in their units.

        Raises:
            TypeError: the argument is not a tensor of a floating-point type.
            ValueError: wrong shape, values that are not finite, or no threads.
            NativeError: a feature is not finite.
        """
        kind = sequences.dtype if isinstance(sequences, torch.Tensor) else type(sequences).__name__
        if not (isinstance(kind, torch.dtype) and kind.is_floating_point):
            raise TypeError(  # outputs have the same type, and integers would lose their fractions
                f"sequences are of type {kind}; expected a tensor of torch.float64 or "
                "torch.float32: make one with torch.as_tensor(sequences, dtype=torch.float64)"
            )
        arguments = sequences, self._native, self._threads
        predicted: torch.Tensor = _Predicted.apply(*arguments)  # type: ignore[no-untyped-call]
        return predicted


class _Predicted(torch.autograd.Function):
    """The prediction of sequences with its vector-Jacobian product."""

    @staticmethod
    def forward(
        ctx: Any, sequences: torch.Tensor, native: NativeSurrogate, threads: int | None
    ) -> torch.Tensor:
        ctx.save_for_backward(sequences)
        ctx.native, ctx.threads = native, threads
        return sequences.new_tensor(native.predict(_array(sequences), threads))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, weights: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        (sequences,) = ctx.saved_tensors
        slopes = ctx.native.vjp(_array(sequences), _array(weights), ctx.threads)
        return sequences.new_tensor(slopes), None, None


def _array(values: torch.Tensor) -> FloatArray:
    return np.asarray(values.detach().to("cpu", torch.float64).numpy())
