"""What the runs of a state-space fit make small: squares of residuals, and penalties."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray

from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.levenberg_marquardt import LeastSquares
from slide_fmu.fitting.state_space.linear_start import excited_eigenvalues
from slide_fmu.fitting.state_space.normal_equations import (
    NormalEquations,
    normal_equations,
    sum_of_squares,
)
from slide_fmu.fitting.state_space.pole_penalty import PolePenalty, pole_grid, pole_radii
from slide_fmu.fitting.state_space.segments import Segments
from slide_fmu.fitting.state_space.smoothness import Smoothness
from slide_fmu.network.state_space.cell import Roles


@dataclass(frozen=True, eq=False)
class FitData:
    """Fit data are what all runs of a fit work on.

    Attributes:
        whole: segments of all trajectories.
        part: some of these segments, for the starts.
        validation: segments by which parameters are chosen.
        features: scaled features of whole trajectories, shape (n_trajectories, N, n_features).
        roles: which features are state inputs, feedthrough, scheduling variables and so on.
    """

    whole: Segments
    part: Segments
    validation: Segments
    features: torch.Tensor
    roles: Roles


class Objective:
    """An objective gives the least-squares problems of one fit. Final."""

    def __init__(self, problem: Problem, data: FitData) -> None:
        self.problem, self.data = problem, data

    @cached_property
    def excited(self) -> NDArray[np.complex128] | None:
        """The eigenvalues that the inputs excite; None where none are known."""
        if self.problem.eigenvalues is None or len(self.problem.eigenvalues) == 0:
            return None
        drive = self.data.features[:, :, list(self.data.roles.drive)]
        return excited_eigenvalues(self.problem.eigenvalues, drive, self.problem.window.step)

    def penalty(self, shape: CellShape, residuals: int) -> PolePenalty:
        """Return the penalty on poles that decay more slowly than the window and the system."""
        excited, step = self.excited, self.problem.window.step
        physical, grid = self.problem.physical, None
        if physical is not None:
            grid = pole_grid(physical.basis).to(self.data.features)
            if physical.eigenvalues is not None:  # heavier masses decay more slowly
                excited = physical.eigenvalues
        # poles of the system itself: a mode v has the pole exp(v h)
        slowest = 0.0 if excited is None else float(np.exp(excited.real * step).max())
        penalty = PolePenalty.of(self.problem.window, slowest, residuals)
        return replace(penalty, radius=penalty.radius ** (1 / shape.substeps), grid=grid)

    def least_squares(self, shape: CellShape, segments: Segments) -> LeastSquares:
        """Return the problem on segments with the penalties on poles and on coefficients.

        The validation error of an unstable A is infinite, so that it is never chosen.
        """
        count, physical = segments.targets.numel(), self.problem.physical
        validation, penalty = self.data.validation, self.penalty(shape, count)
        terms = None if physical is None else physical.terms("training")
        smoothness = Smoothness.of(terms, count)

        def normal(theta: torch.Tensor) -> NormalEquations:
            found = penalty.join(normal_equations(shape, theta, segments), shape, theta)
            return smoothness.join(found, shape, theta)

        def cost(theta: torch.Tensor) -> float:
            squares = sum_of_squares(shape, theta, segments)
            more = penalty.cost(shape, theta) + smoothness.cost(shape, theta)
            return squares + more if math.isfinite(squares) else squares

        def error(theta: torch.Tensor) -> float:
            squares = sum_of_squares(shape, theta, validation)
            radii = pole_radii(shape, theta, penalty.grid)
            fine = math.isfinite(squares) and float(radii.max()) < 1
            return math.sqrt(squares / validation.counted) if fine else math.inf

        return LeastSquares(normal, cost, segments.counted, error)
