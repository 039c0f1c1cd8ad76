"""AdamW takes the steps of torch's, and goes on from a state without a trace."""

from __future__ import annotations

import subprocess
import sys

import pytest
import torch

from slide_fmu.fitting.adam import AdamW

RATES = [0.1, 0.05, 0.2, 0.01] * 10
PROGRAM = """
import sys, torch
from slide_fmu.fitting.adam import AdamW
AdamW([torch.zeros(1, requires_grad=True)]).step(0.1)
print("torch._dynamo" in sys.modules)
"""


def valley() -> tuple[list[torch.Tensor], torch.Tensor]:
    """Give two parameters at their start, and the curvatures of a function of them."""
    start = torch.Generator().manual_seed(4)
    shapes = [(3, 2), (2,)]
    found = [torch.randn(shape, generator=start, dtype=torch.float64) for shape in shapes]
    return [one.requires_grad_() for one in found], torch.tensor([0.3, 5.0], dtype=torch.float64)


def gradients(parameters: list[torch.Tensor], curvatures: torch.Tensor) -> None:
    total = sum((curvatures * one**2).sum() + one.sin().sum() for one in parameters)
    assert isinstance(total, torch.Tensor)
    total.backward()


@pytest.mark.parametrize("decay", [0.0, 0.1])
def test_steps_are_those_of_torch(decay: float) -> None:
    (own, curvatures), (others, _) = valley(), valley()
    optimizer = AdamW(own, weight_decay=decay, epsilon=1e-7)
    expected = torch.optim.AdamW(others, weight_decay=decay, eps=1e-7)
    for rate in RATES:
        optimizer.forget_gradients()
        expected.zero_grad()
        gradients(own, curvatures)
        gradients(others, curvatures)
        expected.param_groups[0]["lr"] = rate
        optimizer.step(rate)
        expected.step()
    for one, other in zip(own, others, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-12, atol=1e-14)


def test_training_goes_on_from_a_state_without_a_trace() -> None:
    parameters, curvatures = valley()
    optimizer = AdamW(parameters)
    for rate in RATES[:7]:
        optimizer.forget_gradients()
        gradients(parameters, curvatures)
        optimizer.step(rate)
    copies = [one.detach().clone().requires_grad_() for one in parameters]
    other = AdamW(copies)
    other.load_state_dict(optimizer.state_dict())
    for both in ((optimizer, parameters), (other, copies)):
        both[0].forget_gradients()
        gradients(both[1], curvatures)
        both[0].step(0.1)
    assert all(torch.equal(one, copy) for one, copy in zip(parameters, copies, strict=True))


def test_parameter_without_a_gradient_stays() -> None:
    moved, still = (torch.ones(2, requires_grad=True) for _ in range(2))
    moved.sum().backward()
    AdamW([moved, still], weight_decay=0.1).step(0.1)
    assert torch.equal(still, torch.ones(2))
    assert not torch.equal(moved, torch.ones(2))


def test_compiler_of_torch_is_not_imported() -> None:
    found = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True)
    assert found.stdout.strip() == "False", found.stderr
