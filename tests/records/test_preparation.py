"""Trajectories from records: even, cut at gaps, paired, and right between the samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slide_fmu.record_files.record import RecordError
from slide_fmu.records.filling import filled
from slide_fmu.records.preparation import Preparation, prepared
from slide_fmu.records.resampling import EDGE, moves_smoothly
from tests.records.samples import STEP, record
from tests.refusals import refused

N = 2000
RNG = np.random.default_rng(0)
U, Y = RNG.normal(size=N), RNG.normal(size=N)
ONE = Preparation(("u",), ("y",))


def test_even_record_comes_out_as_it_is() -> None:
    done = prepared([record({"u": U, "y": Y})], ONE)
    (piece,) = done.pieces
    assert done.remarks == ()
    assert (piece.record, piece.start, piece.trajectory.step) == (0, 0.0, STEP)
    assert np.array_equal(piece.trajectory.outputs[:, 0], Y)


def test_channels_keep_their_order() -> None:
    both = {"a": U, "b": Y, "c": U + Y}
    (piece,) = prepared([record(both)], Preparation(("c", "a"), ("b",))).pieces
    assert np.array_equal(piece.trajectory.inputs, np.stack([U + Y, U], axis=1)[1:])


def test_pairing_same_gives_outputs_the_input_of_their_own_sample() -> None:
    trajectory = prepared([record({"u": U, "y": 2 * U})], ONE).pieces[0].trajectory
    assert np.array_equal(trajectory.outputs[1:], 2 * trajectory.inputs)


def test_pairing_later_gives_outputs_the_input_of_the_sample_before() -> None:
    late = Preparation(("u",), ("y",), pairing="later")
    y = np.concatenate([[0.0], 2 * U[:-1]])
    trajectory = prepared([record({"u": U, "y": y})], late).pieces[0].trajectory
    assert np.array_equal(trajectory.outputs[1:], 2 * trajectory.inputs)


def test_gaps_and_empty_values_cut_a_record() -> None:
    kept = np.delete(np.arange(N), np.r_[500:520])
    u, y = U[kept].copy(), Y[kept].copy()
    u[100], u[1000:1010], y[1200:1202] = np.nan, np.inf, (np.nan, np.inf)
    done = prepared([record({"u": u, "y": y}, STEP * kept)], ONE)
    outputs = [piece.trajectory.outputs[:, 0] for piece in done.pieces]
    for found, rows in zip(
        outputs, ([0, 100], [101, 500], [500, 1000], [1010, 1980]), strict=True
    ):
        wanted = np.where(np.isfinite(y), y, np.nan)[slice(*rows)]
        assert np.array_equal(found, wanted, equal_nan=True)
    starts = STEP * kept[[0, 101, 500, 1010]]
    assert [piece.start for piece in done.pieces] == pytest.approx(starts)
    assert "cut into 4 pieces" in done.remarks[0]


def test_unused_column_does_not_cut() -> None:
    holes = np.where(np.arange(N) % 7 == 0, np.nan, 1.0)
    assert len(prepared([record({"u": U, "y": Y, "z": holes})], ONE).pieces) == 1


def test_short_pieces_are_left_out_and_reported() -> None:
    u = U.copy()
    u[[10, 1000]] = np.nan
    done = prepared([record({"u": u, "y": Y})], Preparation(("u",), ("y",), least=500))
    assert [len(piece.trajectory.outputs) for piece in done.pieces] == [989, 999]
    assert "3 pieces" in done.remarks[0]
    assert "1 of them have fewer than 500 samples" in done.remarks[0]
    with refused(RecordError, "1000 samples of", "piece without"):
        prepared([record({"u": u, "y": Y})], Preparation(("u",), ("y",), least=1000))


def wave(time: np.ndarray) -> np.ndarray:
    return np.sin(2 * np.pi * 20 * time) + np.cos(2 * np.pi * 7 * time)


def test_jitter_is_removed_by_the_true_times() -> None:
    time = STEP * (np.arange(N) + 0.2 * np.random.default_rng(1).uniform(-1, 1, N))
    done = prepared(
        [record({"u": wave(time), "y": wave(time)}, time)], Preparation(("u",), ("y",), step=STEP)
    )
    (piece,) = done.pieces
    true = wave(piece.start + piece.trajectory.time)
    assert np.abs(piece.trajectory.outputs[:, 0] - true).max() < 1e-4  # cubic
    assert np.abs(piece.trajectory.inputs[:, 0] - true[1:]).max() < 1e-4  # cubic, too
    assert np.abs(wave(time)[: len(true)] - true).max() > 0.02  # as measured
    assert "by cubic splines for outputs and smooth inputs, and straight lines" in done.remarks[0]


@pytest.mark.parametrize("fill", [True, False])
def test_input_between_corners_goes_straight(fill: bool) -> None:
    """Splines would overshoot behind each corner; of a smooth input, lines cut off the tops."""
    corners = np.random.default_rng(3).normal(size=N // 10 + 2)
    rng, even = np.random.default_rng(1), STEP * np.arange(N)
    lost = np.flatnonzero(rng.random(N - 20) < 0.1) + 10
    lost = lost[lost % 10 != 0]

    def ramps(time: np.ndarray) -> np.ndarray:
        return np.interp(time, 10 * STEP * np.arange(len(corners)), corners)

    for course, moves, off in ((ramps, False, 1e-9), (wave, True, 1e-3)):
        time = np.delete(even, lost) if fill else even + STEP * rng.uniform(0, 0.2, N)
        assert moves_smoothly(time, course(time)) == moves
        one = record({"u": course(time), "y": wave(time)}, time)
        if fill:
            one = filled(replace(one, fill=3), ["u"], ["y"], "first_order")
            made = one.columns["u"] - course(one.time)
            at = one.time > 0.0
        else:
            (piece,) = prepared([one], Preparation(("u",), ("y",), step=STEP)).pieces
            times = piece.start + piece.trajectory.time[1:]
            made = piece.trajectory.inputs[:, 0] - course(times)
            at = np.abs(times / (10 * STEP) % 1 - 0.5) < 0.35  # corners lie between samples
        assert np.abs(made[at]).max() < off


def test_held_input_keeps_its_steps_when_jitter_is_removed() -> None:
    time = STEP * (np.arange(N) + 0.1 * np.random.default_rng(1).uniform(-1, 1, N))
    held = Preparation(("u",), ("y",), step=STEP, hold="zero_order", pairing="later")
    levels = np.repeat(U[: N // 20], 20)
    (piece,) = prepared([record({"u": levels, "y": Y}, time)], held).pieces
    inputs = piece.trajectory.inputs[:, 0]
    inside = (
        np.arange(len(inputs)) % 20 != 19
    )  # the last of each level may have a part of the next
    assert np.abs(inputs - levels[: len(inputs)])[inside].max() < 0.2 * np.ptp(U)
    assert np.median(np.abs(inputs - levels[: len(inputs)])) < 1e-12


@given(st.integers(2, 12))
def test_held_input_has_the_same_integral_at_a_longer_step(ratio: int) -> None:
    held = Preparation(("u",), ("y",), step=ratio * STEP, hold="zero_order", pairing="later")
    (piece,) = prepared([record({"u": U, "y": Y})], held).pieces
    first = EDGE * ratio
    count = len(piece.trajectory.inputs)
    means = U[first : first + count * ratio].reshape(-1, ratio).mean(axis=1)
    assert piece.trajectory.inputs[:, 0] == pytest.approx(means, abs=1e-9)
    assert piece.start == pytest.approx(first * STEP)


@pytest.mark.parametrize("step", [2 * STEP, 1.5 * STEP, 5 * STEP, np.pi * STEP])
@pytest.mark.parametrize("jitter", [0.0, 0.05])
def test_longer_step_keeps_slow_waves_and_removes_fast_ones(step: float, jitter: float) -> None:
    time = STEP * (np.arange(N) + jitter * np.random.default_rng(2).uniform(-1, 1, N))
    fast = np.sin(2 * np.pi * 420 * time)  # beyond the limit of all these steps
    columns = {"u": wave(time), "y": wave(time) + fast}
    done = prepared([record(columns, time)], Preparation(("u",), ("y",), step=step))
    (piece,) = done.pieces
    true = wave(piece.start + piece.trajectory.time)
    assert len(true) == pytest.approx(N * STEP / step - 2 * EDGE, abs=2)
    assert np.abs(piece.trajectory.inputs[:, 0] - true[1:]).max() < 0.02
    assert np.abs(piece.trajectory.outputs[:, 0] - true).max() < (0.02 if jitter == 0 else 0.1)
    assert "the polyphase filter" in done.remarks[0]
    assert "without 10 samples at either end" in done.remarks[0]


def test_rational_ratio_is_named() -> None:
    (remark,) = prepared(
        [record({"u": U, "y": Y})], Preparation(("u",), ("y",), step=0.0025)
    ).remarks
    assert "resampled from 0.001 s to 0.0025 s by the polyphase filter 2/5 of scipy" in remark


def test_shorter_step_is_interpolated_and_said_so() -> None:
    time = STEP * np.arange(N)
    done = prepared(
        [record({"u": wave(time), "y": wave(time)})], Preparation(("u",), ("y",), step=STEP / 4)
    )
    (piece,) = done.pieces
    assert len(piece.trajectory.outputs) == 4 * (N - 1) + 1
    assert np.abs(piece.trajectory.outputs[:, 0] - wave(piece.trajectory.time)).max() < 1e-4
    assert "nothing is known between the measured samples" in done.remarks[0]


def test_records_of_several_steps_get_that_of_the_first() -> None:
    slow = record({"u": U, "y": Y})
    fast = record({"u": U, "y": Y}, 0.5 * STEP * np.arange(N))
    done = prepared([slow, fast], ONE)
    assert [piece.trajectory.step for piece in done.pieces] == [STEP, STEP]
    assert [piece.record for piece in done.pieces] == [0, 1]
    assert len(done.pieces[1].trajectory.outputs) == N // 2 - 2 * EDGE
    (remark,) = done.remarks
    assert "polyphase filter 1/2" in remark


def test_step_of_rounded_times_has_few_digits() -> None:
    time = np.round(STEP * np.arange(N) + 1e-7 * RNG.uniform(size=N), 7)
    assert prepared([record({"u": U, "y": Y}, time)], ONE).pieces[0].trajectory.step == STEP


@pytest.mark.parametrize("fault", ["falls", "repeats"])
def test_time_that_does_not_rise_is_refused(fault: str) -> None:
    time = STEP * np.arange(N)
    time[700] = time[600] if fault == "falls" else time[699]
    with refused(RecordError, "701 (line 702", "sample 701"):
        prepared([record({"u": U, "y": Y}, time)], ONE)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"inputs": ()}, "at least one of each"),
        ({"inputs": ("y",)}, "no column twice"),
        ({"least": 1}, "expected at least 2"),
        ({"step": 0.0}, "positive, finite step"),
    ],
)
def test_preparation_that_makes_no_sense_is_refused(arguments: dict, message: str) -> None:
    with pytest.raises(RecordError, match=message):
        Preparation(**{"inputs": ("u",), "outputs": ("y",), **arguments})
