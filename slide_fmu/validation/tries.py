"""Inputs as users set them are tried: half of them drawn, half near the worst one so far.

The search of ``adversarial`` begins at random trajectories and adds noise. A steady tone, an
offset or a limit that is held lies far from all of them. Here each try is one such input,
simulated once. Of several that are drawn, the one is tried on which the surrogate's outputs vary
most while nothing warns: where a machine moves much, an error matters. Near an input, errors
change slowly, so that the second half of the tries goes on from the worst. While nothing is
broken there, it also goes on from the worst of other kinds, and farther.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.measures import rms
from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray, moves
from slide_fmu.data.draws import Draw, drawn_outputs
from slide_fmu.recipe.case import Case
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.errors import SimulationError
from slide_fmu.validation.attacked import MeasuredInputs, first_measured, measured_inputs
from slide_fmu.validation.trust import BROKEN, HARMFUL, TINY
from slide_fmu.validation.trust_figures import TryFigures
from slide_fmu.validation.user_channels import Channel, channels_of
from slide_fmu.validation.user_inputs import KINDS, Point, UserInput

DRAWN = 8
"""Number of inputs of which one is tried."""

NEAR, FARTHER = (0.002, 0.05), (0.005, 0.3)
"""Ranges of the distance of a try from the worst one, and from the worst of several kinds, for
each coordinate of the unit cube."""

OTHERS = 3
"""While nothing is broken, every second try goes on from the worst of this many kinds in turn."""


@dataclass(frozen=True, eq=False)
class Try:
    """A Try is an input as users set it, with the errors on it.

    Attributes:
        point: where it is in the search.
        user_input: the input.
        found: its record.
        severity: how bad it is, by which tries are compared.
        figures: its errors.
    """

    point: Point
    user_input: UserInput
    found: MeasuredInputs
    severity: float
    figures: TryFigures


@dataclass(frozen=True, eq=False)
class TriedInputs:
    """TriedInputs are all tries of a search in their order, and how many of them failed."""

    tries: Sequence[Try] = ()
    failed: int = 0

    @property
    def worst_first(self) -> list[Try]:
        """The tries, the worst one first."""
        return sorted(self.tries, key=lambda one: -one.severity)


@dataclass(frozen=True, eq=False)
class Stage:
    """A Stage is all that tries of one search have in common.

    Attributes:
        surrogate: the one with the bound.
        case: its recipe and its reference.
        channels: the inputs as users see them.
        usual: 95 % quantile of the absolute errors in range, (n_outputs,).
    """

    surrogate: Surrogate
    case: Case
    channels: tuple[Channel, ...]
    usual: FloatArray

    @classmethod
    def of(cls, surrogate: Surrogate, case: Case, usual: FloatArray) -> Stage:
        """Return the stage of a surrogate."""
        window = surrogate.window
        channels = channels_of(case.recipe, case.reference, window.n_in * window.step)
        return cls(surrogate, case, channels, usual)

    def drawn(self, user_input: UserInput) -> Draw:
        """Return an input as a trajectory that begins at rest, at t = 0."""
        recipe, signals = self.case.recipe, self.surrogate.inputs
        step, burn_in = recipe.window.step, round(recipe.data.burn_in / recipe.window.step)
        duration = recipe.validation.duration or recipe.data.duration
        count = burn_in + round(duration / step)
        parts = recipe.data.substeps if user_input.bends and moves(signals) else 1
        time = step / parts * (np.arange(parts * count, dtype=np.float64) + 1 - parts)
        inputs = user_input.inputs(time)
        between = inputs if parts > 1 else None
        return Draw(0, 1.0, None, inputs[parts - 1 :: parts], burn_in, 0, between)

    def measured(self, user_input: UserInput) -> MeasuredInputs:
        """Simulate an input, or raise a SimulationError."""
        drawn = self.drawn(user_input)
        truth = drawn_outputs(self.case.reference, drawn)[1:]
        first = first_measured(self.surrogate, drawn.burn_in)
        return measured_inputs(self.surrogate, drawn.inputs, truth, first)

    def tried(self, point: Point) -> Try:
        """Try a point, or raise a SimulationError."""
        user_input = point.user_input(self.channels)
        found = self.measured(user_input)
        over_usual = found.errors / np.maximum(self.usual, TINY)
        severity = float(np.sqrt(found.ratios * over_usual).max())
        return Try(point, user_input, found, severity, self._figures(user_input, found))

    def promising(self, kind: str, rng: np.random.Generator) -> tuple[Point, float]:
        """Draw points of a kind; return the one with the largest outputs that are trusted.

        Its promise is 0 where nothing is trusted.
        """
        points = [Point.random(kind, len(self.channels), rng) for _ in range(DRAWN)]
        promises = [self._promise(point) for point in points]
        best = int(np.argmax(promises))
        return points[best], promises[best]

    def _promise(self, point: Point) -> float:
        drawn = self.drawn(point.user_input(self.channels))
        first = first_measured(self.surrogate, drawn.burn_in)
        _, trusted = self.surrogate.error_bounds_and_flag(drawn.inputs)
        outputs = self.surrogate.predict_newest(drawn.inputs)[first:]
        varied = outputs.std(axis=0) / self.surrogate.output_scaling.scale
        return float(varied.max() * trusted[first:].mean() ** 2)

    def _figures(self, user_input: UserInput, found: MeasuredInputs) -> TryFigures:
        output = int(np.argmax(found.ratios[found.step]))
        counted, signal = slice(found.first, None), self.surrogate.outputs[output]
        errors, above = found.errors[counted], (found.errors > found.bounds)[counted]
        trusted, large = found.trusted[counted], errors > HARMFUL * self.usual
        reference = found.reference[counted]
        error, about_mean = (
            float(rms(v)[output]) for v in (errors, reference - reference.mean(axis=0))
        )
        return TryFigures(
            kind=user_input.kind,
            inputs=user_input.words,
            over_bound=found.ratio,
            output=signal.name,
            unit=signal.unit,
            relative_rmse=error / about_mean if about_mean else None,
            largest_error=float(errors[:, output].max()),
            flagged=float(np.mean(~trusted)),
            harmful=float(np.mean(large.any(axis=1))),
            unnoticed=float(np.mean((large & above).any(axis=1) & trusted)),
        )


class _Turns:
    """All kinds take turns, in random orders; one that is not trusted at all is passed over."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng, self._kinds = rng, list[str]()

    def drawn(self, stage: Stage) -> Point:
        """Return the next point that is drawn."""
        for _ in KINDS:
            self._kinds = self._kinds or self._rng.permutation(list(KINDS)).tolist()
            point, promise = stage.promising(self._kinds.pop(), self._rng)
            if promise > 0:
                break
        return point


