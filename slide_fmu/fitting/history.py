"""A history has the course of a training, the options it tried, and remarks on the result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from slide_fmu.core.figures import optional


@dataclass(frozen=True)
class SizeTrial:
    """A SizeTrial is a size that the search for sizes has judged in short runs.

    Attributes:
        order: number of states that carry the response.
        units: number of hidden units; 0 for a linear network.
        parameters: number of parameters.
        validation_error: RMS in scaled units; None if no run was stable. Of measured records it is
            the median over blocks that are spread over the records.
        lowest_error, highest_error: the errors of the best and the worst of these blocks; None
            where there is only one.
        learnable_error: RMS of the part of that error that could be predicted from the inputs;
            None if the search did not compute it.
    """

    order: int
    units: int
    parameters: int
    validation_error: float | None
    learnable_error: float | None
    lowest_error: float | None = optional()
    highest_error: float | None = optional()


@dataclass(frozen=True)
class UnitTrial:
    """A UnitTrial is a kind of hidden units tried on data without the largest amplitudes.

    Attributes:
        units: the kind, as in recipes.
        number: number of hidden units.
        substeps: number of sub-steps.
        validation_error: RMS in scaled units within the trained amplitudes.
        error_beyond: RMS in scaled units at the larger amplitudes; infinite if the network
            diverged.
    """

    units: str
    number: int
    substeps: int
    validation_error: float
    error_beyond: float


@dataclass(frozen=True)
class History:
    """A History is the course of a training, with one entry for each validation.

    Attributes:
        step: number of optimizer steps so far.
        training_error: error of the batches since the previous entry, as the objective reports it.
        validation_error: error on the validation windows, as the objective reports it.
        sizes: sizes that the search has judged, in their order; empty without a search.
        units: kinds of hidden units that were tried; empty if the recipe names the kind.
        explanations: one sentence for each choice of features, hidden units or sizes, on why it
            pays; empty without a search.
        remark: what the user should know about the result; None if there is nothing.
        relative: whether the errors are relative RMSE: errors of outputs over their standard
            deviation, with equal weights for all samples.
        cpu_seconds: CPU time in s, including the search for features before; None if not measured.
            Histories that differ only in it are equal.
    """

    step: tuple[int, ...]
    training_error: tuple[float, ...]
    validation_error: tuple[float, ...]
    sizes: tuple[SizeTrial, ...] = ()
    units: tuple[UnitTrial, ...] = ()
    explanations: tuple[str, ...] = ()
    remark: str | None = None
    relative: bool = False
    cpu_seconds: float | None = field(default=None, compare=False)


def explanations_of(histories: Mapping[str, History]) -> tuple[str, ...]:
    """Return the explanations of all choices, in the order of the trainings."""
    return tuple(one for history in histories.values() for one in history.explanations)


@dataclass(frozen=True)
class CurvePoint:
    """A CurvePoint is one point of a learning curve.

    Attributes:
        trajectories: number of training trajectories.
        validation_error: RMS on other trajectories, in scaled units.
        training_error: RMS on the training trajectories.
        seconds: time in s for its data and its training.
    """

    trajectories: int
    validation_error: float
    training_error: float
    seconds: float


@dataclass(frozen=True)
class Curve:
    """A Curve is a learning curve, from few trajectories to many, and the reason why it ended.

    ``ended`` is None while it has not ended.
    """

    points: tuple[CurvePoint, ...] = ()
    ended: str | None = None
