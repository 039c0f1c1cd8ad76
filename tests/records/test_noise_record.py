"""Records that were taken while nothing moved, beside those of the moving machine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.noise_record import LEAST, QUIET, SHORTEST
from slide_fmu.systems.errors import LoadError
from tests.own_records import STEP, force_and_travel, write_record
from tests.records.test_record_model import source_of
from tests.refusals import refused

NOISE = 0.03
POLE = 0.9


def drift(samples: int, seed: int = 5) -> np.ndarray:
    white = np.random.default_rng(seed).normal(size=samples)
    return scipy.signal.lfilter([NOISE * np.sqrt(1 - POLE**2)], [1.0, -POLE], white)


def write_noise(
    path: Path, values: np.ndarray, step: float = STEP, header: str = "time [s],travel [m]"
) -> Path:
    table = np.stack([step * np.arange(len(values)), values], axis=1)
    np.savetxt(path, table, "%.9g", ",", header=header, comments="")
    return path


def source_with(folder: Path, at_rest: Path, **changes: object) -> MeasuredRecords:
    moving = write_record(folder / "a.csv", noise=NOISE)
    return source_of(moving, noise_record=str(at_rest), **changes)


def test_noise_record_needs_the_outputs_only_and_gives_its_noise(tmp_path: Path) -> None:
    values = drift(3000)
    source = source_with(tmp_path, write_noise(tmp_path / "rest.csv", values))
    assert source.noise_record is not None
    [piece] = source.noise_record.pieces
    assert piece[:, 0] == pytest.approx(values, abs=1e-9)
    assert (source.noise_record.file, len(source.noise_record.digest)) == ("rest.csv", 64)
    # the moving records are the same with it and without
    without = source_of(tmp_path / "a.csv")
    assert without.noise_record is None
    assert np.array_equal(without.identity, source.identity)
    assert source.files == ("a.csv",)


def test_remark_tells_how_large_and_how_coloured_the_noise_is(tmp_path: Path) -> None:
    source = source_with(tmp_path, write_noise(tmp_path / "rest.csv", drift(3000)))
    [remark] = [remark for remark in source.remarks if "rest.csv" in remark]
    deviation = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)[:, 2].std()
    percent = 100 * drift(3000).std() / deviation
    assert f"noise of 'travel' is {percent:.3g} % of its standard deviation" in remark
    assert "coloured: an autoregression of order 1 predicts all of it but 4" in remark
    white = NOISE * np.random.default_rng(0).normal(size=3000)
    source = source_with(tmp_path, write_noise(tmp_path / "white.csv", white))
    assert any("and white; residuals are weighted by it" in remark for remark in source.remarks)


def test_noise_is_brought_to_the_step_as_the_records_are(tmp_path: Path) -> None:
    at_rest = write_noise(tmp_path / "rest.csv", drift(3000))
    source = source_with(tmp_path, at_rest, step=2 * STEP)
    assert source.noise_record is not None
    [piece] = source.noise_record.pieces
    expected = scipy.signal.resample_poly(drift(3000), 1, 2)
    assert len(expected) == len(piece) + 20  # the filter's ends are left out
    assert piece[:, 0] == pytest.approx(expected[10:-10], abs=1e-6)


def test_noise_is_cut_where_samples_are_missing(tmp_path: Path) -> None:
    values = drift(3000)
    values[1000:1010] = np.nan
    source = source_with(tmp_path, write_noise(tmp_path / "rest.csv", values))
    assert source.noise_record is not None
    assert [len(piece) for piece in source.noise_record.pieces] == [1000, 1990]


@pytest.mark.parametrize("every", [3, 7])  # every second one would be another rate
def test_noise_record_of_short_pieces_is_refused(tmp_path: Path, every: int) -> None:
    """Its spectrum would be that of other noise: that of single samples looks white."""
    values = drift(6000)
    values[::every] = np.nan
    at_rest = write_noise(tmp_path / "rest.csv", values)
    with pytest.raises(LoadError, match=rf"in pieces of at least {SHORTEST} without a gap"):
        source_with(tmp_path, at_rest)


def test_value_that_is_not_finite_does_not_hide_that_the_machine_moves(tmp_path: Path) -> None:
    values = force_and_travel(3000, 4)[1].copy()
    values[100] = np.inf
    at_rest = write_noise(tmp_path / "rest.csv", values)
    with refused(LoadError, "the standard deviation is", "while nothing moves"):
        source_with(tmp_path, at_rest)


def test_what_is_remarkable_in_a_noise_record_is_remarked(tmp_path: Path) -> None:
    values = drift(3000)
    values[1500] = 80 * NOISE
    source = source_with(tmp_path, write_noise(tmp_path / "rest.csv", values))
    [remark] = [r for r in source.remarks if "rest.csv" in r and "residuals" not in r]
    assert "'travel'" in remark
    assert "1 samples jump away from both" in remark


def test_noise_record_without_a_unit_is_taken_to_have_that_of_the_others(tmp_path: Path) -> None:
    at_rest = write_noise(tmp_path / "rest.csv", drift(3000), header="time [s],travel")
    source = source_with(tmp_path, at_rest)
    assert source.noise_record is not None
    [remark] = [remark for remark in source.remarks if "tells no unit" in remark]
    assert "'travel' tells no unit; it is taken to be 'm', that of" in remark


def test_changed_noise_record_is_read_again(tmp_path: Path) -> None:
    at_rest = write_noise(tmp_path / "rest.csv", drift(3000))
    before = source_with(tmp_path, at_rest).noise_record
    write_noise(at_rest, drift(3000, 6))
    after = source_with(tmp_path, at_rest).noise_record
    assert before is not None
    assert after is not None
    assert before.digest != after.digest


@pytest.mark.parametrize(
    ("values", "header", "message"),
    [
        (drift(LEAST - 1), "", rf"has {LEAST - 1} samples of 0\.01 s .* at least {LEAST}: record"),
        (np.full(3000, 0.2), "", "'travel': the value is the same in all samples; expected the"),
        (
            force_and_travel(3000, 4)[1],
            "",
            rf"'travel': the standard deviation is .* m, [\d.]+ % of .* at most {100 * QUIET:g} %",
        ),
        (drift(3000), "time [s],travel [mm]", "'travel': the unit is 'mm'; expected 'm', that of"),
        (drift(3000), "time [s],speed [m/s]", r"has no columns \['travel'\]; it has"),
        (np.where(drift(3000) > 0, np.nan, drift(3000)), "", "'travel': .* empty"),
    ],
)
def test_noise_record_that_tells_nothing_is_refused(
    tmp_path: Path, values: np.ndarray, header: str, message: str
) -> None:
    header = header or "time [s],travel [m]"
    at_rest = write_noise(tmp_path / "rest.csv", values, header=header)
    with pytest.raises(LoadError, match=message) as caught:
        source_with(tmp_path, at_rest)
    assert "rest.csv" in str(caught.value)


def test_noise_record_of_another_step_is_refused(tmp_path: Path) -> None:
    at_rest = write_noise(tmp_path / "rest.csv", drift(3000), 2 * STEP)
    with refused(LoadError, "expected 0.01 s", "0.02 s"):
        source_with(tmp_path, at_rest)


def test_moving_record_as_noise_record_is_refused(tmp_path: Path) -> None:
    moving = write_record(tmp_path / "a.csv", noise=NOISE)
    with refused(LoadError, "holds the same bytes as", "a.csv; expected a record"):
        source_of(moving, noise_record=str(moving))


def test_missing_noise_record_is_named(tmp_path: Path) -> None:
    with refused(LoadError, "noise record '", "nowhere.csv'"):
        source_with(tmp_path, tmp_path / "nowhere.csv")


def test_noise_record_without_times_has_the_step_of_the_others(tmp_path: Path) -> None:
    force, travel = force_and_travel(3000)
    table = np.stack([force, travel + drift(3000, 7)], axis=1)
    np.savetxt(tmp_path / "a.csv", table, "%.9g", ",", header="force,travel [m]", comments="")
    np.savetxt(tmp_path / "rest.csv", drift(3000), "%.9g", header="travel [m]", comments="")
    source = source_of(
        tmp_path / "a.csv",
        noise_record=str(tmp_path / "rest.csv"),
        parameters={"sample_step": STEP},
    )
    assert source.noise_record is not None
    assert [len(piece) for piece in source.noise_record.pieces] == [3000]
