"""A surrogate in torch gives what the runtime gives; its gradients are central differences."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

import slide_fmu as slide
from slide_fmu.fmu.native import NativeError
from tests.fmu.samples import sum_surrogate
from tests.refusals import refused

ROOT = Path(__file__).parents[3]

DISTANCE = 5.0
"""In N, of the force's range of 1000 N: over it outputs, of single precision, differ enough."""

DIFFERENCES = 2e-3
"""Part of the largest slope that central differences over DISTANCE may miss."""


def duffing() -> slide.Surrogate:
    return slide.load(ROOT / "fmus" / "duffing" / "duffing.fmu")


def forces(count: int, samples: int) -> torch.Tensor:
    values = np.random.default_rng(4).uniform(-600, 600, (count, samples, 1))
    return torch.tensor(values, requires_grad=True)


def test_module_of_the_duffing_gives_the_outputs_of_the_runtime() -> None:
    surrogate, records = duffing(), forces(3, 50)
    module = slide.torch_module(surrogate)
    expected = slide.NativeSurrogate(surrogate).predict(records.detach().numpy())
    np.testing.assert_array_equal(module(records).detach().numpy(), expected)
    np.testing.assert_array_equal(module(records[1]).detach().numpy(), expected[1])
    single = module(records.detach().to(torch.float32))
    assert single.dtype == torch.float32
    np.testing.assert_allclose(single.numpy(), expected, atol=1e-5)


def test_gradients_of_the_module_are_central_differences() -> None:
    module, records = slide.torch_module(duffing()), forces(2, 12)
    (slopes,) = torch.autograd.grad(module(records).sum(), records)
    atol = DIFFERENCES * float(slopes.abs().max())
    assert torch.autograd.gradcheck(module, (records,), eps=DISTANCE, atol=atol, rtol=0)


def test_gradients_go_through_the_module_to_what_makes_the_record() -> None:
    surrogate = duffing()
    size = torch.tensor(300.0, dtype=torch.float64, requires_grad=True)
    shape = torch.sin(torch.arange(60, dtype=torch.float64) / 6)[:, None]
    outputs = slide.torch_module(surrogate, threads=1)(size * shape)
    torch.sum(outputs**2).backward()
    native, record = slide.NativeSurrogate(surrogate), 300.0 * shape.numpy()
    expected = np.sum(native.vjp(record, 2 * native.predict(record)) * shape.numpy())
    assert size.grad is not None
    assert float(size.grad) == pytest.approx(expected, rel=1e-12)


def test_second_derivatives_are_refused_and_not_zero() -> None:
    records = forces(1, 5)
    outputs = slide.torch_module(duffing())(records)
    (slopes,) = torch.autograd.grad((outputs**2).sum(), records, create_graph=True)
    with refused(RuntimeError, "once_differentiable"):
        slopes.sum().backward()


def test_records_of_other_channels_are_refused() -> None:
    with refused(ValueError, "expected (B", "shape (4"):
        slide.torch_module(duffing())(torch.zeros(4, 2))


@pytest.mark.parametrize(
    ("records", "kind"),
    [
        (torch.zeros(4, 1, dtype=torch.int64), "torch.int64"),
        (torch.zeros(4, 1, dtype=torch.complex64), "torch.complex64"),
        (np.zeros((4, 1)), "ndarray"),
    ],
)
def test_records_whose_type_has_no_fractions_or_that_are_no_tensor_are_refused(
    records: object, kind: str
) -> None:
    with pytest.raises(TypeError, match=f"sequences are of type {kind}; expected a tensor of"):
        slide.torch_module(duffing())(records)


def test_gradients_of_layers_are_refused_with_what_to_use() -> None:
    records = torch.zeros(20, 1, dtype=torch.float64, requires_grad=True)
    outputs = slide.torch_module(sum_surrogate())(records)
    with refused(NativeError, "type FeedForward"):
        outputs.sum().backward()
