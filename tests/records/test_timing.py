"""Gaps, jitter, falling times and second clocks are found at their places."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.record_files.reading import read_record
from slide_fmu.record_files.record import Record, RecordError, Text
from slide_fmu.records.clock import clock_of, drift, neat_step
from slide_fmu.records.findings import examine
from tests.records.samples import STEP, record, the_one
from tests.refusals import refused

RNG = np.random.default_rng(1)
N = 4000
NOISE = RNG.normal(size=N)


def timed(time: np.ndarray) -> Record:
    return record({"u": np.random.default_rng(8).normal(size=len(time))}, time)


def test_gap_is_remarked_with_its_place_and_the_missing_samples() -> None:
    time = STEP * np.delete(np.arange(1000), np.r_[300:320, 700])
    message = the_one(examine([timed(time)]), "gap", "remarked")
    assert "2 gaps, 21 samples of 0.001 s are missing" in message
    assert "the longest has 0.021 s behind sample 300 (line 301, t = 0.299 s)" in message


def test_single_gap_is_told_in_the_singular() -> None:
    message = the_one(examine([timed(STEP * np.delete(np.arange(1000), 300))]), "gap", "remarked")
    assert "1 gap, 1 sample of 0.001 s is missing, 1 of them singly" in message


def test_jitter_is_remarked_and_small_jitter_is_not() -> None:
    even, jitter = STEP * np.arange(2000), np.random.default_rng(9).normal(size=2000)
    assert examine([timed(even + 0.005 * STEP * jitter)]) == ()
    message = the_one(examine([timed(even + 0.05 * STEP * jitter)]), "jitter", "remarked")
    assert "by 5 % of the step 0.001 s" in message


def test_times_rounded_to_a_digit_give_the_step_of_all_together() -> None:
    clock = clock_of(np.round(np.arange(100_000) / 3000, 6))
    assert clock.step == pytest.approx(1 / 3000, rel=1e-9)
    assert clock.jitter < 0.001
    assert clock.gaps == ()


def test_step_does_not_mind_gaps_and_jitter() -> None:
    rng = np.random.default_rng(10)
    time = np.delete(STEP * (np.arange(5000) + 0.05 * rng.normal(size=5000)), np.r_[1000:1100])
    clock = clock_of(time)
    assert clock.step == pytest.approx(STEP, rel=1e-4)
    assert [gap.sample for gap in clock.gaps] == [999]
    assert clock.pieces(4900) == [(0, 1000), (1000, 4900)]


def test_step_does_not_come_from_the_first_difference() -> None:
    clock = clock_of(STEP * np.delete(np.arange(500), np.r_[1:30]))
    assert clock.step == pytest.approx(STEP)
    assert [gap.sample for gap in clock.gaps] == [0]


def test_time_that_falls_back_is_refused_at_its_line() -> None:
    time = STEP * np.concatenate([np.arange(400), np.arange(100, 500)])
    message = the_one(examine([timed(time)]), "time falls back", "refused")
    assert "falls back by 0.299 s at sample 401 (line 402" in message
    assert "cut the file there" in message


def test_time_that_repeats_is_refused_at_its_line() -> None:
    time = STEP * np.insert(np.arange(500), 200, 199)
    message = the_one(examine([timed(time)]), "time repeats", "refused")
    assert "stays the same at sample 201 (line 202" in message


@pytest.mark.parametrize(("value", "what"), [(np.nan, "is empty"), (np.inf, "is empty")])
def test_time_that_is_no_number_is_refused(value: float, what: str) -> None:
    time = STEP * np.arange(500)
    time[[20, 30]] = value
    message = the_one(examine([timed(time)]), "time", "refused")
    assert f"the time {what} or not finite at sample 21 (line 22), 2 times" in message


def test_text_in_the_time_is_refused_with_it() -> None:
    time = STEP * np.arange(N)
    time[20] = np.nan
    found = examine([record({"u": NOISE}, time, (Text("time", 1, 20, "12:00"),))])
    assert "has the text '12:00' at sample 21 (line 22)" in the_one(found, "time", "refused")


def test_time_that_never_rises_is_refused() -> None:
    assert "never rises" in the_one(examine([timed(np.zeros(500))]), "time", "refused")
    with refused(RecordError, "none of 5 times rises"):
        clock_of(np.zeros(5))


def two_clocks(rate: float) -> Record:
    time = STEP * np.arange(N)
    noise = 1e-5 * np.random.default_rng(11).normal(size=N)
    other = {"can_time": 5 + (1 + rate) * time + noise}
    return Record(time, {"u": NOISE}, {"u": "V"}, "a.csv", "", "time", other)


def test_second_clock_is_remarked_where_the_user_chose_one() -> None:
    chosen = replace(two_clocks(1e-3), clock_is_chosen=True)
    assert "drift apart" in the_one(examine([chosen]), "two clocks", "remarked")


def test_second_clock_that_drifts_is_refused_with_its_drift() -> None:
    assert examine([two_clocks(1e-5)]) == ()
    message = the_one(examine([two_clocks(1e-3)]), "two clocks", "refused")
    assert "column 'can_time': this clock and 'time' drift apart by 0.0039" in message


@given(st.floats(-0.5, 0.5), st.floats(-100, 100))
def test_drift_is_the_slope_times_the_duration(rate: float, offset: float) -> None:
    time = np.linspace(0, 10, 50)
    assert drift(time, offset + (1 + rate) * time) == pytest.approx(10 * rate, abs=1e-9)


def test_step_has_as_few_digits_as_do_no_harm() -> None:
    exact = clock_of(np.arange(100_000) / 3000)
    assert neat_step(exact, 100_000) == pytest.approx(1 / 3000, rel=1e-7)
    assert neat_step(exact, 5) == 0.000333
    assert neat_step(clock_of(STEP * (1 + 1e-9) * np.arange(1000)), 1000) == STEP


def test_times_without_a_unit_are_remarked_once_for_all_records() -> None:
    silent = replace(timed(10 * np.arange(300.0)), clock_unit="")
    found = examine([timed(np.arange(300.0)), silent, silent])
    [message] = [finding.message for finding in found if finding.kind == "unit"]
    assert "have no unit, and count as s" in message
    assert "takes 2990 s; expected a unit: if they are in another unit" in message


def test_times_that_are_none_are_refused_without_a_word_on_their_unit() -> None:
    broken = replace(timed(np.array([0.0, np.nan, 2.0])), clock_unit="")
    the_one(examine([broken]), "time", "refused")


@pytest.mark.parametrize(
    ("header", "unit"), [("time", ""), ("time [ms]", "ms"), ("time_ms", "ms")]
)
def test_unit_of_the_times_is_known_by_the_header(tmp_path: Path, header: str, unit: str) -> None:
    (tmp_path / "a.csv").write_text(f"{header},u\n0,1\n10,2\n", encoding="utf-8")
    assert read_record(str(tmp_path / "a.csv")).clock_unit == unit
