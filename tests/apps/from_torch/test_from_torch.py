"""A surrogate that was made of a module of torch gives what the module gives."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import nn

import slide_fmu as slide
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.importer.file import unpacked
from tests.libraries import build_libraries
from tests.refusals import refused
from tests.surrogate.networks_of_torch import (
    GIVES,
    INPUTS,
    OUTPUTS,
    SINGLE,
    TAKES,
    WINDOW,
    dense,
    normed,
    record,
    values,
    windows_of,
)


def made_of(module: object) -> slide.Surrogate:
    return slide.from_torch(module, inputs=INPUTS, outputs=OUTPUTS, window=WINDOW)  # type: ignore[arg-type]


def newest(module: nn.Module, inputs: FloatArray) -> FloatArray:
    """The newest outputs of the module itself, window by window, shape (N, n_outputs)."""
    return values(module, windows_of(inputs))[:, -len(OUTPUTS) :]


def assert_same(found: FloatArray, expected: FloatArray) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=SINGLE * np.abs(expected).max())


class Wrapped(nn.Module):
    """A module of one child, as many write them."""

    def __init__(self, factor: float = 1.0) -> None:
        super().__init__()
        self.layers, self.factor = dense(nn.Tanh()), factor

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        values: torch.Tensor = self.factor * self.layers(window)
        return values


def norms() -> nn.Sequential:
    """Norms before, behind and between linear layers and activations."""
    torch.manual_seed(4)
    middle = nn.Sequential(normed(9), nn.Tanh(), normed(9), nn.Dropout(0.5), nn.Linear(9, 9))
    return nn.Sequential(
        nn.Flatten(), normed(TAKES), nn.Linear(TAKES, 9), middle, nn.ReLU(), normed(9),
        nn.ReLU(), nn.Identity(), nn.Linear(9, 4), nn.Linear(4, GIVES), normed(GIVES),
    )  # fmt: skip


def bare() -> nn.Sequential:
    """Activations without a linear layer before them."""
    return nn.Sequential(nn.Flatten(), nn.Tanh(), nn.ReLU(), nn.Linear(TAKES, GIVES), nn.Sigmoid())


MODULES: dict[str, Callable[[], nn.Module]] = {
    "relu": lambda: dense(nn.ReLU()),
    "elu": lambda: dense(nn.ELU()),
    "tanh": lambda: dense(nn.Tanh(), bias=False),
    "sigmoid": lambda: dense(nn.Sigmoid()),
    "gelu": lambda: dense(nn.GELU(approximate="tanh")),
    "norms": norms,
    "bare": bare,
    "wrapped": Wrapped,
    "one layer": lambda: nn.Sequential(nn.Flatten(), nn.Linear(TAKES, GIVES)),
}


@pytest.mark.parametrize("name", MODULES)
def test_surrogate_gives_what_the_module_gives(name: str) -> None:
    module, inputs = MODULES[name](), record()
    surrogate = made_of(module)
    blocks = windows_of(inputs)[(len(inputs) - 1) % WINDOW.n_out :: WINDOW.n_out]
    expected = values(module, blocks).reshape(-1, len(OUTPUTS))[-len(inputs) :]
    assert_same(surrogate.predict(inputs), expected)
    assert_same(surrogate.predict_newest(inputs), newest(module, inputs))


@pytest.mark.parametrize("name", MODULES)
def test_fmu_gives_what_the_module_gives(name: str, tmp_path: Path) -> None:
    build_libraries()
    module, inputs = MODULES[name](), record()
    path = slide.export_fmu(made_of(module), tmp_path / "module.fmu")
    with unpacked(path) as fmu:
        columns = {signal.name: inputs[:, i] for i, signal in enumerate(INPUTS)}
        found = run_fmu(fmu, columns, [signal.name for signal in OUTPUTS])
    assert_same(found.values[1:], newest(module, inputs))


def test_inputs_that_move_are_those_that_a_step_reaches(tmp_path: Path) -> None:
    build_libraries()
    moving = [dataclasses.replace(signal, hold="first_order") for signal in INPUTS]
    module, inputs = dense(nn.Tanh()), record()
    surrogate = slide.from_torch(module, inputs=moving, outputs=OUTPUTS, window=WINDOW)
    path = slide.export_fmu(surrogate.reaching_inputs_by_step_end(), tmp_path / "module.fmu")
    with unpacked(path) as fmu:
        columns = {signal.name: inputs[:, i] for i, signal in enumerate(INPUTS)}
        found = run_fmu(fmu, columns, [signal.name for signal in OUTPUTS])
    assert_same(found.values[1:], newest(module, inputs))


def test_module_stays_as_it_is() -> None:
    module = norms().train()
    made_of(module)
    assert module.training
    assert next(module.parameters()).dtype == torch.float32


def test_large_offsets_cost_no_digits() -> None:
    """A pressure around 1 bar is scaled by the module; single precision has its range alone."""
    pressure = slide.Signal("p", "Pa", 1e5, 1e5 + 20)
    norm, linear = nn.BatchNorm1d(TAKES), nn.Linear(TAKES, WINDOW.n_out)
    assert norm.running_mean is not None
    assert norm.running_var is not None
    norm.running_mean[:], norm.running_var[:] = 1e5 + 10, 36.0
    module = nn.Sequential(nn.Flatten(), norm, linear)
    window = slide.Window(0.01, TAKES, WINDOW.n_out)
    surrogate = slide.from_torch(module, inputs=[pressure], outputs=OUTPUTS[:1], window=window)
    windows = np.random.default_rng(1).uniform(1e5, 1e5 + 20, (30, TAKES, 1))
    assert_same(surrogate.predict_windows(windows)[:, :, 0], values(module, windows))


def flat(*layers: nn.Module) -> nn.Sequential:
    return nn.Sequential(nn.Linear(TAKES, 4), *layers, nn.Linear(4, GIVES))


def not_finite() -> nn.Sequential:
    module = flat()
    module[0].weight.data[1, 1] = torch.inf
    return module


def hooked() -> nn.Sequential:
    module = dense(nn.Tanh())
    module.register_forward_hook(lambda _module, _given, values: values + 1)
    return module


class Own(nn.Module):
    """A module of two layers, whose order only its forward knows."""

    def __init__(self) -> None:
        super().__init__()
        self.first, self.second = nn.Linear(TAKES, 4), nn.Linear(4, GIVES)


REFUSED: dict[str, tuple[Callable[[], object], str, str]] = {
    "recurrent": (lambda: nn.Sequential(nn.LSTM(2, 4)), "layer 0 (LSTM)", "no such layer"),
    "nested": (lambda: flat(nn.Sequential(nn.Softplus())), "layer 1.0 (Softplus)", "expected"),
    "convolution": (lambda: nn.Conv1d(2, 2, 3), "module (Conv1d)", "torch.nn.Sequential of"),
    "exact gelu": (lambda: flat(nn.GELU()), "layer 1 (GELU)", "'tanh'"),
    "alpha": (lambda: flat(nn.ELU(0.5)), "alpha = 0.5", "expected alpha = 1"),
    "flatten": (lambda: nn.Sequential(nn.Flatten(0), flat()), "axes 0 to -1", "expected 1 to -1"),
    "no statistics": (
        lambda: flat(nn.BatchNorm1d(4, track_running_stats=False)), "layer 1", "statistics",
    ),
    "lazy": (lambda: nn.Sequential(nn.LazyLinear(GIVES)), "no weights yet", "called once"),
    "own forward": (Own, "module (Own)", "ONNX"),
    "forward does more": (lambda: Wrapped(2.0), "something else", "differs by"),
    "hook": (hooked, "something else", "a hook"),
    "window": (lambda: nn.Linear(7, GIVES), "takes 7", "12 x 2 = 24"),
    "outputs": (lambda: nn.Linear(TAKES, 5), "gives 5 values", "3 x 2 = 6"),
    "sizes": (lambda: flat(nn.Linear(3, 4)), "layer 1 (Linear): takes 3", "expected 4"),
    "infinite": (not_finite, "layer 0 (Linear)", "not finite"),
    "text": (lambda: "network.pt", "network.pt", ".onnx"),
    "no module": (lambda: 3, "int", "torch.nn.Sequential"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_module_that_cannot_be_taken_is_refused(name: str) -> None:
    make, what, expected = REFUSED[name]
    with pytest.raises((ValueError, TypeError)) as refused:
        made_of(make())
    assert what in str(refused.value)
    assert expected in str(refused.value)


def test_every_layer_that_cannot_be_taken_has_a_line() -> None:
    with pytest.raises(ValueError, match="cannot be taken") as refused:
        made_of(nn.Sequential(nn.GRU(2, 3), nn.Linear(3, 4), nn.Softmax(1), nn.Linear(4, 5)))
    lines = str(refused.value).splitlines()
    assert [line.split(":")[0].strip() for line in lines[1:-1]] == [
        "layer 0 (GRU)",
        "layer 2 (Softmax)",
        "the last layer gives 5 values; expected n_out x outputs = 3 x 2 = 6, oldest sample first",
    ]


@pytest.mark.parametrize("missing", ["inputs", "outputs"])
def test_signals_are_asked_for(missing: str) -> None:
    signals = {"inputs": INPUTS, "outputs": OUTPUTS, missing: ()}
    with refused(ValueError, "at least one signal"):
        slide.from_torch(dense(nn.ReLU()), window=WINDOW, **signals)
