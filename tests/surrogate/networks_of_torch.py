"""Networks of torch with random weights, their signals, and records of inputs for them."""

from __future__ import annotations

import numpy as np
import torch
from torch import nn

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.window import Window

WINDOW = Window(0.01, 12, 3)
INPUTS = (Signal("force", "N", -1.0, 1.0), Signal("angle", "rad", -2.0, 3.0))
OUTPUTS = (Signal("x", "m", -1.0, 1.0), Signal("v", "m/s", -2.0, 3.0))
TAKES, GIVES = WINDOW.n_in * len(INPUTS), WINDOW.n_out * len(OUTPUTS)

SINGLE = 1e-6
"""Relative to the largest output. The runtime computes in single precision, whose unit roundoff is
6e-8; sums over a few dozen weights and a few layers add up to ten times that."""


def dense(activation: nn.Module, bias: bool = True) -> nn.Sequential:
    """Two hidden layers with one activation, on windows as they are."""
    torch.manual_seed(3)
    layers = (nn.Linear(TAKES, 16, bias), activation, nn.Linear(16, 8, bias), activation)
    return nn.Sequential(nn.Flatten(), *layers, nn.Linear(8, GIVES, bias))


def normed(width: int) -> nn.BatchNorm1d:
    """A BatchNorm1d that has seen something."""
    norm = nn.BatchNorm1d(width)
    assert norm.running_mean is not None
    assert norm.running_var is not None
    for tensor in (norm.running_mean, norm.weight.data, norm.bias.data):
        nn.init.uniform_(tensor, -1.0, 1.0)
    nn.init.uniform_(norm.running_var, 0.5, 2.0)
    return norm


def record(samples: int = 50) -> FloatArray:
    """Inputs within their ranges, shape (samples, n_inputs)."""
    low, high = (np.array([getattr(signal, end) for signal in INPUTS]) for end in ("low", "high"))
    part = np.random.default_rng(5).uniform(size=(samples, len(INPUTS)))
    return np.asarray(low + part * (high - low))


def windows_of(inputs: FloatArray) -> FloatArray:
    """The input windows that end at each sample; the first input was held before."""
    held = np.concatenate([np.repeat(inputs[:1], WINDOW.n_in - 1, axis=0), inputs])
    return np.stack([held[end : end + WINDOW.n_in] for end in range(len(inputs))])


def values(module: nn.Module, windows: FloatArray) -> FloatArray:
    """What the module itself gives in double precision: (B, n_in, n_inputs) to (B, n_values)."""
    with torch.no_grad():
        found = module.double().eval()(torch.from_numpy(windows))
    return np.asarray(found.reshape(len(windows), -1).numpy())
