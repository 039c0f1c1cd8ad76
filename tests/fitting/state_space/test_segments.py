"""Segments score every sample at most once, after a burn-in of its own past."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch
from hypothesis import assume, given
from hypothesis import strategies as st

from slide_fmu.fitting.state_space.segments import Segments, cut_segments
from tests.refusals import refused

LONG = 1000
"""More than any trajectory here has samples."""


def numbered(trajectories: int, samples: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Features and targets that tell their trajectory and sample: LONG t + k."""
    numbers = LONG * torch.arange(trajectories)[:, None] + torch.arange(samples + 1)
    return numbers[:, :-1, None].double(), numbers[:, :, None].double()


@given(st.integers(1, 4), st.integers(1, 60), st.integers(0, 50), st.integers(1, 40))
def test_segments_hold_every_sample_of_a_trajectory_once(
    trajectories: int, samples: int, burn_in: int, scored: int
) -> None:
    assume(burn_in < samples)
    found = cut_segments(*numbered(trajectories, samples), burn_in, scored)
    features, targets = found.features[:, :, 0], found.targets[:, :, 0]
    length = len(targets)
    assert found.burn_in == burn_in
    assert len(features) == burn_in + length
    # consecutive samples of one trajectory, from the burn-in on
    assert torch.equal(features, features[0] + torch.arange(len(features))[:, None])
    assert torch.equal(features[0] // LONG, features[-1] // LONG)
    # targets are those one step after the features
    assert torch.equal(targets, features[burn_in:] + 1)
    # none twice, and nearly all
    assert len(torch.unique(targets)) == targets.numel()
    pieces = found.count // trajectories
    assert found.count == pieces * trajectories
    assert 0 <= (samples - burn_in) - pieces * length < pieces
    assert pieces == 1 or scored / 2 <= length <= 2 * scored


def test_trajectories_without_a_sample_to_score_are_refused() -> None:
    with refused(ValueError, "expected more than the 20", "20 samples", "longer"):
        cut_segments(*numbered(2, 20), 20, 8)
    assert cut_segments(*numbered(2, 21), 20, 8).targets.shape == (1, 2, 1)


def segments(count: int) -> Segments:
    """One segment of each trajectory, each with a weight of its own."""
    whole = cut_segments(*numbered(count, 8), 3, 5)
    return replace(whole, weights=1.0 + torch.arange(count, dtype=torch.float64))


@given(st.integers(1, 20), st.integers(1, 25))
def test_chunks_are_the_whole(count: int, size: int) -> None:
    whole = segments(count)
    chunks = whole.chunks(size)
    assert all(chunk.count <= size and chunk.burn_in == whole.burn_in for chunk in chunks)
    assert torch.equal(torch.cat([chunk.features for chunk in chunks], 1), whole.features)
    assert torch.equal(torch.cat([chunk.targets for chunk in chunks], 1), whole.targets)
    assert torch.equal(torch.cat([chunk.weights for chunk in chunks]), whole.weights)


def test_every_and_chosen_keep_features_targets_and_weights_together() -> None:
    whole = segments(7)
    for part, numbers in (
        (whole.every(3), [0, 3, 6]),
        (whole.chosen(torch.tensor([5, 2])), [5, 2]),
    ):
        assert torch.equal(part.features, whole.features[:, numbers])
        assert torch.equal(part.targets, part.features[3:] + 1)
        assert part.weights.tolist() == [number + 1 for number in numbers]
        assert part.burn_in == 3


@given(st.integers(1, 8), st.integers(1, 6), st.integers(1, 6))
def test_every_stride_covers_all_trajectories(trajectories: int, pieces: int, stride: int) -> None:
    """Where trajectories have as many segments as the stride is long; else evenly spread."""
    whole = cut_segments(*numbered(trajectories, 10 * pieces), 0, 10)
    part = whole.every(stride)
    assert part.count == -(-pieces * trajectories // stride)
    seen = torch.unique(part.features[0] // LONG)
    if pieces >= stride:
        assert len(seen) == trajectories
    assert int(torch.diff(seen, append=seen.new_tensor([trajectories])).max()) <= max(
        1, -(-stride // pieces)
    )


def test_segments_of_a_trajectory_follow_each_other() -> None:
    found = cut_segments(*numbered(3, 43), 3, 10)
    starts = [0, 10, 20, 30]
    assert found.features[0, :, 0].tolist() == [LONG * t + s for t in range(3) for s in starts]
    assert found.weights.tolist() == [1.0] * 12


def test_others_come_after_with_a_factor_on_their_weights() -> None:
    some, others = segments(2), segments(3)
    both = some.and_others(others, 0.1)
    assert torch.equal(both.features, torch.cat([some.features, others.features], 1))
    assert torch.equal(both.targets, torch.cat([some.targets, others.targets], 1))
    assert both.weights.tolist() == pytest.approx([1, 2, 0.1, 0.2, 0.3])
    assert (both.burn_in, both.count) == (3, 5)
    assert some.weights.tolist() == [1, 2]
    assert others.weights.tolist() == [1, 2, 3]


@pytest.mark.parametrize("name", ["initial", "phi"])
def test_others_bring_what_belongs_to_them(name: str) -> None:
    """States before the first feature, and terms of parameters: of both parts, or of neither."""
    some, others = segments(2), segments(3)
    own, foreign = torch.rand(2, 4), torch.rand(3, 4)
    first, second = replace(some, **{name: own}), replace(others, **{name: foreign})
    both = first.and_others(second, 0.1)
    assert torch.equal(getattr(both, name), torch.cat([own, foreign]))
    assert getattr(some.and_others(others, 0.1), name) is None
    for one, other in ((first, others), (some, second)):
        with refused(ValueError, "segments have", "have none", "give them to both"):
            one.and_others(other, 0.1)


def moving(spreads: list[float], samples: int = 30) -> Segments:
    """Two outputs that swing about 0.3 and -2, one segment for each spread."""
    swing = torch.arange(samples, dtype=torch.float64).mul(math.pi).cos()[:, None, None]
    middle = torch.tensor([0.3, -2.0], dtype=torch.float64)
    targets = middle + swing * torch.tensor(spreads, dtype=torch.float64)[:, None]
    count = len(spreads)
    weights = 1.0 + torch.arange(count, dtype=torch.float64)
    return Segments(torch.zeros(samples + 4, count, 3).double(), targets, weights)


def test_evened_out_segments_weigh_the_less_the_more_they_move() -> None:
    """Relative to the mean square of all: sqrt(2) at rest, 1 at it, far above it as 1 / RMS."""
    spreads = [0.0, 1.0, 3.0, 100.0]
    whole = moving(spreads)
    even = whole.evened_out()
    usual = math.sqrt(sum(spread**2 for spread in spreads) / 4)
    expected = [math.sqrt(2 / (1 + (spread / usual) ** 2)) for spread in spreads]
    assert (even.weights / whole.weights).tolist() == pytest.approx(expected)
    assert expected[0] == pytest.approx(math.sqrt(2))
    assert torch.equal(even.features, whole.features)
    assert torch.equal(even.targets, whole.targets)


def test_segments_that_never_move_stay_as_important_as_each_other() -> None:
    whole = moving([0.0, 0.0])
    resting = replace(whole, targets=torch.full_like(whole.targets, 0.5))
    weights = resting.evened_out().weights / whole.weights
    assert weights.tolist() == pytest.approx([math.sqrt(2)] * 2)


def test_residuals_count_as_their_weights_squared() -> None:
    whole = moving([1.0, 1.0, 1.0], samples=10)  # weights 1, 2, 3
    assert whole.counted == pytest.approx(10 * 2 * (1 + 4 + 9))
    assert replace(whole, weights=torch.ones(3).double()).counted == whole.targets.numel()
