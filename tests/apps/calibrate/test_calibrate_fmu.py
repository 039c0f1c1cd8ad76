"""Records from files are held against an FMU: columns, units, steps, outputs that are missing."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssv

from slide_fmu.apps.calibrate.calibrate_fmu import RecordFiles, calibrate_fmu, write_parameters
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.ssv import SET
from slide_fmu.fmu.export import export_fmu
from slide_fmu.record_files.record import RecordError
from slide_fmu.surrogate.surrogate import Surrogate
from tests.apps.calibrate.records import measured, surrogate_with
from tests.fmu.samples import STEP, CellShape, Shape, random_surrogate
from tests.refusals import refused

TRUE = {"mass": 2.6}
SAME = 1e-3


@pytest.fixture(scope="module")
def surrogate() -> Surrogate:
    """Two outputs that follow one parameter."""
    return surrogate_with(1, n_outputs=2)


@pytest.fixture(scope="module")
def fmu(surrogate: Surrogate, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(surrogate, tmp_path_factory.mktemp("fmu") / "sample.fmu")


def columns_of(surrogate: Surrogate, samples: int = 600) -> dict[str, FloatArray]:
    """Inputs and outputs that were measured together: held inputs, answered one sample later."""
    inputs, outputs = measured(surrogate, TRUE, samples=samples)
    answers = np.concatenate([outputs[:1], outputs[:-1]])
    time = STEP * np.arange(samples)
    return {"time [s]": time, "u0 [N]": inputs[:, 0], "y0": answers[:, 0], "y1": answers[:, 1]}


def write(path: Path, columns: Mapping[str, Any]) -> str:
    table = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, table, "%.9g", ",", header=",".join(columns), comments="")
    return str(path)


def value(fmu: Path, measured: RecordFiles) -> float:
    found, _ = calibrate_fmu(fmu, measured, {}, 0)
    return found.values["mass"]


def test_columns_of_the_signals_names_are_taken(
    fmu: Path, surrogate: Surrogate, tmp_path: Path
) -> None:
    path = write(tmp_path / "a.csv", columns_of(surrogate))
    found, remarks = calibrate_fmu(fmu, RecordFiles((path,)), {}, 0)
    assert found.values == pytest.approx(TRUE, abs=SAME)
    assert remarks == ()
    assert [fit.name for fit in found.outputs] == ["y0", "y1"]


def test_columns_of_other_names_are_named_and_other_outputs_left_out(
    fmu: Path, surrogate: Surrogate, tmp_path: Path
) -> None:
    columns = columns_of(surrogate)
    path = write(
        tmp_path / "a.csv", dict(zip(["t", "F", "a", "b"], columns.values(), strict=True))
    )
    named = RecordFiles((path,), {"u0": "F"}, {"y1": "b"})
    found, _ = calibrate_fmu(fmu, named, {}, 0)
    assert found.values == pytest.approx(TRUE, abs=SAME)
    assert [fit.name for fit in found.outputs] == ["y1"]


def test_record_with_a_gap_and_another_record_count_together(
    fmu: Path, surrogate: Surrogate, tmp_path: Path
) -> None:
    columns = columns_of(surrogate)
    with_gap = {n: np.delete(v, np.r_[200:260]) for n, v in columns.items()}
    paths = write(tmp_path / "a.csv", with_gap), write(tmp_path / "b.csv", columns)
    found, remarks = calibrate_fmu(fmu, RecordFiles(paths), {}, 0)
    assert found.values == pytest.approx(TRUE, abs=SAME)
    assert found.samples == (200 - 1) + (340 - 1) + (600 - 1) - 3 * surrogate.window.n_truncated
    assert any("1 gap, 60 samples" in remark for remark in remarks)


def test_outputs_that_are_missing_do_not_count_and_do_not_cut(
    fmu: Path, surrogate: Surrogate, tmp_path: Path
) -> None:
    columns = columns_of(surrogate)
    columns["y0"] = columns["y0"].copy()
    columns["y0"][10::15] = np.nan
    found, _ = calibrate_fmu(fmu, RecordFiles((write(tmp_path / "a.csv", columns),)), {}, 0)
    assert found.values == pytest.approx(TRUE, abs=SAME)
    assert found.samples == 599 - surrogate.window.n_truncated
    assert any("measured outputs are missing and do not count" in r for r in found.remarks)


def test_record_that_is_too_short_to_count_is_remarked(
    fmu: Path, surrogate: Surrogate, tmp_path: Path
) -> None:
    columns = columns_of(surrogate)
    tiny = {name: values[:10] for name, values in columns.items()}
    paths = write(tmp_path / "a.csv", columns), write(tmp_path / "tiny.csv", tiny)
    found, _ = calibrate_fmu(fmu, RecordFiles(paths), {}, 0)
    [remark] = [r for r in found.remarks if "left out" in r]
    assert "1 of 2 records or parts of them, with 9 samples" in remark
    alone, _ = calibrate_fmu(fmu, RecordFiles(paths[:1]), {}, 0)
    assert not any("left out" in r for r in alone.remarks)


def test_finer_record_is_resampled_to_the_step_of_the_fmu(
    fmu: Path, surrogate: Surrogate, tmp_path: Path
) -> None:
    """Held inputs stay; the outputs are straight lines between their samples."""
    columns = columns_of(surrogate)
    old = columns["time [s]"]
    fine = np.arange(0, old[-1], STEP / 2)
    smooth = {name: np.interp(fine, old, values) for name, values in columns.items()}
    held = np.repeat(columns["u0 [N]"], 2)[: len(fine)]
    path = write(tmp_path / "a.csv", {**smooth, "time [s]": fine, "u0 [N]": held})
    found, remarks = calibrate_fmu(fmu, RecordFiles((path,)), {}, 0)
    assert found.values == pytest.approx(TRUE, rel=0.1)
    assert any("resampled from 0.0025 s to 0.005 s" in remark for remark in remarks)


def test_record_without_times_needs_a_step(
    fmu: Path, surrogate: Surrogate, tmp_path: Path
) -> None:
    columns = columns_of(surrogate)
    del columns["time [s]"]
    path = write(tmp_path / "a.csv", columns)
    assert value(fmu, RecordFiles((path,), step=STEP)) == pytest.approx(TRUE["mass"], abs=SAME)
    with refused(RecordError, "step"):
        value(fmu, RecordFiles((path,)))


def test_input_that_rests_is_no_mistake(fmu: Path, surrogate: Surrogate, tmp_path: Path) -> None:
    """The record tells little then, but that is for the interval to say."""
    columns = columns_of(surrogate)
    outputs = surrogate.predict_newest(np.full((600, 1), 0.5), TRUE)
    noise = 0.01 * np.random.default_rng(0).normal(size=outputs.shape)
    y0, y1 = (outputs + noise).T
    path = write(tmp_path / "a.csv", {**columns, "u0 [N]": np.full(600, 0.5), "y0": y0, "y1": y1})
    found, _ = calibrate_fmu(fmu, RecordFiles((path,)), {}, 0)
    (fitted,) = found.parameters
    assert fitted.low <= TRUE["mass"] <= fitted.high


def test_records_that_do_not_fit_are_refused_in_words(
    fmu: Path, surrogate: Surrogate, tmp_path: Path
) -> None:
    columns = columns_of(surrogate)
    good = write(tmp_path / "good.csv", columns)
    slow = {**columns, "time [s]": 2 * columns["time [s]"]}
    in_kn = {("u0 [kN]" if n == "u0 [N]" else n): v for n, v in columns.items()}
    still = {**columns, "y1": np.ones(600)}
    short = {name: values[:30] for name, values in columns.items()}
    cases = [
        (
            RecordFiles((good,), {"force": "u0"}),
            "--input names 'force'; expected one of the FMU",
        ),
        (RecordFiles((good,), {"u0": "force"}), "that it has; --input u0=COLUMN"),
        (RecordFiles((good,), {}, {"y7": "y1"}), "--output names 'y7'"),
        (RecordFiles((str(tmp_path / "none.csv"),)), "none.csv"),
        (
            RecordFiles((write(tmp_path / "slow.csv", slow),)),
            "sample step 0.01 s; expected at",
        ),
        (RecordFiles((write(tmp_path / "kn.csv", in_kn),)), "'u0' is in kN; expected N"),
        (RecordFiles((write(tmp_path / "still.csv", still),)), "the value is 1 in all samples"),
        (RecordFiles((write(tmp_path / "short.csv", short),)), "15 samples remain"),
    ]
    for given, message in cases:
        with pytest.raises(ValueError, match=re.escape(message)):
            calibrate_fmu(fmu, given, {}, 0)


def test_wrong_pairing_is_remarked(fmu: Path, surrogate: Surrogate, tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", columns_of(surrogate))
    _, remarks = calibrate_fmu(fmu, RecordFiles((path,), pairing="same"), {}, 0)
    assert any("use the pairing 'later'" in remark for remark in remarks)


def test_values_are_written_for_an_ssp(fmu: Path, surrogate: Surrogate, tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", columns_of(surrogate))
    found, _ = calibrate_fmu(fmu, RecordFiles((path,)), {}, 0)
    write_parameters(found, tmp_path / "fitted.ssv")
    read = read_ssv(str(tmp_path / "fitted.ssv"))
    assert read.name == SET
    assert {p.name: float(p.value) for p in read.parameters} == found.values
    with refused(ValueError, "expected a name ending", "ending in"):
        write_parameters(found, tmp_path / "fitted.xml")


def test_inputs_that_move_are_answered_at_once(tmp_path: Path) -> None:
    shape = Shape(n_in=20, n_out=6, hold="first_order", cell=CellShape(states=4, parameters=1))
    surrogate = random_surrogate(shape)
    inputs, outputs = measured(surrogate, TRUE)
    columns = {"t": STEP * np.arange(600), "u0": inputs[:, 0], "y0": outputs[:, 0]}
    path = write(tmp_path / "a.csv", columns)
    fmu = export_fmu(surrogate, tmp_path / "moving.fmu")
    assert value(fmu, RecordFiles((path,))) == pytest.approx(TRUE["mass"], abs=SAME)
