"""The recipe's table ``bound`` is about the error bound and the domain."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from slide_fmu.core.block_means import N_BLOCKS, block_lengths, span_samples
from slide_fmu.excitation.mix import Excitation
from slide_fmu.recipe.learning import PositiveFloat, PositiveInt, Table
from slide_fmu.recipe.tables import WindowRecipe


class CompanionRecipe(Table):
    """The table ``bound.companion`` says in what a companion differs from the surrogate.

    A companion that errs less than the surrogate shows its errors themselves, and not only their
    scale: then bounds are narrower. It costs more time where the bound is read.

    Attributes:
        start: ``"random"``, or ``"surrogate"``: its training goes on from the surrogate's network,
            which takes a small part of the time. Then both share what they lack, and only what
            they have learnt from different trajectories shows the error.
        hidden: its number of units; as ``network.hidden`` if not given.
        starts: number of random starts; as ``training.starts`` if not given.
        iterations: as ``training.iterations`` if not given.
        stretches: as ``training.stretches`` if not given.
    """

    start: Literal["random", "surrogate"] = "random"
    hidden: PositiveInt | None = None
    starts: PositiveInt | None = None
    iterations: PositiveInt | None = None
    stretches: PositiveInt | None = None


class BoundRecipe(Table):
    """The table ``bound`` describes the error bound of a state-space network.

    A companion, a second network of the same family, learns from trajectories of its own; a small
    head learns the local scale of the error from further ones; and others calibrate both. The
    numbers of these trajectories are ``data.companion``, ``data.bound`` and ``data.calibration``.
    With kinds of excitation of its own, the head learns from ``data.further`` trajectories of
    these too.

    Attributes:
        hidden: widths of the head's layers of tanh units.
        steps: optimizer steps of the head's training.
        batch: samples per step.
        learning_rate: highest learning rate.
        seed: seed of the head's training; that of the companion is the surrogate's plus one plus
            this.
        attempts: the companion is trained so many times at most, from starts of its own, until it
            is about as accurate as the surrogate.
        companion: its size and its training, where they are not the surrogate's.
        short_span, long_span: times in s over which about the disagreement of surrogate and
            companion is averaged; over the long one states and features too.
        false_alarms: share of the samples of the calibration that lie outside of the domain.
        excitation: further kinds of excitation, from which the head learns too, but no network,
            and by which nothing is calibrated: so it knows larger errors than those in the domain.
        estimate_span: time in s over about which an error estimate is made of the RMS errors that
            the head then expects of each sample; none without the key, unless there is a table
            ``estimator``.
    """

    hidden: tuple[PositiveInt, ...] = Field(default=(16,), min_length=1)
    steps: PositiveInt = 4000
    batch: PositiveInt = 1024
    learning_rate: PositiveFloat = 1e-2
    attempts: PositiveInt = 3
    companion: CompanionRecipe = CompanionRecipe()
    seed: int = Field(default=0, ge=0, lt=2**30)
    short_span: PositiveFloat = 0.1
    long_span: PositiveFloat = 1.0
    false_alarms: float = Field(default=0.0025, gt=0, lt=0.5)
    estimate_span: PositiveFloat | None = None
    excitation: tuple[Excitation, ...] = ()

    def samples(self, window: WindowRecipe) -> int:
        """Return how many samples a trajectory needs for the bound.

        The window, or what the bound must know before it counts, if that is longer; and after it
        one mean over the long blocks, so that there is something to calibrate by.
        """
        long, span = self._long_block(window.step), self.span_block(window.step) or 0
        known = max(window.n_in, window.n_in - window.n_out + 1 + (N_BLOCKS + 1) * long)
        return known + (N_BLOCKS + 1) * span + N_BLOCKS * long

    def filling(self, window: WindowRecipe) -> int:
        """Return how many samples of the inputs a bound must know to count.

        They are also those that its error estimate must know.
        """
        longest = self._long_block(window.step) + (self.span_block(window.step) or 0)
        return window.n_in - window.n_out + 1 + (N_BLOCKS + 1) * longest

    def span_block(self, step: float) -> int | None:
        """Return the samples, of a step in s, in a block of ``estimate_span``; None without it."""
        if self.estimate_span is None:
            return None
        return max(1, round(self.estimate_span / step / (N_BLOCKS + 0.5)))

    def span_length(self, step: float) -> int:
        """Return over how many samples, of a step in s, the error estimate is; 0 without one."""
        block = self.span_block(step)
        return 0 if block is None else span_samples(block)

    def _long_block(self, step: float) -> int:
        """Return the samples, of a step in s, in a long block."""
        return block_lengths(step, (self.short_span, self.long_span))[1]
