"""The recipe's table ``bound`` is about the error bound and the domain."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import Field

from slide_fmu.core.block_means import N_BLOCKS, block_lengths, span_samples
from slide_fmu.excitation.mix import Excitation
from slide_fmu.recipe.learning import PositiveFloat, PositiveInt, StateSpaceRecipe, Table

if TYPE_CHECKING:
    from slide_fmu.recipe.recipe import Recipe


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


def require_bound(recipe: Recipe) -> None:
    """Refuse an error bound where it cannot be learnt.

    Raises:
        ValueError: the message has the remedy.
    """
    if recipe.bound is None:
        if recipe.validation.adversarial:
            raise ValueError(
                f"validation.adversarial = {recipe.validation.adversarial} without a table "
                "[bound]; expected an error bound, which the search attacks: add [bound], or "
                "remove the key"
            )
        return
    remedy = "remove the tables [bound] and [bound.companion]"
    if recipe.system.is_record:
        raise ValueError(
            "[bound] with system.kind = 'record'; expected a system that can be simulated, since "
            f"a bound needs hundreds of trajectories of its own: {remedy}"
        )
    if recipe.parameters:
        raise ValueError(
            f"[bound] with parameters {list(recipe.parameters)}; expected none: an error bound of "
            f"a surrogate with physical parameters is not built: {remedy}, or the parameters; a "
            "table [estimator] in their place gives an error estimate"
        )
    if not isinstance(recipe.network, StateSpaceRecipe):
        raise ValueError(
            f"[bound] with network.family = {recipe.network.family!r}; expected 'state_space': "
            f"choose it, or {remedy}"
        )
    start = getattr(recipe.training, "start", None)
    if start is not None:
        raise ValueError(
            f"[bound] with training.start = {start!r}; expected none: the companion would begin "
            f"with the same network, and share its errors: {remedy}, or the key"
        )
    if recipe.bound.companion.start == "surrogate" and recipe.bound.companion.hidden is not None:
        raise ValueError(
            f"bound.companion.hidden = {recipe.bound.companion.hidden} with bound.companion.start "
            "= 'surrogate'; expected one of them: a companion that begins with the surrogate's "
            "network has its size"
        )
    _require_further(recipe.data.further, recipe.bound)
    if recipe.bound.estimate_span is not None and recipe.estimator is not None:
        raise ValueError(
            f"bound.estimate_span = {recipe.bound.estimate_span:g} s beside a table [estimator]; "
            "expected one error estimate: remove the key, or the table"
        )
    if recipe.bound.short_span > recipe.bound.long_span:
        raise ValueError(
            f"bound.short_span = {recipe.bound.short_span:g} s, bound.long_span = "
            f"{recipe.bound.long_span:g} s; expected the short one to be the shorter one"
        )


def _require_further(count: int, bound: BoundRecipe) -> None:
    if bound.excitation and count == 1:
        raise ValueError(
            "data.further = 1 with kinds under [[bound.excitation]]; expected at least 2, one of "
            "them to choose by: raise it, or remove the key"
        )
    if count and not bound.excitation:
        raise ValueError(
            f"data.further = {count} without kinds under [[bound.excitation]]; expected some, of "
            "which these trajectories are: add them, or remove the key"
        )


def companion_recipe(recipe: Recipe, attempt: int) -> Recipe:
    """Return the recipe by which an attempt, counted from 0, fits the companion's network."""
    assert recipe.bound is not None
    own = recipe.bound.companion.model_dump(exclude_none=True, exclude={"start"})
    seed = recipe.training.seed + recipe.bound.seed + 1 + attempt
    size = {name: own.pop(name) for name in ("hidden",) if name in own}
    return recipe.model_copy(
        update={
            "network": recipe.network.model_copy(update=size),
            "training": recipe.training.model_copy(update={"seed": seed, **own}),
        }
    )


def bound_samples(recipe: Recipe) -> int:
    """Return how many samples a trajectory needs for the bound; none without one.

    The window, or what the bound must know before it counts, if that is longer; and after it one
    mean over the long blocks, so that there is something to calibrate by.
    """
    if recipe.bound is None:
        return 0
    window, long = recipe.window, _long_block(recipe)
    span = span_block(recipe.bound, window.step) or 0
    known = max(window.n_in, window.n_in - window.n_out + 1 + (N_BLOCKS + 1) * long)
    return known + (N_BLOCKS + 1) * span + N_BLOCKS * long


def bound_filling(recipe: Recipe) -> int:
    """Return how many samples of the inputs a bound must know to count; none without one.

    They are also those that its error estimate must know.
    """
    if recipe.bound is None:
        return 0
    window = recipe.window
    longest = _long_block(recipe) + (span_block(recipe.bound, recipe.window.step) or 0)
    return window.n_in - window.n_out + 1 + (N_BLOCKS + 1) * longest


def spans_of(bound: BoundRecipe) -> str:
    """Name the times over which a bound averages, with their values."""
    names = ["long_span", *(["estimate_span"] if bound.estimate_span else [])]
    return " and ".join(f"bound.{name} = {getattr(bound, name):g} s" for name in names)


def span_block(bound: BoundRecipe | None, step: float) -> int | None:
    """Return the samples, of a step in s, in a block of ``estimate_span``; None without it."""
    if bound is None or bound.estimate_span is None:
        return None
    return max(1, round(bound.estimate_span / step / (N_BLOCKS + 0.5)))


def span_length(recipe: Recipe) -> int:
    """Return over how many samples the bound's error estimate is; none without one."""
    block = span_block(recipe.bound, recipe.window.step)
    return 0 if block is None else span_samples(block)


def _long_block(recipe: Recipe) -> int:
    """Return the samples in a long block."""
    assert recipe.bound is not None
    spans = recipe.bound.short_span, recipe.bound.long_span
    return block_lengths(recipe.window.step, spans)[1]
