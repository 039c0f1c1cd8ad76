"""An FMU says whether its outputs lie in the ranges that they had in the training."""

from __future__ import annotations

import dataclasses
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.cosim.check import wide_differences
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.fitting.network import learnt_ranges
from slide_fmu.fmu.description.variables import OUTPUTS_IN_RANGE
from slide_fmu.fmu.export import export_fmu
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.importer.file import unpacked
from slide_fmu.surrogate.payload import PayloadError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.samples import Shape, random_surrogate
from tests.libraries import build_libraries
from tests.refusals import refused

SURROGATE = random_surrogate(Shape(n_inputs=2, n_outputs=2))
RNG = np.random.default_rng(4)


def inputs_of(surrogate: Surrogate, count: int) -> np.ndarray:
    return surrogate.input_scaling.invert(RNG.uniform(-1, 1, (count, len(surrogate.inputs))))


def with_ranges(surrogate: Surrogate, inputs: np.ndarray) -> Surrogate:
    """Ranges that about half of the outputs leave."""
    quantiles = np.quantile(surrogate.predict_newest(inputs), [0.15, 0.85], axis=0)
    return dataclasses.replace(surrogate, output_ranges=np.ascontiguousarray(quantiles.T))


@pytest.mark.parametrize("fmi", [2, 3])
def test_library_says_what_python_says(fmi: FmiVersion, tmp_path: Path) -> None:
    build_libraries()
    inputs = inputs_of(SURROGATE, 300)
    surrogate = with_ranges(SURROGATE, inputs)
    fmu = export_fmu(surrogate, tmp_path / f"{surrogate.name}.fmu", fmi=fmi)
    columns = {signal.name: inputs[:, i] for i, signal in enumerate(surrogate.inputs)}
    names = [signal.name for signal in surrogate.outputs]
    with unpacked(fmu) as files:
        found = run_fmu(files, columns, [*names, OUTPUTS_IN_RANGE], None, surrogate.window.step)
    said = surrogate.outputs_in_range(found.values[:, :2])
    np.testing.assert_array_equal(found.values[:, 2], said)
    assert 0.2 < said.mean() < 0.8
    assert wide_differences(fmu) == []


def test_surrogates_without_the_ranges_have_no_such_variable(tmp_path: Path) -> None:
    build_libraries()
    fmu = export_fmu(SURROGATE, tmp_path / f"{SURROGATE.name}.fmu")
    with unpacked(fmu) as files:
        assert OUTPUTS_IN_RANGE not in files.references
    with refused(ValueError, "not known"):
        SURROGATE.outputs_in_range(np.zeros((1, 2)))


def test_file_keeps_the_ranges_and_damaged_ones_are_refused() -> None:
    surrogate = with_ranges(SURROGATE, inputs_of(SURROGATE, 100))
    data = surrogate.to_bytes()
    again = Surrogate.from_bytes(data)
    assert surrogate.output_ranges is not None
    np.testing.assert_array_equal(again.output_ranges, surrogate.output_ranges)
    assert again.to_bytes() == data
    at = data.index(b"RANG") + 8
    swapped = data[:at] + struct.pack("<2d", 1.0, -1.0) + data[at + 16 : -4]
    with refused(PayloadError, "output_ranges"):
        Surrogate.from_bytes(swapped + struct.pack("<I", zlib.crc32(swapped)))


def test_learnt_ranges_are_those_of_all_trajectories_and_a_little_wider() -> None:
    outputs = np.array([[[0.0, 5.0], [1.0, np.nan]], [[-1.0, 4.0], [0.5, 6.0]]])
    np.testing.assert_allclose(learnt_ranges(outputs), [[-1.02, 1.02], [3.98, 6.02]])
