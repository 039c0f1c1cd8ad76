"""A history holds the course of a training, what it tried, and what it may have missed."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class TriedSize:
    """A tried size is one that the search for sizes has judged, in short runs.

    Attributes:
        order: number of states that carry the response.
        units: number of hidden units; 0 for a linear network.
        parameters: number of parameters.
        validation_error: RMS in scaled units; None where no run was stable.
        learnable_error: RMS of the part of that error that could be predicted from the inputs;
            None where the search did not ask.
    """

    order: int
    units: int
    parameters: int
    validation_error: float | None
    learnable_error: float | None


@dataclass(frozen=True)
class TriedUnits:
    """A kind of hidden units was tried on data whose largest amplitudes were held out.

    Attributes:
        units: the kind, as in recipes.
        number: number of hidden units.
        substeps: number of sub-steps.
        validation_error: RMS in scaled units within the amplitudes that were learnt from.
        error_beyond: RMS in scaled units at those that were held out; infinite where the network
            diverged.
    """

    units: str
    number: int
    substeps: int
    validation_error: float
    error_beyond: float


@dataclass(frozen=True)
class History:
    """A history is the course of a training, with one entry for each validation.

    Attributes:
        step: optimizer steps done until then.
        training_error: error of the batches since the entry before, as the objective reports it.
        validation_error: error on the validation windows, as the objective reports it.
        sizes: what the search for sizes has judged, in its order; empty without a search.
        units: kinds of hidden units that were tried; empty where the recipe names the kind.
        remark: what the user should know about the result; None if there is nothing.
        relative: whether the errors are relative RMSE: those of outputs over their standard
            deviation, all samples weighted alike.
        cpu_seconds: CPU time in s that it took, with the search for features before it; None
            where it was not measured. Histories that differ in it alone are equal.
    """

    step: tuple[int, ...]
    training_error: tuple[float, ...]
    validation_error: tuple[float, ...]
    sizes: tuple[TriedSize, ...] = ()
    units: tuple[TriedUnits, ...] = ()
    remark: str | None = None
    relative: bool = False
    cpu_seconds: float | None = field(default=None, compare=False)


@dataclass(frozen=True)
class CurvePoint:
    """A point of a learning curve.

    Attributes:
        trajectories: number of trajectories that were learnt from.
        validation_error: RMS on other trajectories, in scaled units.
        training_error: RMS on those that were learnt from.
        seconds: time that its data and its learning took.
    """

    trajectories: int
    validation_error: float
    training_error: float
    seconds: float


@dataclass(frozen=True)
class Curve:
    """A learning curve, from few trajectories to many, and why it ended.

    ``ended`` is None as long as it has not ended.
    """

    points: tuple[CurvePoint, ...] = ()
    ended: str | None = None
