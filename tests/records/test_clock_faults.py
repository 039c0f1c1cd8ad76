"""Clocks of loggers are refused by what is wrong with them, with the step where it is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.signals import FloatArray
from slide_fmu.records.clock import clock_of
from slide_fmu.records.findings import Finding, examine
from tests.records.test_timing import timed

STEP = 0.01
N = 8000
EVEN = STEP * np.arange(N)


def found(time: FloatArray, unit: str = "s", values: FloatArray | None = None) -> Finding:
    """The only finding that refuses a record with these times in s, and values of its column."""
    record = replace(timed(time), clock_unit=unit)
    if values is not None:
        record = replace(record, columns={"u": values})
    [finding] = [one for one in examine([record]) if one.severity == "refused"]
    return finding


def displaced(sample: int, value: float) -> FloatArray:
    time = EVEN.copy()
    time[sample] = value
    return time


def swapped() -> FloatArray:
    time = EVEN.copy()
    time[[1000, 1001]] = time[[1001, 1000]]
    return time


@pytest.mark.parametrize(
    ("time", "unit", "words", "step"),
    [
        ((EVEN + 60) % 65.536, "ms", "a counter of 16 bits that begins anew every 65.536 s", STEP),
        ((EVEN + 4290) % (2**32 * 1e-6), "us", "a counter of 32 bits", STEP),
        ((EVEN + 50) % 60, "s", "by a minute: a clock that begins anew", STEP),
        (np.where(EVEN > 20, EVEN - 1, EVEN), "s", "as a clock that is set back", STEP),
        (np.where(EVEN > 20, EVEN - 3600, EVEN), "s", "by an hour", STEP),
        (np.tile(EVEN[:3000], 2), "s", "the file holds 2 records behind one another", None),
        (EVEN % 60, "s", "the file holds 2 records behind one another", None),
        (displaced(1000, 1e6), "s", "1e+06 s stands between 9.99 and 10.01 s", None),
        (displaced(1000, 0.0), "s", "0 s stands between 9.99 and 10.01 s", None),
        (swapped(), "s", "or rows have changed places", None),
        (EVEN[::-1], "s", "the rows are in reverse order", None),
        (np.floor(EVEN), "s", "there are only 80 different times, 1 s apart", STEP),
        (60 * np.floor(500 * EVEN / 60), "min", "60 s apart, for 8000 samples, 12 for each", 5.0),
        (60 * np.floor(EVEN / 60), "min", "there are only 2 different times", None),
        (np.round(0.4 * EVEN, 2), "s", "the clock is too coarse", 0.004),
        (np.repeat(EVEN[::10], 10), "s", "or samples have the time of their packet", STEP),
        (
            np.repeat(EVEN[9::10], 10) + 1e-5 * np.tile(np.arange(10), N // 10),
            "s",
            "bursts of 10 that are 1e-05 s apart, one burst every 0.1 s",
            STEP,
        ),
    ],
)
def test_clock_is_refused_by_what_is_wrong(
    time: FloatArray, unit: str, words: str, step: float | None
) -> None:
    finding = found(time, unit)
    assert words in finding.message
    assert finding.step == (None if step is None else pytest.approx(step, rel=0.01))
    assert finding.keys == ({} if step is None else {"sample_step": finding.step})


def test_rows_that_are_there_twice_are_no_coarse_clock() -> None:
    finding = found(np.insert(EVEN, [500, 900], EVEN[[500, 900]]))
    assert "remove samples that are there twice" in finding.message


def test_stretch_of_rows_that_is_there_twice_is_no_clock_that_is_set_back() -> None:
    rows = np.concatenate([np.arange(3000), np.arange(2990, 5000), np.arange(4000, N)])
    finding = found(EVEN[rows], values=np.sin(EVEN[rows]))
    assert "1010 rows are there twice" in finding.message
    assert "sample 3001" in finding.message
    assert finding.keys == {}
    other = found(EVEN[rows], values=np.sin(STEP * np.arange(len(rows))))
    assert "there twice" not in other.message


@pytest.mark.parametrize("jitter", [0.2, 0.45])
def test_uneven_clock_has_no_gaps_where_no_sample_is_lost(jitter: float) -> None:
    rng = np.random.default_rng(0)
    time = np.sort(EVEN + jitter * STEP * rng.uniform(-1, 1, N))
    assert clock_of(time).gaps == ()
    lost = np.delete(time, np.r_[3000:3020])
    assert [gap.sample for gap in clock_of(lost).gaps] == [2999]


@pytest.mark.parametrize("law", ["exponential", "gamma", "lognormal", "uniform"])
def test_random_steps_are_an_uneven_clock_and_no_lost_samples(law: str) -> None:
    rng = np.random.default_rng(0)
    steps = {
        "exponential": lambda: rng.exponential(STEP, N),
        "gamma": lambda: rng.gamma(3, STEP / 3, N),
        "lognormal": lambda: STEP * np.exp(0.5 * rng.normal(size=N)),
        "uniform": lambda: STEP * rng.uniform(0.1, 1.9, N),
    }[law]()
    findings = examine([timed(np.cumsum(steps))])
    assert {one.kind for one in findings} <= {"uneven clock", "gap"}
    uneven = findings[0]
    assert uneven.severity == "remarked"
    low, middle, high = np.quantile(steps[1:], (0, 0.5, 1))
    assert f"samples are {low:.3g} s to {high:.3g} s apart" in uneven.message
    assert f"the median is {middle:.3g} s" in uneven.message
    assert "window.step" in uneven.message
    assert not any("samples of" in one.message for one in findings)
    assert len(clock_of(np.cumsum(steps)).gaps) <= 3


def test_samples_that_are_lost_from_an_even_clock_leave_gaps() -> None:
    kept = np.random.default_rng(0).random(N) > 0.1
    assert len(clock_of(EVEN[kept]).gaps) > 500


def test_slower_rate_in_the_same_file_is_said_with_its_place() -> None:
    time = np.concatenate([EVEN[:4000], EVEN[4000::2]])
    [gap] = [one for one in examine([timed(time)]) if one.kind == "gap"]
    assert "from sample 4001 (line 4002, t = 40 s) on, it has 2 times the step" in gap.message
