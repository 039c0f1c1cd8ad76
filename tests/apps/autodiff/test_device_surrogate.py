"""A surrogate on a device of torch predicts what the runtime predicts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

import slide_fmu as slide
from slide_fmu.apps.autodiff import device_surrogate as module
from slide_fmu.fmu.native import NativeSurrogate
from tests.fmu.samples import sum_surrogate
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
RELEASED = ("duffing", "slider_crank", "robot_6r")
CUDA = pytest.param(
    "cuda",
    marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no CUDA device"),
)


def released(name: str) -> slide.Surrogate:
    return slide.load(ROOT / "fmus" / name / f"{name}.fmu")


def records_of(surrogate: slide.Surrogate) -> np.ndarray:
    """Records (5, 40, n_inputs) that move slowly; directors stay on their circle."""
    phases = np.random.default_rng(1).uniform(0, 3, (5, 1)) + 0.05 * np.arange(40)
    if surrogate.name == "slider_crank":
        return np.stack([np.cos(phases), np.sin(phases)], axis=2)
    shape = np.sin(phases[:, :, None] + np.arange(len(surrogate.inputs)))
    return surrogate.input_scaling.invert(0.3 * shape)


@pytest.mark.parametrize("device", ["cpu", CUDA])
@pytest.mark.parametrize("name", RELEASED)
def test_records_on_a_device_have_the_outputs_of_the_runtime(name: str, device: str) -> None:
    surrogate = released(name)
    records = records_of(surrogate)
    found = slide.device_surrogate(surrogate, device).predict(records)
    expected = NativeSurrogate(surrogate).predict(records)
    error = np.abs(found - expected) / surrogate.output_scaling.scale
    assert np.max(error) < 4e-5  # both in single precision, summed in other orders


def test_records_do_not_depend_on_the_blocks_that_they_run_in(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    surrogate = released("duffing")
    records, on_device = records_of(surrogate), slide.device_surrogate(surrogate, "cpu")
    whole = on_device.predict(records)
    monkeypatch.setattr(module, "NUMBERS_AT_ONCE", 1)
    assert len(list(on_device.blocks(records))) == len(records)
    np.testing.assert_allclose(on_device.predict(records), whole, rtol=1e-4, atol=1e-5)


def test_device_that_torch_does_not_find_is_refused() -> None:
    with refused(ValueError, "device 'abacus' cannot be used", "such as cuda, or cpu"):
        slide.device_surrogate(released("duffing"), "abacus")


def test_other_families_are_refused_on_a_device() -> None:
    with refused(TypeError, "expected StateSpace: use NativeSurrogate"):
        slide.device_surrogate(sum_surrogate(), "cpu")


def test_records_of_a_wrong_shape_are_refused() -> None:
    with refused(ValueError, "sequences"):
        slide.device_surrogate(released("duffing"), "cpu").predict(np.zeros((3, 40, 2)))
