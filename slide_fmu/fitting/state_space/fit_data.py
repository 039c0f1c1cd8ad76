"""The data of a state-space fit are cut into segments, which define its least-squares problems."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray

from slide_fmu.fitting.feature_choice import roles_of
from slide_fmu.fitting.problem import Problem, Which
from slide_fmu.fitting.state_space.amounts import (
    FORGOTTEN_BY_STARTS,
    LONG_BURN_IN,
    MOST_OF_STARTS,
    MOST_OF_VALIDATION,
    PER_PARAMETER,
    SEGMENT,
)
from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.levenberg_marquardt import LeastSquares
from slide_fmu.fitting.state_space.linear_start import excited_eigenvalues
from slide_fmu.fitting.state_space.normal_equations import (
    NormalEquations,
    normal_equations,
    squares_of_segments,
    sum_of_squares,
)
from slide_fmu.fitting.state_space.penalties import (
    PolePenalty,
    Prior,
    Smoothness,
    pole_grid,
    pole_radii,
)
from slide_fmu.fitting.state_space.segments import Segments, cut_segments
from slide_fmu.fitting.state_space.whitening import Whitening
from slide_fmu.network.state_space.cell import Roles
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe

FEWEST = 8
"""Smallest number of segments for the starts, if there are enough."""
ENOUGH = 12_288
"""Smallest number of samples that judge sizes, if there are enough: with fewer, a linear model,
fitted to all data, would seem better than the many parameters of hidden units."""

JUDGING = 5
"""Largest number of blocks of measured records whose median judges a size."""


@dataclass(frozen=True, eq=False)
class FitData:
    """FitData are shared by all runs of a fit.

    Attributes:
        problem: the problem that they are cut from.
        network, training: the recipe's tables of the network and of its training.
        whole: segments of all trajectories.
        part: some of these segments, or shorter ones, for the starts.
        validation: segments that select the parameters, some of very many.
        features: scaled features of whole trajectories, shape (n_trajectories, N, n_features).
        roles: the features for state input, feedthrough, scheduling variables and so on.
        pieces: number of segments of each trajectory.
        shorter: replaces segments by shorter ones of more trajectories, with a part of their
            burn-in (``_shorter``); None where the burn-in is short, or segments have weights.
    """

    problem: Problem
    network: StateSpaceRecipe
    training: LeastSquaresRecipe
    whole: Segments
    part: Segments
    validation: Segments
    features: torch.Tensor
    roles: Roles
    pieces: int = 1
    shorter: Callable[[Segments, float], Segments] | None = None

    def for_refinement(self, shape: CellShape) -> Segments:
        """Return the segments that a cell is refined on: all, or some of every trajectory.

        Where there are far more residuals than parameters, the time is better spent on more
        trajectories than on all segments of each.
        """
        stride = self.whole.targets.numel() // (PER_PARAMETER * shape.n_parameters)
        if stride < 2:
            return self.whole
        some = self.whole.every(_stride(stride, self.pieces, self.whole.count))
        return some if self.shorter is None else self.shorter(some, 1.0)

    @cached_property
    def excited(self) -> NDArray[np.complex128] | None:
        """The eigenvalues that the inputs excite; None if no eigenvalues are known."""
        if self.problem.eigenvalues is None or len(self.problem.eigenvalues) == 0:
            return None
        drive = self.features[:, :, list(self.roles.drive)]
        return excited_eigenvalues(self.problem.eigenvalues, drive, self.problem.window.step)

    def errors_of_blocks(self, shape: CellShape, theta: torch.Tensor) -> tuple[float, ...]:
        """Return the validation error of a cell, an RMS in scaled units, of each block in time.

        A size is judged by their median: on one stretch of a record a poor network may be good by
        chance. That is for measured records alone: kinds of simulated inputs differ in size.
        """
        squares = squares_of_segments(shape, theta, self.validation)
        count = min(JUDGING, len(squares))
        each = self.validation.targets.numel() / self.validation.count
        blocks = squares.double().tensor_split(count)
        return tuple(math.sqrt(float(block.mean()) / each) for block in blocks)

    def penalty(self, shape: CellShape, residuals: int) -> PolePenalty:
        """Return the penalty on poles that decay more slowly than the window and the system."""
        excited, step = self.excited, self.problem.window.step
        physical, grid = self.problem.physical, None
        if physical is not None:
            grid = pole_grid(physical.basis).to(self.features)
            if physical.eigenvalues is not None:  # heavier masses decay more slowly
                excited = physical.eigenvalues
        # poles of the system itself: a mode v has the pole exp(v h)
        slowest = 0.0 if excited is None else float(np.exp(excited.real * step).max())
        penalty = PolePenalty.of(self.problem.window, slowest, residuals)
        return replace(penalty, radius=penalty.radius ** (1 / shape.substeps), grid=grid)

    def least_squares(
        self, shape: CellShape, segments: Segments, prior: Prior | None = None
    ) -> LeastSquares:
        """Return the problem on segments with the penalties on poles and on coefficients.

        A prior towards known weights may be added. The validation error of an unstable A is
        infinite, so that it is never chosen.
        """
        count, physical = segments.targets.numel(), self.problem.physical
        validation, penalty = self.validation, self.penalty(shape, count)
        terms = None if physical is None else physical.terms("training")
        smoothness = Smoothness.of(terms, count)

        def normal(theta: torch.Tensor) -> NormalEquations:
            equations = penalty.join(normal_equations(shape, theta, segments), shape, theta)
            return smoothness.join(equations, shape, theta)

        def cost(theta: torch.Tensor) -> float:
            squares = sum_of_squares(shape, theta, segments)
            more = penalty.cost(shape, theta) + smoothness.cost(shape, theta)
            return squares + more if math.isfinite(squares) else squares

        def error(theta: torch.Tensor) -> float:
            squares = sum_of_squares(shape, theta, validation)
            radii = pole_radii(shape, theta, penalty.grid)
            fine = math.isfinite(squares) and float(radii.max()) < 1
            return math.sqrt(squares / validation.counted) if fine else math.inf

        problem = LeastSquares(normal, cost, segments.counted, error)
        return problem if prior is None else prior.joined(problem)


def fit_data(problem: Problem, network: StateSpaceRecipe, training: LeastSquaresRecipe) -> FitData:
    """Cut trajectories into segments, for the starts and for the whole fit."""
    dtype = getattr(torch, training.expert.precision)
    burn_in = problem.window.n_truncated

    def segments(which: Which, lengths: tuple[int, int] | None = None, every: int = 1) -> Segments:
        """Cut every so many trajectories; lengths are those of burn-in and scored part."""
        forgets, length = lengths or (burn_in, training.expert.segment or max(SEGMENT, burn_in))
        features, targets = (part[::every].to(dtype) for part in getattr(problem, which))
        phi = None
        if problem.physical is not None:
            phi = torch.from_numpy(problem.physical.terms(which)[::every]).to(features)
        cut = cut_segments(features, targets, forgets, length, phi)
        return cut.evened_out() if training.expert.even_out else cut

    features = problem.training[0].to(dtype)
    whole = segments("training")
    pieces = whole.count // len(features)
    if problem.beyond is not None:
        whole = whole.and_others(segments("beyond"), training.expert.beyond_weight)
    searched = "auto" in (network.order, network.hidden)
    fewest = max(FEWEST, math.ceil(ENOUGH / len(whole.targets))) if searched else FEWEST
    validation = segments("validation")
    if problem.noise is not None:
        whitening = Whitening.of_noise(problem.noise).to(features).normalised(whole.targets)
        whole, validation = (replace(s, whitening=whitening) for s in (whole, validation))
    stride = max(training.expert.part, whole.targets.numel() // MOST_OF_STARTS)
    part = whole.every(_stride(stride, pieces, whole.count, fewest))
    shorter = None
    if burn_in > LONG_BURN_IN and training.expert.segment is None and problem.beyond is None:

        def shorter(some: Segments, kept: float) -> Segments:
            cut = _shorter(segments, some, kept, len(features))
            return replace(cut, whitening=whole.whitening)

        part = shorter(part, FORGOTTEN_BY_STARTS)
    longest = math.ceil(validation.targets.numel() / MOST_OF_VALIDATION)
    if longest > 1:
        of_validation = validation.count // len(problem.validation[0])
        validation = validation.every(_stride(longest, of_validation, validation.count))
    start = problem.start
    roles = roles_of(network, problem.features) if start is None else start.roles
    return FitData(
        problem, network, training, whole, part, validation, features, roles, pieces, shorter
    )


def _shorter(
    segments: Callable[[Which, tuple[int, int], int], Segments],
    part: Segments,
    kept: float,
    count: int,
) -> Segments:
    """Return about as many scored samples as a part has, in shorter segments of more trajectories.

    A cell runs sample by sample, whatever the number of segments, so that long ones take long.

    Args:
        segments: cuts the segments.
        part: segments with the whole burn-in.
        kept: part of their burn-in that shorter ones have.
        count: the number of trajectories.
    """
    burn_in = math.ceil(kept * part.burn_in)
    length = max(SEGMENT, burn_in // 4)
    wanted = max(FEWEST, round(len(part.targets) * part.count / length))
    every = _stride(max(1, count // wanted), 1, count)
    cut = segments("training", (burn_in, length), every)
    pieces = cut.count // len(range(0, count, every))
    return cut.every(_stride(max(1, cut.count // wanted), pieces, cut.count))


def _stride(part: int, pieces: int, count: int, fewest: int = FEWEST) -> int:
    """Choose the stride with which some segments are taken out of ``count``.

    It is the least from ``part`` on, or the greatest below it, that has no divisor in common with
    the number of segments of a trajectory. Otherwise, for example, only early segments would be
    taken. It is odd, too: every second point of a Sobol sequence, as which trajectories have their
    physical parameters, lies in the same half of some range.
    """
    most = max(1, count // fewest)
    wished = [*range(part, most + 1), *range(min(part, most), 0, -1)]
    fitting: list[int] = [stride for stride in wished if math.gcd(stride, 2 * pieces) == 1]
    return fitting[0]
