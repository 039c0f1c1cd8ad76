"""All baselines are registered here, in one row each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from slide_fmu.apps.compare.baselines.base import Budget, FittedBaseline
from slide_fmu.apps.compare.baselines.gradient import fit_gru, fit_paper_network
from slide_fmu.apps.compare.baselines.impulse_response import fit_fir
from slide_fmu.apps.compare.baselines.lesson import Lesson
from slide_fmu.apps.compare.baselines.linear import fit_linear_state_space
from slide_fmu.apps.compare.baselines.polynomial import fit_arx, fit_narx
from slide_fmu.core.progress import Progress


@dataclass(frozen=True)
class BaselineCandidate:
    """A BaselineCandidate is a kind of baseline.

    Attributes:
        title: its name for users.
        linear: whether its models are linear.
        fit: returns the trained model for a lesson, a budget and a progress; raises a
            TrainingError if it diverges.
    """

    title: str
    linear: bool
    fit: Callable[[Lesson, Budget, Progress], FittedBaseline]


CANDIDATES: dict[str, BaselineCandidate] = {
    "fir": BaselineCandidate("FIR", True, fit_fir),
    "arx": BaselineCandidate("ARX", True, fit_arx),
    "narx": BaselineCandidate("NARX", False, fit_narx),
    "linear_state_space": BaselineCandidate("linear state space", True, fit_linear_state_space),
    "gru": BaselineCandidate("GRU", False, fit_gru),
    "feed_forward": BaselineCandidate("feed-forward network", False, fit_paper_network),
}
"""All kinds of baselines, in the order in which they are fitted and shown."""
