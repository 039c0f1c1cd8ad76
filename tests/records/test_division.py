"""Parts of prepared pieces: no sample is scored twice, no input lies in two of them."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from slide_fmu.core.signals import Trajectory
from slide_fmu.record_files.record import RecordError
from slide_fmu.records.division import Block, Split, Splitting, split_pieces
from slide_fmu.records.preparation import Piece
from tests.refusals import refused

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
    with refused(RecordError, "expected at least 151", "150 samples to"):
        split_pieces(noise(1000), Splitting(lead=151))
    with refused(RecordError, "0 samples to", "train has"):
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
    with refused(RecordError, "expected at least one", "2 records of"):
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


def parts_of_numbers(split: Split, numbers: np.ndarray) -> list[set[int]]:
    """Return the numbers of the inputs that each part scores, where there is one piece."""
    return [
        set(np.concatenate([numbers[b.scored : b.stop] for b in blocks]).tolist())
        for blocks in parts_of(split)
    ]


@pytest.mark.parametrize("times", [1, 3, 20])
def test_inputs_that_come_again_are_in_the_part_in_which_they_came_first(times: int) -> None:
    numbers = np.tile(np.arange(1000), times)
    split = split_pieces(noise(1000 * times), Splitting(lead=20), numbers)
    train, validation, test = parts_of_numbers(split, numbers)
    assert validation == set(range(700, 850))
    assert test == set(range(850, 1000))
    # nothing that still answers what is tested is learnt from
    assert min(train) == 20
    assert max(train) == 699
    assert [block.scored for block in split["train"]] == [20 + 1000 * k for k in range(times)]
    assert all(block.start % 1000 == 0 for block in split["train"])


def test_samples_count_as_often_as_their_inputs_come_again() -> None:
    """The first wave comes seven times, three others once."""
    numbers = np.concatenate([np.arange(100)] * 7 + [np.arange(100, 400)])
    found = parts_of_numbers(split_pieces(noise(1000), Splitting(0), numbers), numbers)
    assert [len(part) for part in found] == [100, 150, 150]


def test_few_samples_amid_another_part_belong_to_it() -> None:
    numbers = np.arange(1000)
    numbers[[900, 901, 902]] = [3, 4, 5]  # by chance
    split = split_pieces(noise(1000), Splitting(lead=0), numbers)
    assert [(block.piece, block.stop) for block in split["test"]] == [(0, 1000)]


def test_each_record_leaves_inputs_of_another_record_in_their_part() -> None:
    pieces = noise(1000, 1000)
    numbers = np.concatenate([np.arange(1000), np.arange(500, 1500)])
    split = split_pieces(pieces, Splitting(lead=0, by="each"), numbers)
    found = [
        {int(numbers[1000 * b.piece + k]) for b in blocks for k in range(b.scored, b.stop)}
        for blocks in parts_of(split)
    ]
    assert all(not one & other for one, other in combinations(found, 2))
    assert [block.piece for block in split["test"]] == [0, 1, 1]


def test_record_that_adds_two_samples_to_another_one_is_divided_with_it() -> None:
    numbers = np.concatenate([np.arange(1000), np.arange(1002)])
    split = split_pieces(noise(1000, 1002), Splitting(lead=0, by="each"), numbers)
    assert [block.stop - block.scored for block in split["test"]] == [150, 152]


def test_records_of_the_same_inputs_are_in_one_part() -> None:
    drives = [0, 1, 0, 2, 3, 1]
    numbers = np.concatenate([100 * drive + np.arange(100) for drive in drives])
    split = split_pieces(noise(*[100] * 6), Splitting(lead=10, by="record"), numbers)
    assert [{b.piece for b in blocks} for blocks in parts_of(split)] == [{0, 2, 1, 5}, {3}, {4}]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"shares": {"train": 0.5, "validation": 0.2, "test": 0.2}}, "add to 1"),
        ({"shares": {"train": 0.0, "validation": 0.5, "test": 0.5}}, "the first of them positive"),
        ({"lead": -1}, "lead = -1; expected at least 0"),
    ],
)
def test_splitting_that_makes_no_sense_is_refused(arguments: dict, message: str) -> None:
    with pytest.raises(RecordError, match=message):
        Splitting(**{"lead": 10, **arguments})
