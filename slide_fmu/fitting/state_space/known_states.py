"""The states of a system that shows them are the coordinates of a network.

So its map from one sample to the next can be fitted from any sample on, and the first weights are
those of a linear regression.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch

from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.state_space.fit_data import FitData
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.network.state_space.cell import Roles

LINEAR = 1e-4
"""An output is read out of the states if a linear map misses less than this part of its standard
deviation; else it becomes a state itself."""
DELAYED = 0.9
"""The inputs at the beginning of a step become states if they lower the error of a linear step
below this fraction, as where inputs move linearly between samples."""
OFFERED, LOOKED_AT, BINS = 8, 6, 20
"""Spans are chosen out of this multiple of their number, by the states at so many samples of each,
evenly over so many sizes."""
FEWEST_SAMPLES = 200
"""Trajectories must be longer than this number of samples."""
FAR = 3.0
"""The states at rest are taken for zero if a linear model has them within this multiple of the
states' standard deviations."""


@dataclass(frozen=True, eq=False)
class Known:
    """A Known has the states of a network at all samples of trajectories.

    States are those of the system, then outputs that are no linear function of them, then the
    inputs at the beginning of the step where these act. Each has about the deviation one, and is
    about zero at rest.

    Attributes:
        features: features (n_trajectories, N, n_features) from the first sample on whose states
            are known.
        states: states before each of them and behind the last one, (n_trajectories, N + 1, n).
        targets: scaled outputs, (n_trajectories, N + 1, n_outputs).
    """

    features: torch.Tensor
    states: torch.Tensor
    targets: torch.Tensor

    def spans(self, targets: torch.Tensor, length: int, count: int, seed: int) -> Segments:
        """Draw spans of a length anywhere in the trajectories, with their true first states.

        The targets are (n_trajectories, N + 1, p); they are scored after each feature. Half of the
        spans are drawn evenly over the sizes that states reach in them: large motions are rare,
        and decide how far the network may be trusted.
        """
        rng = np.random.default_rng(seed)
        length = min(length, self.features.shape[1])
        of = rng.integers(0, len(self.features), OFFERED * count)
        first = rng.integers(0, self.features.shape[1] - length + 1, OFFERED * count)
        along = first[:, None] + np.linspace(0, length, LOOKED_AT).astype(np.int64)
        sizes = self._sizes[of[:, None], along].max(axis=1)
        bins = np.minimum((BINS * sizes / sizes.max()).astype(np.int64), BINS - 1)
        rare = 1.0 / np.bincount(bins, minlength=BINS)[bins]
        rest = np.arange(count // 2, len(of))
        weights = rare[rest] / rare[rest].sum()
        large = rng.choice(rest, count - count // 2, replace=False, p=weights)
        chosen = np.concatenate([np.arange(count // 2), large])
        begins = torch.from_numpy(of[chosen]), torch.from_numpy(first[chosen])
        return self._cut(targets, begins, length, 0)

    @cached_property
    def _sizes(self) -> FloatArray:
        """The largest state in parts of its largest value, (n_trajectories, N + 1)."""
        states = self.states.abs()
        largest = states.amax((0, 1)).clamp_min(torch.finfo(states.dtype).tiny)
        return np.asarray((states / largest).amax(2).double().cpu().numpy())

    def windows(self, burn_in: int, scored: int, count: int) -> Segments:
        """Return parts with a burn-in of about as many motions as ``count``, at any time of them.

        They have the true first states; scored are the outputs behind the burn-in.
        """
        length = min(burn_in + scored, self.features.shape[1])
        mixed = torch.randperm(count, generator=torch.Generator().manual_seed(0))
        latest = self.features.shape[1] - length
        first = torch.linspace(0, latest, count).round().long()[mixed]
        begins = torch.arange(count) % len(self.features), first
        return self._cut(self.targets, begins, length, burn_in)

    def _cut(
        self,
        targets: torch.Tensor,
        begins: tuple[torch.Tensor, torch.Tensor],
        length: int,
        burn_in: int,
    ) -> Segments:
        """Cut parts of a length; they begin in trajectories at samples, (count,) each."""
        of, first = begins
        along = first + torch.arange(length)[:, None]
        return Segments(
            self.features[of, along],
            targets[of, along[burn_in:] + 1],
            self.features.new_ones(len(of)),
            initial=self.states[of, first],
        )


@dataclass(frozen=True, eq=False)
class KnownStates:
    """KnownStates are the known states of a fit, with linear maps between them.

    Attributes:
        training, validation: the states along trajectories.
        own: number of states of the system, which come first.
        moving: number of these and of the outputs behind them; the inputs of the step before
            follow.
        a, b: the linear map of a step, (n, n) and (n, n_drive).
        c, d, d0: the map to the outputs, (p, n), (p, n_static) and (p,).
    """

    training: Known
    validation: Known
    own: int
    moving: int
    a: torch.Tensor
    b: torch.Tensor
    c: torch.Tensor
    d: torch.Tensor
    d0: torch.Tensor

    @property
    def count(self) -> int:
        """The number n of states."""
        return len(self.a)


def known_states(data: FitData) -> KnownStates | None:
    """Return the known states of a fit; None if there are none, or the network cannot have them.

    The network must be free to have them: its order is open or the same, it has plain tanh units,
    its weights follow no physical parameters, and it does not begin with another network.
    """
    problem, network = data.problem, data.network
    if problem.states is None or problem.start is not None or problem.physical is not None:
        return None
    short = data.features.shape[1] < FEWEST_SAMPLES
    if short or problem.beyond is not None or not network.may_have_states_of_the_system:
        return None
    if data.training.expert.even_out:  # spans of all sizes count the same already
        return None
    found = _found(data, *problem.states)
    if found is None or network.order == "auto":
        return found
    given = network.order + (network.padding if network.hidden else 0)
    return found if given == found.count else None


@dataclass(frozen=True, eq=False)
class _Columns:
    """The values of a trajectory's samples from the second on, as rows of numbers.

    Attributes:
        states: states of the system, (n_trajectories, N, n).
        targets: scaled outputs, (n_trajectories, N, p).
        drive, before, static: features of the step that ends there, those of the step before it,
            and those of the feedthrough, (n_trajectories, N, ...).
    """

    states: FloatArray
    targets: FloatArray
    drive: FloatArray
    static: FloatArray


def _columns(
    roles: Roles, features: torch.Tensor, targets: torch.Tensor, states: FloatArray
) -> _Columns:
    of_features = features.double().cpu().numpy()
    return _Columns(
        states[:, 1:],
        targets.double().cpu().numpy()[:, 1:],
        of_features[:, :, list(roles.drive)],
        of_features[:, :, list(roles.static)],
    )


def _found(data: FitData, training: FloatArray, validation: FloatArray) -> KnownStates | None:
    """Find which values make the network's states, and the linear maps between them."""
    problem, roles = data.problem, data.roles
    both = [
        _columns(roles, *part, states)
        for part, states in (
            (problem.training, training),
            (problem.validation, validation),
        )
    ]
    learnt = both[0]
    if not (np.isfinite(learnt.states).all() and np.isfinite(learnt.targets).all()):
        return None
    shown = _rows(learnt.states)
    deviation = shown.std(axis=0)
    moves = deviation > 1e-9 * np.abs(shown).max(axis=0, initial=0.0)
    missed = _missed(learnt.targets, (learnt.states[..., moves], learnt.static))
    bent = missed > LINEAR
    own = [np.concatenate([c.states[..., moves], c.targets[..., bent]], axis=2) for c in both]
    moving = own[0].shape[2]
    if moving == 0:
        return None
    before, after, drive = own[0][:, :-1], own[0][:, 1:], learnt.drive[:, 1:]
    plain = _missed(after, (before, drive))
    delayed = _missed(after, (before, drive, learnt.drive[:, :-1]))
    if bool((delayed < DELAYED * plain).any()):
        own = [np.concatenate([x, c.drive], axis=2) for x, c in zip(own, both, strict=True)]
    own = _scaled(own, learnt.drive)
    read = np.r_[: int(moves.sum()), moving : own[0].shape[2]]
    a = np.zeros((own[0].shape[2],) * 2)
    a[:, read], b, _ = _map(own[0][:, 1:], (own[0][:, :-1][..., read], learnt.drive[:, 1:]))
    c, d, d0 = _map(learnt.targets, (own[0], learnt.static))
    like = data.features
    knowns = [
        Known(
            part[0][:, 1:].to(like),
            torch.from_numpy(states).to(like),
            part[1][:, 1:].to(like),
        )
        for part, states in zip((problem.training, problem.validation), own, strict=True)
    ]
    maps = (torch.from_numpy(np.ascontiguousarray(one)).to(like) for one in (a, b, c, d, d0))
    return KnownStates(knowns[0], knowns[1], int(moves.sum()), moving, *maps)


def _rows(values: FloatArray) -> FloatArray:
    return np.asarray(values.reshape(-1, values.shape[-1]))


def _map(
    values: FloatArray, parts: tuple[FloatArray, ...]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Fit values, (..., m), by a linear map of two parts and a constant; return the three."""
    known = [_rows(part) for part in parts]
    design = np.hstack([*known, np.ones((len(known[0]), 1))])
    found = np.asarray(np.linalg.lstsq(design, _rows(values), rcond=None)[0], np.float64)
    first = known[0].shape[1]
    return found[:first].T, found[first:-1].T, found[-1]


def _missed(values: FloatArray, parts: tuple[FloatArray, ...]) -> FloatArray:
    """Return what a linear map misses of values, (m,), relative to their standard deviations."""
    known = [_rows(part) for part in parts]
    design = np.hstack([*known, np.ones((len(known[0]), 1))])
    size = np.maximum(np.abs(design).max(axis=0), np.finfo(np.float64).tiny)
    rows = _rows(values)
    rest = rows - (design / size) @ np.linalg.lstsq(design / size, rows, rcond=None)[0]
    deviation = rows.std(axis=0)
    tiny = np.finfo(np.float64).tiny
    return np.asarray(np.sqrt(np.mean(rest**2, axis=0)) / np.maximum(deviation, tiny))


def _scaled(own: list[FloatArray], drive: FloatArray) -> list[FloatArray]:
    """Scale states by their deviations in training, about where a linear model is at rest."""
    mean, deviation = _rows(own[0]).mean(axis=0), _rows(own[0]).std(axis=0)
    own = [(x - mean) / deviation for x in own]
    a, _, constant = _map(own[0][:, 1:], (own[0][:, :-1], drive[:, 1:]))
    rest = np.linalg.lstsq(np.eye(len(a)) - a, constant, rcond=None)[0]
    rest = np.where(np.abs(rest) < FAR, rest, 0.0)
    return [x - rest for x in own]
