"""The recipe's table ``bound`` describes the error bound and the domain."""

from __future__ import annotations

from pydantic import Field

from slide_fmu.core.block_means import N_BLOCKS, block_lengths, span_samples
from slide_fmu.excitation.kinds import Excitation
from slide_fmu.recipe.learning import LeastSquaresRecipe, PositiveFloat, PositiveInt, Table
from slide_fmu.recipe.tables import WindowRecipe

DOMAIN_SHARE = 0.05
"""The domain takes this part of the false alarms, and bounds above their tolerances take the rest.

The domain alone finds few errors in range. Mean squares of inputs and states that are bounded
anyway make most of its false alarms, also on kinds of inputs without any harm."""


class CompanionRecipe(Table):
    """The table ``bound.expert.companion`` gives the differences of companion and surrogate.

    A companion that is more accurate than the surrogate shows the errors themselves, so bounds are
    narrower. It takes more time where the bound is read.

    Attributes:
        hidden: its number of hidden units; as ``network.hidden`` if not given.
        starts: number of random starts; as ``training.starts`` if not given.
        iterations: number of iterations; as ``training.iterations`` if not given.
        refinements: number of refinements; as ``training.expert.refinements`` if not given.
    """

    hidden: PositiveInt | None = None
    starts: PositiveInt | None = None
    iterations: PositiveInt | None = None
    refinements: PositiveInt | None = None

    def of_training(self, training: LeastSquaresRecipe, seed: int) -> LeastSquaresRecipe:
        """Return the training of the companion, given the training of the surrogate."""
        own = {"starts": self.starts, "iterations": self.iterations}
        given = {key: value for key, value in own.items() if value is not None}
        expert = training.expert
        if self.refinements is not None:
            expert = expert.model_copy(update={"refinements": self.refinements})
        return training.model_copy(update={"seed": seed, "expert": expert, **given})


class BoundExpert(Table):
    """The table ``bound.expert`` tunes how an error bound is learnt.

    Attributes:
        hidden: widths of the head's layers of tanh units.
        steps: optimizer steps of the head's training.
        batch: samples per step.
        learning_rate: highest learning rate.
        seed: seed of the head's training; the seed of the companion is the surrogate's
            plus one plus this.
        attempts: the companion is trained up to this number of times, from starts of its own,
            until it is about as accurate as the surrogate.
        short_span, long_span: approximate times in s over which the disagreement of surrogate and
            companion is averaged; states and features are averaged over the long one too.
        companion: its size and its training, where they differ from the surrogate's.
        further: number of trajectories of ``bound.excitation``; half of ``data.bound`` if 0.
    """

    hidden: tuple[PositiveInt, ...] = Field(default=(16,), min_length=1)
    steps: PositiveInt = 4000
    batch: PositiveInt = 1024
    learning_rate: PositiveFloat = 1e-2
    seed: int = Field(default=0, ge=0, lt=2**30)
    attempts: PositiveInt = 3
    short_span: PositiveFloat = 0.1
    long_span: PositiveFloat = 1.0
    companion: CompanionRecipe = CompanionRecipe()
    further: int = Field(default=0, ge=0)


class BoundRecipe(Table):
    """The table ``bound`` describes the error bound of a state-space network.

    A second network of the same family, the companion, learns from ``data.companion`` trajectories
    of its own. A small head learns the local scale of the error from ``data.bound`` further ones,
    and ``data.calibration`` others calibrate both. With ``bound.excitation``, the head also learns
    from ``expert.further`` trajectories of these kinds.

    Attributes:
        false_alarms: share of the samples of the calibration at which ``trusted`` is false: a
            bound exceeds its tolerance, or they lie outside of the domain (a twentieth of them).
        estimate_span: approximate time in s over which the head's expected RMS errors are combined
            to an error estimate; without the key there is no estimate, unless there is a table
            ``estimator``.
        excitation: further kinds of excitation. Only the head learns from them, so that it knows
            larger errors than in the domain; nothing is calibrated by them.
        expert: settings for users who know the method.
    """

    false_alarms: float = Field(default=0.04, gt=0, lt=0.5)
    estimate_span: PositiveFloat | None = None
    excitation: tuple[Excitation, ...] = ()
    expert: BoundExpert = BoundExpert()

    @property
    def domain_alarms(self) -> float:
        """The share of the samples of the calibration that the domain may leave outside."""
        return DOMAIN_SHARE * self.false_alarms

    def samples(self, window: WindowRecipe) -> int:
        """Return how many samples a trajectory needs for the bound.

        It needs the window, or the inputs that the bound must know before it counts, if they are
        longer; and then one mean over the long blocks, to have a sample to calibrate by.
        """
        long, span = self._long_block(window.step), self.span_block(window.step) or 0
        known = max(window.n_in, window.n_in - window.n_out + 1 + (N_BLOCKS + 1) * long)
        return known + (N_BLOCKS + 1) * span + N_BLOCKS * long

    def filling(self, window: WindowRecipe) -> int:
        """Return how many samples of the inputs a bound must know to count.

        Its error estimate must know the same samples.
        """
        longest = self._long_block(window.step) + (self.span_block(window.step) or 0)
        return window.n_in - window.n_out + 1 + (N_BLOCKS + 1) * longest

    def span_block(self, step: float) -> int | None:
        """Return the number of samples, at a step in s, in ``estimate_span``, or None."""
        if self.estimate_span is None:
            return None
        return max(1, round(self.estimate_span / step / (N_BLOCKS + 0.5)))

    def span_length(self, step: float) -> int:
        """Return the number of samples, at a step in s, of the error estimate; 0 without one."""
        block = self.span_block(step)
        return 0 if block is None else span_samples(block)

    def _long_block(self, step: float) -> int:
        """Return the number of samples, at a step in s, in a long block."""
        return block_lengths(step, (self.expert.short_span, self.expert.long_span))[1]
