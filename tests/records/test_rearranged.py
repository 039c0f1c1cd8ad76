"""Inputs that are made of a record's stay what the machine may see."""

from __future__ import annotations

import numpy as np

from slide_fmu.records.rearranged import rearranged
from tests.records.bench import smooth

WINDOW = 200


def test_inputs_stay_within_the_ranges_and_are_as_smooth() -> None:
    blocks = [np.stack([smooth(3000, 1), 2 + smooth(3000, 2)], axis=1), np.zeros((50, 2))]
    made = rearranged(blocks, WINDOW, 20_000)
    whole = np.concatenate(blocks)
    assert len(made) >= 20_000
    assert (made >= whole.min(axis=0) - 1e-12).all()
    assert (made <= whole.max(axis=0) + 1e-12).all()
    fastest = np.abs(np.diff(blocks[0], axis=0)).max(axis=0)
    room = (whole.max(axis=0) - whole.min(axis=0)) / (0.05 * WINDOW)
    assert (np.abs(np.diff(made, axis=0)).max(axis=0) <= fastest + room + 1e-9).all()


def test_levels_are_others_and_seeds_make_others() -> None:
    block = 0.1 * smooth(3000, 1)[:, None]
    block[0], block[-1] = -1.0, 1.0
    made = rearranged([block], WINDOW, 20_000)
    assert np.abs(made.reshape(-1)[:20_000].reshape(-1, 100).mean(axis=1)).max() > 0.5
    assert np.array_equal(made, rearranged([block], WINDOW, 20_000))
    assert not np.array_equal(made[:500], rearranged([block], WINDOW, 20_000, seed=1)[:500])