def _near_worst(tries: Sequence[Try], index: int, rng: np.random.Generator) -> Point:
    """Draw a point near the worst try; while nothing is broken, also near other kinds' worst."""
    by_kind: dict[str, Try] = {}
    for one in TriedInputs(tries).worst_first:
        by_kind.setdefault(one.point.kind, one)
    parent, sizes = next(iter(by_kind.values())), NEAR
    if parent.severity <= BROKEN and index % 2:
        others = list(by_kind.values())[:OTHERS]
        parent, sizes = others[index // 2 % len(others)], FARTHER
    return parent.point.near(math.exp(rng.uniform(*np.log(sizes))), rng)


def try_inputs(
    surrogate: Surrogate,
    case: Case,
    usual: FloatArray,
    seed: int,
    count: int,
    progress: Progress,
) -> TriedInputs:
    """Try ``count`` inputs, each simulated once; of the first half, all kinds take turns.

    Args:
        surrogate: the one with the bound.
        case: its recipe and its reference.
        usual: 95 % quantile of the absolute errors in range, (n_outputs,), in the outputs' units.
        seed: seed of all draws.
        count: number of tries.
        progress: gets the number of tries that are done.

    Raises:
        LoadError: the reference system is not installed here.
        ValueError: the surrogate has no error bound.
    """
    stage, rng = Stage.of(surrogate, case, usual), np.random.default_rng((seed, count))
    tries: list[Try] = []
    failed, turns = 0, _Turns(rng)
    progress(0, count)
    for index in range(count):
        if index < (count + 1) // 2 or not tries:
            point = turns.drawn(stage)
        else:
            point = _near_worst(tries, index, rng)
        try:
            tries.append(stage.tried(point))
        except SimulationError:
            failed += 1
        progress(index + 1, count)
    return TriedInputs(tries, failed)
