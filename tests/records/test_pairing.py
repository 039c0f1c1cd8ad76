"""Which output answers an input is told from records of known systems."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, cont2discrete, dlsim, lfilter, sosfilt

from slide_fmu.record_files.record import RecordError
from slide_fmu.records.pairing import Answer, answer_of, check_pairing, is_moved
from slide_fmu.records.preparation import Preparation
from tests.records.samples import record
from tests.refusals import refused

N = 5000
H = 0.01


def drawn(kind: str) -> np.ndarray:
    rng = np.random.default_rng(0)
    if kind == "steps":
        return np.repeat(rng.normal(size=N // 20), 20)
    noise = rng.normal(size=N)
    return sosfilt(butter(3, 0.2, output="sos"), noise) if kind == "low-pass noise" else noise


def response(u: np.ndarray, method: str, noise: float) -> np.ndarray:
    """An oscillator of 60 rad/s; its input is held ("zoh") or moves linearly ("foh")."""
    a, b = np.array([[0.0, 1], [-3600, -12]]), np.array([[0.0], [3600]])
    *system, _ = cont2discrete((a, b, np.array([[1.0, 0]]), np.zeros((1, 1))), H, method)
    _, y, _ = dlsim((*system, H), u)
    return y[:, 0] + noise * y.std() * np.random.default_rng(1).normal(size=N)


@pytest.mark.parametrize("kind", ["noise", "low-pass noise", "steps"])
@pytest.mark.parametrize("noise", [1e-6, 1e-3])
@pytest.mark.parametrize(("method", "pairing"), [("zoh", "later"), ("foh", "same")])
def test_pairing_is_told_by_the_hold(kind: str, noise: float, method: str, pairing: str) -> None:
    u = drawn(kind)
    answer = answer_of(u[:, None], response(u, method, noise)[:, None])
    assert answer is not None
    assert answer.pairing == pairing


def test_noise_alone_tells_no_pairing() -> None:
    rng = np.random.default_rng(2)
    answer = answer_of(rng.normal(size=(N, 2)), rng.normal(size=(N, 2)))
    assert answer is not None
    assert answer.pairing is None
    assert answer_of(rng.normal(size=(50, 2)), rng.normal(size=(50, 2))) is None


@pytest.mark.parametrize(
    ("evidence", "pairing"),
    [((0, 9, 90), "same"), ((0, 5, 90), None), ((0, 3, 90), "later"), ((0, 3, 7), None)],
)
def test_weak_evidence_for_the_same_sample_leaves_the_pairing_open(
    evidence: tuple[float, float, float], pairing: str | None
) -> None:
    assert Answer(*evidence).pairing == pairing


def oscillator(method: str) -> dict[str, np.ndarray]:
    u = drawn("noise")
    return {"u": u, "y": response(u, method, 1e-3)}


@pytest.mark.parametrize(
    ("method", "right", "wrong"), [("zoh", "later", "same"), ("foh", "same", "later")]
)
def test_wrong_pairing_is_remarked_and_the_right_one_named(
    method: str, right: str, wrong: str
) -> None:
    found = record(oscillator(method))
    assert check_pairing([found], Preparation(("u",), ("y",), pairing=right)) == ()
    (finding,) = check_pairing([found], Preparation(("u",), ("y",), pairing=wrong))
    assert (finding.kind, finding.severity) == ("pairing", "remarked")
    assert f"use the pairing {right!r}" in finding.message


def test_outputs_that_come_before_their_inputs_are_remarked() -> None:
    columns = oscillator("zoh")
    early = record({"u": columns["u"][:-2], "y": columns["y"][2:]})
    for pairing in ("same", "later"):
        (finding,) = check_pairing([early], Preparation(("u",), ("y",), pairing=pairing))
        assert "stamped too early" in finding.message


def test_second_input_that_acts_at_once_tells_the_pairing() -> None:
    rng = np.random.default_rng(3)
    columns = oscillator("zoh") | {"v": rng.normal(size=N)}
    columns["y"] = columns["y"] + 0.1 * columns["v"]
    assert check_pairing([record(columns)], Preparation(("u",), ("y",), pairing="later")) == ()
    (finding,) = check_pairing([record(columns)], Preparation(("u", "v"), ("y",), pairing="later"))
    assert "use the pairing 'same'" in finding.message


def test_missing_column_is_refused() -> None:
    with refused(RecordError, "no columns"):
        check_pairing([record(oscillator("zoh"))], Preparation(("u",), ("x",)))


def test_rounding_of_a_record_without_noise_is_no_evidence() -> None:
    assert not Answer(21.7, 5e15, 4e15).foresees
    assert Answer(21.7, 500.0, 400.0).foresees
    assert Answer(3.0, 21.7, 5e15).pairing == "later"


def test_record_of_held_steps_without_noise_raises_no_alarm() -> None:
    u = np.repeat(np.random.default_rng(5).integers(0, 2, N // 5) * 2.0 - 1, 5)
    found = record({"u": u, "y": response(u, "foh", 1e-2)})
    assert check_pairing([found], Preparation(("u",), ("y",), pairing="same")) == ()


def test_output_that_no_input_moves_is_remarked() -> None:
    rng = np.random.default_rng(0)
    force = rng.normal(size=(4000, 1))
    own = lfilter([1.0], [1, -1.8, 0.9], rng.normal(size=4000))
    driven = lfilter([1.0], [1, -1.8, 0.9], force[:, 0])
    assert is_moved(force, own) is False
    assert is_moved(force, driven + 0.1 * own) is True
    assert is_moved(force, driven**3) is True
    assert is_moved(force[:50], driven[:50]) is None
