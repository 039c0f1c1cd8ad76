"""What is told about a training: its course, the sizes it tried, and what it may have missed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TriedSize:
    """A tried size is one that the search for sizes has judged, in short runs.

    Attributes:
        order: number of states that carry the response.
        units: number of units; 0 for a linear network.
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
class History:
    """A history is the course of a training, with one entry for each validation.

    Attributes:
        step: optimizer steps done until then.
        training_error: error of the batches since the entry before, as the objective reports it.
        validation_error: error on the validation windows, as the objective reports it.
        sizes: what the search for sizes has judged, in its order; empty without a search.
        remark: what the user should know about the result; None if there is nothing.
    """

    step: tuple[int, ...]
    training_error: tuple[float, ...]
    validation_error: tuple[float, ...]
    sizes: tuple[TriedSize, ...] = ()
    remark: str | None = None
