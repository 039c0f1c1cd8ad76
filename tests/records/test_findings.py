"""What is planted into a record is found at its place, and nothing is found where nothing is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.record_files.record import RecordError, Text
from slide_fmu.records.faults import outliers, quantization, saturations
from slide_fmu.records.findings import examine
from tests.records.samples import clean_signals, multisine, record, the_one
from tests.refusals import refused

RNG = np.random.default_rng(1)
N = 4000
NOISE = RNG.normal(size=N)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("resolution", [0.0, 2 / 4096])
def test_nothing_is_found_in_clean_signals(seed: int, resolution: float) -> None:
    for name, values in clean_signals(seed).items():
        scaled = values / values.std()
        if resolution:
            scaled = np.round(scaled / resolution) * resolution
        assert examine([record({name: scaled})]) == ()


def test_text_is_refused_with_its_line_and_column() -> None:
    values = NOISE.copy()
    values[[57, 80]] = np.nan
    text = Text("u", 2, 57, "fault")
    message = the_one(examine([record({"u": values}, texts=(text,))]), "text", "refused")
    assert message.startswith(
        "a.csv, column 'u': the text 'fault' at sample 58 (line 59, t = 0.057"
    )
    assert "2 texts in all; expected numbers throughout: mend" in message


@pytest.mark.parametrize("nothing", [np.nan, np.inf])
def test_empty_ranges_are_remarked_with_the_longest(nothing: float) -> None:
    values = NOISE.copy()
    values[100], values[500:530] = nothing, nothing
    message = the_one(examine([record({"u": values})]), "empty", "remarked")
    assert "31 of 4000 values are empty" in message
    assert "in 2 ranges; the longest has 30 samples from sample 501 (line 502" in message


def test_mostly_empty_column_is_refused() -> None:
    values = NOISE.copy()
    values[: N // 2] = np.nan
    assert the_one(examine([record({"u": values})]), "empty", "remarked")
    values[N // 2] = np.nan
    assert "record it anew" in the_one(examine([record({"u": values})]), "empty", "refused")
    assert the_one(examine([record({"u": np.full(50, np.nan)})]), "empty", "refused")


def test_constant_column_is_refused_and_one_that_differs_between_records_is_not() -> None:
    first, second = record({"u": np.full(50, 3.0)}), record({"u": np.full(50, 4.0)})
    assert "is 3 V in all samples" in the_one(examine([first]), "constant", "refused")
    assert examine([first, second]) == ()


@pytest.mark.parametrize("signal", ["sine", "multisine", "low-pass noise"])
@pytest.mark.parametrize("resolution", [0.0, 1 / 2048])
def test_saturation_is_found_at_its_value(signal: str, resolution: float) -> None:
    t = np.arange(N)
    values = {
        "sine": np.sin(2 * np.pi * 1.9 * (t / N) ** 1.5 * 5),
        "multisine": multisine(N, np.random.default_rng(2)) / 3,
        "low-pass noise": np.convolve(NOISE, np.hanning(20) / 8, "same"),
    }[signal]
    limit = 0.5
    cut = np.minimum(values, limit)
    if resolution:
        cut = np.round(cut / resolution) * resolution
    message = the_one(examine([record({"u": cut})]), "saturation", "remarked")
    assert "are exactly 0.5 V" in message
    (found,) = saturations(cut)
    above = cut == limit
    assert above[found.first]
    assert 0.6 * above.sum() < found.samples <= above.sum()


def test_saturation_behind_an_empty_range_is_reported_at_its_own_place() -> None:
    values = np.minimum(multisine(N, np.random.default_rng(2)), 1.5)
    values[:50] = np.nan
    found = {finding.kind: finding.message for finding in examine([record({"u": values})])}
    at_limit = values == 1.5
    long = at_limit[:-2] & at_limit[1:-1] & at_limit[2:]
    assert f"the first at sample {np.flatnonzero(long)[0] + 1} " in found["saturation"]


def test_both_ends_of_a_range_can_saturate() -> None:
    values = np.clip(multisine(N, np.random.default_rng(3)), -0.9, 1.1)
    assert [found.value for found in saturations(values)] == [-0.9, 1.1]


def test_outliers_are_found_where_they_are() -> None:
    values = np.sin((np.arange(N) / 300) ** 1.7) + 1e-3 * NOISE
    for sample, jump in ((700, 3.0), (1500, -2.0), (3000, 0.5)):
        values[sample] += jump
    assert outliers(values).tolist() == [700, 1500, 3000]
    message = the_one(examine([record({"u": values})]), "outlier", "remarked")
    assert "left out of the linear fit that the window follows from, but learnt from" in message
    assert "3 samples jump away" in message
    assert "at sample 701 (line 702" in message


def test_outlier_behind_an_empty_range_is_reported_at_its_own_place() -> None:
    values = np.sin((np.arange(N) / 300) ** 1.7) + 1e-3 * NOISE
    values[700] += 3
    values[200:300] = np.nan
    found = {finding.kind: finding.message for finding in examine([record({"u": values})])}
    assert "at sample 701 (line 702" in found["outlier"]


def test_steep_rise_over_two_samples_is_no_outlier() -> None:
    values = 1e-3 * NOISE + np.interp(np.arange(N), [999, 1001], [0, 5])
    assert not len(outliers(values))


@given(st.integers(1, 398), st.floats(40, 1e6), st.sampled_from([-1, 1]))
def test_any_large_single_jump_is_the_only_outlier(sample: int, size: float, sign: int) -> None:
    values = NOISE[:400].copy()
    values[sample] += sign * size
    assert outliers(values).tolist() == [sample]


@given(st.floats(1e-6, 1e6), st.integers(30, 500), st.integers(-1000, 1000))
def test_resolution_of_rounded_values_is_found(
    resolution: float, levels: int, offset: int
) -> None:
    values = resolution * (offset + np.random.default_rng(levels).integers(0, levels, 5000))
    found = quantization(values)
    assert found is not None
    assert found.resolution == pytest.approx(resolution, rel=1e-6)
    assert found.noise == pytest.approx(resolution / 12**0.5 / values.std(), rel=1e-6)
    assert quantization(values + resolution * 0.2 * np.random.default_rng(0).random(5000)) is None


def test_coarse_rounding_is_remarked_with_the_noise_that_it_makes() -> None:
    values = np.round(NOISE / 0.1) * 0.1
    message = the_one(examine([record({"u": values})]), "quantization", "remarked")
    assert "in steps of 0.1 V; the rounding is 2.9 % of the standard deviation" in message


def test_missing_column_is_named() -> None:
    with refused(RecordError, "columns ['force']"):
        examine([record({"u": NOISE})], ["force"])


def test_every_record_is_examined() -> None:
    good, bad = record({"u": NOISE}), record({"u": np.full(20, np.nan)})
    assert examine([good]) == ()
    assert the_one(examine([good, bad]), "empty", "refused")
