"""Records of one drive signal are found, wherever they begin, and stay in one part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slide_fmu.core.signals import Trajectory
from slide_fmu.records.alike import Likeness, alike_inputs, groups_of_records
from slide_fmu.records.blocks import Splitting
from slide_fmu.records.examination import examine
from slide_fmu.records.preparation import Piece
from slide_fmu.records.splitting import split_pieces
from tests.records.samples import record, the_one

RNG = np.random.default_rng(0)
DRIVE, OTHER, THIRD, FOURTH = RNG.normal(size=(4, 4000))


def column(*signals: np.ndarray) -> list[np.ndarray]:
    return [signal[:, None] for signal in signals]


def test_records_that_share_a_stretch_at_another_offset_are_alike() -> None:
    noisy = DRIVE[1000:] + 0.05 * RNG.normal(size=3000)
    found = alike_inputs(column(DRIVE, OTHER, noisy))
    assert found == [Likeness((0, 2), 1000, 3000)]
    assert alike_inputs(column(noisy, DRIVE)) == [Likeness((0, 1), -1000, 3000)]
    assert not found[0].together([4000, 4000, 3000])


def test_records_that_share_little_or_rest_are_not_alike() -> None:
    partly = np.concatenate([DRIVE[3200:], THIRD[:3200]])
    rest = np.zeros(500)
    assert alike_inputs(column(DRIVE, OTHER, partly, rest, rest)) == []
    assert alike_inputs(column(DRIVE, 0.5 * DRIVE)) == []  # another amplitude is another input


def test_inputs_are_alike_only_all_together() -> None:
    one, other = np.stack([DRIVE, OTHER], axis=1), np.stack([DRIVE, THIRD], axis=1)
    assert alike_inputs([one, other]) == []
    assert alike_inputs([one, one[:3990]])[0].together([4000, 3990])


def test_groups_join_what_is_alike_in_several_steps() -> None:
    chain = [Likeness((0, 3), 0, 10), Likeness((2, 3), 0, 10)]
    assert groups_of_records(chain, 5) == [0, 1, 0, 0, 2]


def test_records_of_one_drive_signal_are_in_one_part() -> None:
    rng = np.random.default_rng(1)
    runs = [DRIVE, OTHER, DRIVE, THIRD, FOURTH, OTHER]
    pieces = [
        Piece(
            Trajectory(0.1, (u + 0.01 * rng.normal(size=4000))[:, None], np.zeros((4001, 1))), n, 0
        )
        for n, u in enumerate(runs)
    ]
    split = split_pieces(pieces, Splitting(lead=10, by="record"))
    parts = [{block.piece for block in blocks} for blocks in split.values()]
    assert parts == [{0, 2, 1, 5}, {3}, {4}]


def test_records_of_one_drive_signal_are_remarked_by_their_names() -> None:
    records = [
        record({"u": u, "y": v}) for u, v in ((DRIVE, OTHER), (DRIVE, THIRD), (FOURTH, OTHER))
    ]
    records = [replace(one, path=f"{n}.csv") for n, one in enumerate(records)]
    message = the_one(examine(records, ["u"], ["y"]), "alike", "remarked")
    assert "0.csv" in message
    assert "those of 1.csv" in message
    assert "2.csv" not in message
    assert 'data.by = "record"' in message
