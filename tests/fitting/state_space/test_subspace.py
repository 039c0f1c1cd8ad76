"""Subspaces: known systems are found again in what the past says about the future."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.signal

from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.state_space import subspace
from slide_fmu.fitting.state_space.subspace import ROWS, subspace_of

EXACT = 3e-5
"""Of poles from sums of products, whose rounding errors are squared, with a ridge."""
NOISY = 3e-3
"""Of poles with one per cent of noise in 20 000 samples."""


def system(n: int, p: int, q: int, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A, B and C of oscillations, and of one real pole if n is odd."""
    rng = np.random.default_rng(seed)
    turns = np.linspace(0.3, 2.0, n // 2)
    blocks = [0.9 * np.array([[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]]) for t in turns]
    a = scipy.linalg.block_diag(*blocks, *([[0.7]] * (n % 2)))
    return a, rng.normal(size=(n, q)), rng.normal(size=(p, n))


def records(
    model: tuple[FloatArray, FloatArray, FloatArray], count: int, samples: int, noise: float = 0.0
) -> tuple[list[FloatArray], list[FloatArray]]:
    """White inputs, and what the system answers in trajectories that begin in mid-motion."""
    (a, b, c), rng = model, np.random.default_rng(7)
    inputs, outputs = [], []
    for _ in range(count):
        u, x, y = rng.normal(size=(samples, b.shape[1])), rng.normal(size=len(a)), []
        for value in u:
            x = a @ x + b @ value
            y.append(c @ x)
        inputs.append(u)
        outputs.append(5.0 + np.array(y))
    size = np.concatenate(outputs).std(axis=0)
    return inputs, [y + noise * size * rng.normal(size=y.shape) for y in outputs]


def sorted_poles(a: FloatArray) -> FloatArray:
    return np.sort_complex(np.linalg.eigvals(a).round(9))


@pytest.mark.parametrize(("n", "p", "q"), [(1, 1, 1), (2, 1, 1), (3, 2, 1), (4, 1, 3), (5, 3, 2)])
def test_model_of_the_true_order_has_the_poles(n: int, p: int, q: int) -> None:
    known = system(n, p, q, 1)
    found = subspace_of(*records(known, 5, 1000))
    a, c = found.model(n)
    assert sorted_poles(a) == pytest.approx(sorted_poles(known[0]), abs=EXACT)
    assert c.shape == (p, n)


def unexplained(a: FloatArray, c: FloatArray, u: FloatArray, y: FloatArray) -> float:
    """RMS of what y[k] = C x[k] + D u[k], x[k] = A x[k-1] + B u[k], with the best B and D, misses.

    Relative to the outputs, after 50 samples.
    """
    power, columns = c, [np.kron(u[:, :, None], np.eye(len(c))).reshape(len(u), -1, len(c))]
    effects = np.zeros((len(u), u.shape[1], len(a), len(c)))
    for lag in range(50):
        late = np.concatenate([np.zeros_like(u[:lag]), u[: len(u) - lag]])
        effects += late[:, :, None, None] * power.T
        power = power @ a
    columns.append(effects.reshape(len(u), -1, len(c)))
    rows = np.concatenate(columns, axis=1)[50:].transpose(0, 2, 1)
    flat, wanted = rows.reshape(-1, rows.shape[2]), y[50:].ravel()
    left = wanted - flat @ np.linalg.lstsq(flat, wanted, rcond=1e-6)[0]
    return float(np.linalg.norm(left) / np.linalg.norm(wanted))


def test_noise_of_the_outputs_does_not_shift_poles_and_shows_no_states() -> None:
    known = system(6, 2, 2, 2)
    found = subspace_of(*records(known, 10, 2000, noise=0.01))
    assert found.states_shown == 6
    assert sorted_poles(found.model(6)[0]) == pytest.approx(sorted_poles(known[0]), abs=NOISY)


def test_many_short_trajectories_are_never_joined() -> None:
    """They begin and end anywhere: a column across an end would see a jump."""
    known = system(4, 1, 1, 3)
    inputs, outputs = records(known, 100, 40)
    found = subspace_of(inputs, outputs)
    assert sorted_poles(found.model(4)[0]) == pytest.approx(sorted_poles(known[0]), abs=EXACT)
    joined = subspace_of([np.concatenate(inputs)], [np.concatenate(outputs)])
    far = np.abs(sorted_poles(joined.model(4)[0]) - sorted_poles(known[0])).max()
    assert far > 100 * EXACT


def test_stretches_without_all_outputs_are_left_out() -> None:
    known = system(4, 2, 1, 3)
    inputs, outputs = records(known, 4, 900)
    for y in outputs:
        y[300:310, 0], y[500] = np.nan, np.nan
    found = subspace_of(inputs, outputs)
    assert sorted_poles(found.model(4)[0]) == pytest.approx(sorted_poles(known[0]), abs=EXACT)
    for y in outputs:
        y[::3] = np.nan
    with pytest.raises(ValueError, match=r"0 stretches of .* have all outputs; expected more"):
        subspace_of(inputs, outputs)


@pytest.mark.parametrize("edge", [0.1, 0.2, 0.4])
def test_inputs_of_a_narrow_band_show_few_states_of_a_noisy_oscillation(edge: float) -> None:
    rng, passes = np.random.default_rng(5), scipy.signal.butter(6, edge, output="sos")
    pole = np.exp((-2 + 5j) * 0.1)
    inputs = [scipy.signal.sosfilt(passes, rng.normal(size=(800, 1)), axis=0) for _ in range(4)]
    denominator = [1.0, -2 * pole.real, abs(pole) ** 2]
    clean = [scipy.signal.lfilter([1.0], denominator, u, axis=0) for u in inputs]
    size = np.concatenate(clean).std()
    outputs = [y / size + 0.1 * rng.normal(size=y.shape) for y in clean]
    found = subspace_of(inputs, outputs)
    assert found.states_shown <= 2
    both = np.sort_complex([pole, pole.conjugate()])
    assert sorted_poles(found.model(2)[0]) == pytest.approx(both, abs=0.05)


def test_order_that_no_subspace_shows_is_refused() -> None:
    found = subspace_of(*records(system(2, 1, 1, 0), 2, 60))
    most = found.highest_order
    assert len(found.model(most)[0]) == most
    message = rf"network.order = {most + 1}; expected at most {most} for 1 outputs over .*: lower"
    with pytest.raises(ValueError, match=message):
        found.model(most + 1)


def test_sums_of_long_records_take_some_of_their_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    known = system(4, 1, 1, 3)
    monkeypatch.setattr(subspace, "COLUMNS", ROWS)
    found = subspace_of(*records(known, 2, 3000))
    assert sorted_poles(found.model(4)[0]) == pytest.approx(sorted_poles(known[0]), abs=EXACT)


def test_delays_are_shown_to_their_end() -> None:
    """An output at the samples 0 to 4 after an input takes five states, besides an oscillation."""
    rng, pole = np.random.default_rng(4), 0.8 * np.exp(0.7j)
    inputs, outputs = [], []
    for _ in range(4):
        u = rng.normal(size=(900, 2))
        late = scipy.signal.lfilter([1.0, 0.9, -0.7, 0.6, -0.5], [1.0], u[:, 0])
        denominator = [1.0, -2 * pole.real, abs(pole) ** 2]
        swinging = scipy.signal.lfilter([0.3, 0.2], denominator, u[:, 1])
        inputs.append(u)
        outputs.append(np.stack([late, swinging], axis=1))
    found = subspace_of(inputs, outputs)
    a, c = found.model(7)
    assert (a.shape, c.shape) == ((7, 7), (2, 7))
    assert unexplained(a, c, inputs[0], outputs[0]) < 1e-4
    assert unexplained(*found.model(6), inputs[0], outputs[0]) > 0.01
