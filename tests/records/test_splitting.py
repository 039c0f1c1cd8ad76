"""Parts of prepared pieces: no sample is scored twice, no period lies in two of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from slide_fmu.core.signals import Trajectory
from slide_fmu.records.blocks import Block, Split, Splitting
from slide_fmu.records.record import RecordError
from slide_fmu.records.preparation import Piece
from slide_fmu.records.splitting import split_pieces
from tests.records.samples import multisine

PARTS = ("train", "validation", "test")


def piece(inputs: np.ndarray, record: int = 0) -> Piece:
    outputs = np.arange(len(inputs) + 1.0)[:, None]
    return Piece(Trajectory(0.1, inputs.reshape(-1, 1), outputs), record, 0.0)


def noise(*lengths: int) -> list[Piece]:
    rng = np.random.default_rng(0)
    return [piece(rng.normal(size=length), index) for index, length in enumerate(lengths)]


def parts_of(split: Split) -> tuple[tuple[Block, ...], ...]:
    return tuple(split.values())


def scored(blocks: tuple[Block, ...]) -> set[tuple[int, int]]:
    return {(block.piece, k) for block in blocks for k in range(block.scored, block.stop)}


def test_blocks_of_one_record_follow_each_other_with_their_lead_in_the_part_before() -> None:
    split = split_pieces(noise(1000), Splitting(lead=50))
    assert split["train"] == (Block(0, 0, 50, 700),)
    assert split["validation"] == (Block(0, 650, 700, 850),)
    assert split["test"] == (Block(0, 800, 850, 1000),)


def test_each_record_is_cut_by_itself_in_all_its_pieces() -> None:
    pieces = [*noise(1000, 400), piece(np.arange(600.0), 1)]
    split = split_pieces(pieces, Splitting(lead=10, by="each"))
    assert split["train"] == (Block(0, 0, 10, 700), Block(1, 0, 10, 400), Block(2, 0, 10, 300))
    assert split["validation"] == (Block(0, 690, 700, 850), Block(2, 290, 300, 450))
    assert split["test"] == (Block(0, 840, 850, 1000), Block(2, 440, 450, 600))


@given(
    st.lists(st.integers(1, 300), min_size=1, max_size=5),
    st.integers(0, 20),
    st.sampled_from([(0.7, 0.15, 0.15), (0.5, 0.5, 0.0), (1.0, 0.0, 0.0)]),
)
def test_blocks_score_every_sample_once_at_most(
    lengths: list[int], lead: int, shares: tuple[float, float, float]
) -> None:
    try:
        split = split_pieces(
            noise(*lengths), Splitting(lead, shares=dict(zip(PARTS, shares, strict=True)))
        )
    except RecordError:
        assume(False)
    parts = [scored(blocks) for blocks in parts_of(split)]
    together = set().union(*parts)
    assert len(together) == sum(len(part) for part in parts)
    behind_leads = {(i, k) for i, n in enumerate(lengths) for k in range(lead, n)}
    assert together == behind_leads
    for blocks in parts_of(split):
        assert all(0 <= b.start == b.scored - lead < b.stop <= lengths[b.piece] for b in blocks)


def test_block_is_cut_with_the_output_that_its_first_input_starts_from() -> None:
    pieces = noise(1000)
    trajectory = Block(0, 650, 700, 850).cut(pieces)
    assert np.array_equal(trajectory.inputs, pieces[0].trajectory.inputs[650:850])
    assert trajectory.outputs[:, 0].tolist() == list(range(650, 851))


def test_part_that_is_shorter_than_its_lead_is_refused_with_the_figures() -> None:
    assert split_pieces(noise(1000), Splitting(lead=150))
    with pytest.raises(
        RecordError,
        match=r"validation has 150 samples to score, of 1000 in 1 pieces, behind leads of 151; "
        r"expected at least 151",
    ):
        split_pieces(noise(1000), Splitting(lead=151))
    with pytest.raises(RecordError, match="train has 0 samples to score, of 10"):
        split_pieces(noise(10), Splitting(lead=10))


def test_whole_records_are_shared_out_with_all_their_pieces() -> None:
    rng = np.random.default_rng(1)
    pieces = [piece(rng.normal(size=100), record) for record in (0, 0, 1, 2, 2, 3, 4, 5, 6, 7)]
    split = split_pieces(pieces, Splitting(lead=10, by="record"))
    assert [{b.piece for b in blocks} for blocks in parts_of(split)] == [
        set(range(7)),
        {7},
        {8, 9},
    ]
    assert all((b.start, b.scored, b.stop) == (0, 10, 100) for b in split["train"])


@given(st.lists(st.integers(30, 3000), min_size=3, max_size=8))
def test_every_part_has_a_record_and_every_record_a_part(lengths: list[int]) -> None:
    split = split_pieces(noise(*lengths), Splitting(lead=10, by="record"))
    found = [block.piece for blocks in parts_of(split) for block in blocks]
    assert found == list(range(len(lengths)))
    assert all(parts_of(split))


def test_fewer_records_than_parts_are_refused() -> None:
    with pytest.raises(
        RecordError, match="2 records of different inputs for 3 parts; expected at least one"
    ):
        split_pieces(noise(500, 500), Splitting(lead=10, by="record"))
    split = split_pieces(
        noise(500, 500),
        Splitting(lead=10, by="record", shares={"train": 0.5, "validation": 0.5, "test": 0.0}),
    )
    assert [len(blocks) for blocks in parts_of(split)] == [1, 1, 0]
    split = split_pieces(
        noise(500, 500),
        Splitting(lead=10, by="record", shares={"train": 0.5, "validation": 0.0, "test": 0.5}),
    )
    assert [len(blocks) for blocks in parts_of(split)] == [1, 0, 1]


def periods(order: list[int], period: int = 200) -> np.ndarray:
    rng = np.random.default_rng(2)
    waves = [multisine(period, rng) for _ in range(max(order) + 1)]
    values = np.concatenate([waves[index] for index in order])
    return values + 1e-3 * rng.normal(size=len(values))


def test_periods_that_are_alike_stay_in_one_part() -> None:
    order = [0, 0, 1, 1, 2, 2, 3, 3, 1, 4]
    pieces = [piece(periods(order)[:-1])]  # the last one is not whole
    split = split_pieces(pieces, Splitting(lead=20, by="period", period=200))
    found = [
        {order[k // 200] for block in blocks for k in range(block.scored, block.stop)}
        for blocks in parts_of(split)
    ]
    assert found == [{0, 1}, {2}, {3}]
    assert all(b.scored % 200 in (0, 20) and b.stop % 200 == 0 for b in split["train"])
    assert split["train"][0].scored == 20


def test_period_that_begins_elsewhere_in_another_piece_is_known_again() -> None:
    values = periods([0, 0, 1, 1, 2, 2, 0])
    pieces = [piece(values[:1200]), piece(np.roll(values[1200:], 70), 1)]
    split = split_pieces(pieces, Splitting(lead=20, by="period", period=200))
    assert [(b.piece, b.scored, b.stop) for b in split["train"]] == [(0, 20, 400), (1, 20, 200)]
    assert [(b.piece, b.scored, b.stop) for b in split["validation"]] == [(0, 400, 800)]
    assert [(b.piece, b.scored, b.stop) for b in split["test"]] == [(0, 800, 1200)]


@pytest.mark.parametrize("before", [0, 30, 100, 170])
def test_periods_of_a_record_that_begins_in_the_middle_of_one_are_cut_where_they_change(
    before: int,
) -> None:
    """Samples are numbered by their wave and place in it; none is scored in two parts."""
    order = [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    values = periods(order)[before:]
    names = (1000 * np.repeat(order, 200) + np.tile(np.arange(200), len(order)))[before:]
    split = split_pieces([piece(values)], Splitting(lead=20, by="period", period=200))
    found = [
        {int(names[k]) for block in blocks for k in range(block.scored, block.stop)}
        for blocks in parts_of(split)
    ]
    for one, other in ((0, 1), (0, 2), (1, 2)):
        assert len(found[one] & found[other]) <= 2
    assert sum(len(part) for part in found) > 900


def test_rest_before_periods_is_no_period() -> None:
    order = [0, 0, 1, 1, 2, 2]
    values = np.concatenate([np.zeros(130), periods(order)])
    split = split_pieces([piece(values)], Splitting(lead=20, by="period", period=200))
    [train], [validation], [test] = parts_of(split)
    assert abs(train.stop - 530) <= 1
    assert abs(validation.stop - 930) <= 1
    assert test.stop == 1330


def test_one_period_that_comes_again_and_again_is_refused() -> None:
    pieces = [piece(periods([0] * 10))]
    with pytest.raises(RecordError, match="1 different periods of 200 samples for 3 parts"):
        split_pieces(pieces, Splitting(lead=20, by="period", period=200))


def test_record_shorter_than_a_period_is_refused() -> None:
    with pytest.raises(RecordError, match="train has 0 samples"):
        split_pieces(noise(100), Splitting(lead=10, by="period", period=200))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"shares": {"train": 0.5, "validation": 0.2, "test": 0.2}}, "add to 1"),
        ({"shares": {"train": 0.0, "validation": 0.5, "test": 0.5}}, "the first of them positive"),
        ({"lead": -1}, "a lead of at least 0"),
        ({"by": "period"}, "a period of at least 1 sample"),
        ({"period": 10}, "with by = 'period' only"),
        ({"by": "period", "period": 0}, "a period of at least 1 sample"),
    ],
)
def test_splitting_that_makes_no_sense_is_refused(arguments: dict, message: str) -> None:
    with pytest.raises(RecordError, match=message):
        Splitting(**{"lead": 10, **arguments})
