"""A surrogate as a torch module: records in, outputs out, and their gradient by the C runtime."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.native import NativeSurrogate
from slide_fmu.surrogate.surrogate import Surrogate


class TorchSurrogate(torch.nn.Module):
    """A TorchSurrogate is a module of torch (``torch_module`` says what it does). Final."""

    def __init__(self, surrogate: Surrogate, threads: int | None = None) -> None:
        super().__init__()
        self._native, self._threads = NativeSurrogate(surrogate), threads

    def forward(self, records: torch.Tensor) -> torch.Tensor:
        """Predict records of shape (B, N, n_inputs), or (N, n_inputs) of one, in their units.

        Raises:
            TypeError: they are no tensor of real numbers with a fraction.
            ValueError: wrong shape, values that are not finite, or no threads.
            NativeError: a feature is not finite.
        """
        kind = records.dtype if isinstance(records, torch.Tensor) else type(records).__name__
        if not (isinstance(kind, torch.dtype) and kind.is_floating_point):
            raise TypeError(  # outputs are of the same type, and would lose their fractions
                f"records are of type {kind}; expected a tensor of torch.float64 or "
                "torch.float32: make one with torch.as_tensor(records, dtype=torch.float64)"
            )
        arguments = records, self._native, self._threads
        predicted: torch.Tensor = _Predicted.apply(*arguments)  # type: ignore[no-untyped-call]
        return predicted


class _Predicted(torch.autograd.Function):
    """The prediction of records with its vector-Jacobian product."""

    @staticmethod
    def forward(
        ctx: Any, records: torch.Tensor, native: NativeSurrogate, threads: int | None
    ) -> torch.Tensor:
        ctx.save_for_backward(records)
        ctx.native, ctx.threads = native, threads
        return records.new_tensor(native.predict(_array(records), threads))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, weights: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        (records,) = ctx.saved_tensors
        slopes = ctx.native.vjp(_array(records), _array(weights), ctx.threads)
        return records.new_tensor(slopes), None, None


def _array(values: torch.Tensor) -> FloatArray:
    return np.asarray(values.detach().to("cpu", torch.float64).numpy())
