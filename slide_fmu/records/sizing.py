"""This module sizes the window of a recipe of records by the poles of a linear fit.

A proposed window fits into every part: a recipe that ``slide-fmu run`` would refuse is refused by
``slide-fmu init`` already.

The memory of the fitted network itself is tested afterwards, by ``memory.stability``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from slide_fmu.core.window import Window
from slide_fmu.memory.decay import recommend_window
from slide_fmu.memory.decay_figures import (
    FittedTime,
    LinearModelFigures,
    RecordSizingFigures,
    SlowestPole,
    WindowSize,
    finite,
)
from slide_fmu.memory.lengths import Lengths, both_lengths, tidy, with_window
from slide_fmu.memory.sizing import NotForgettingError
from slide_fmu.recipe.case import Case, case_of
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.reading import parse_open_recipe
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.records.decay import ENDLESS, RecordDecay, decay_of_records
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.parts import longest_scored, scored_parts
from slide_fmu.records.recipe_text import LONG_MEMORY, RecordDraft, record_recipe_text
from slide_fmu.records.remarks import about_repeats
from slide_fmu.records.rules import shares_of
from slide_fmu.records.segments import lead_of, learnt_pieces

FEW_WINDOWS = 20
"""Records to learn from with fewer windows than this are remarked as short."""
CALIBRATING = 60
"""Wanted number of segments that calibrate an error bound; 95 % take 20, and fewer of them cover
more or less than that by chance."""
LONGEST = 2.0
"""Largest ratio of the window to the decay time, if the interval's upper end is longer."""


@dataclass(frozen=True, eq=False)
class RecordSizing:
    """A RecordSizing compares the window of a recipe with the decay time of its records.

    Attributes:
        window: the recipe's window.
        decay: the decay time by a linear fit.
        samples: samples of the part to learn from.
    """

    window: Window
    decay: RecordDecay
    samples: int

    @property
    def left_out(self) -> None:
        """No trajectory of records is left out."""
        return None

    @property
    def remaining_amplitude(self) -> float:
        """The fraction A_rel to which initial effects shall decay."""
        return self.decay.remaining_amplitude

    @property
    def states(self) -> int:
        """The number of states of the linear fit."""
        return self.decay.states

    @property
    def forgets(self) -> bool:
        """Tell whether some window can hold the memory of the system."""
        return not self.decay.lasts

    @property
    def needed(self) -> float:
        """The window must truncate this time in s: the decay time of the slowest pole."""
        return self.decay.time

    @property
    def wanted(self) -> float:
        """The time in s that a window is proposed for: the interval's upper end, in reason."""
        return min(self.decay.interval[1], LONGEST * self.decay.time)

    @property
    def problem(self) -> str | None:
        """Reason why this window is, or all windows are, too short; None if not."""
        if not self.forgets:
            return self._lasting()
        window = self.window
        enough = self._recommended()
        if window.n_in >= enough:
            return None
        lengths = f"{window.n_in} - {window.n_out} = {window.n_truncated}"
        return (
            f"window: n_in - n_out = {lengths} samples ({window.truncation_time:.4g} s) are "
            "truncated, but the slowest pole of a linear fit "
            f"takes {enough - window.n_out} samples ({self.needed:.4g} s) to decay: give n_in >= "
            f'{enough}, or n_in = "auto", a larger step, or a larger remaining amplitude'
        )

    @property
    def remark(self) -> str | None:
        """Remark on the window; None without one."""
        windows = self.samples / self.window.n_in
        if not self.decay.surely_decays:
            return (
                f"the memory of the machine is uncertain: the slowest pole of a linear fit has "
                f"the rate {self.decay.rate:.3g} 1/s, with a standard deviation of "
                f"{self.decay.deviation:.2g} 1/s: the test of fading memory in the run decides"
            )
        if windows >= FEW_WINDOWS:
            return None
        return (
            f"the part to learn from has {self.samples} samples, {windows:.3g} windows of "
            f"{self.window.n_in}; expected at least {FEW_WINDOWS}: record more, or take a larger "
            "step or remaining amplitude"
        )

    def figures(self) -> RecordSizingFigures:
        """Return the figures, as JSON files hold them."""
        value, low, high = map(finite, (self.decay.time, *self.decay.interval))
        known = self.forgets
        return RecordSizingFigures(
            remaining_amplitude=self.remaining_amplitude,
            fitted_decay_time_s=FittedTime(value=value, low=low, high=high),
            slowest_pole=SlowestPole(
                rate_1_s=self.decay.rate,
                rate_deviation_1_s=self.decay.deviation,
                angular_frequency_rad_s=self.decay.frequency,
            ),
            linear_model=LinearModelFigures(order=self.decay.order, states=self.decay.states),
            window=WindowSize.of(self.window),
            recommended_n_in=self._recommended() if known else None,
            sufficient=self.problem is None,
            refusal=self._lasting() if not known else None,
            remark=self.remark,
        )

    def _recommended(self) -> int:
        return recommend_window(self.needed, self.window.step, self.window.n_out).n_in

    def _lasting(self) -> str:
        decay = self.decay
        shown = decay.longest / self.window.step
        words = (
            f"the slowest pole of a linear fit has the rate {decay.rate:.3g} 1/s, with a standard "
            f"deviation of {decay.deviation:.2g} 1/s, and the longest piece to learn from has "
            f"{shown:.0f} samples, {decay.longest:.4g} s"
        )
        if decay.surely_decays:
            return (
                f"a memory that is longer than the pieces of the records: {words}. It falls to "
                f"{100 * math.exp(-ENDLESS):.2g} % within {-ENDLESS / decay.rate:.4g} s: record "
                "for longer in one piece, or learn from an input that leaves this part at rest"
            )
        if decay.frequency == 0.0:
            return (
                f"an integral, a drift, or a free direction: {words}: nothing says that what "
                "happened once is ever forgotten, so no window can hold it. Learn the rate of the "
                "output instead (its derivative, as the velocity of a position), remove the drift "
                "of the sensor, or record for longer if the system is merely slow"
            )
        return (
            f"an oscillation that does not decay: {words}. Give the system damping, leave out "
            "what drives the oscillation, or record for longer"
        )


def size_records(recipe: Recipe, source: MeasuredRecords) -> RecordSizing:
    """Fit the records that a recipe learns from, and compare its window with the decay time.

    With physical parameters, each specimen has a fit of its own, and the longest time counts.

    Raises:
        RecipeError: there are too few samples.
    """
    window = Window(recipe.window.step, recipe.window.n_in, recipe.window.n_out)
    groups = learnt_pieces(recipe, source)
    try:
        decays = [decay_of_records(own, recipe.window.remaining_amplitude) for own in groups]
    except ValueError as error:
        raise RecipeError(f"recipe {recipe.name!r}: {error}") from error
    slowest = max(decays, key=lambda decay: (decay.lasts, decay.time))
    return RecordSizing(window, slowest, sum(len(p.inputs) for own in groups for p in own))


def wanted_samples(sizing: RecordSizing) -> int:
    """Return the proposed number of samples that the window truncates."""
    return max(1, math.ceil(sizing.wanted / sizing.window.step * (1.0 - 1e-12)))


def lengths_of_records(recipe: OpenRecipe, source: MeasuredRecords) -> Lengths:
    """Find the lengths that a recipe leaves open; segments are no longer than its parts.

    Faults of the files come first in messages: they may pass for properties of the machine.

    Raises:
        NotForgettingError: no window can hold the memory of the system, which does not forget.
        RecipeError: lengths in the recipe do not fit the window, or there are too few samples.
    """
    try:
        return _lengths(recipe, source)
    except RecipeError as error:
        raise type(error)(behind_faults(source, str(error))) from error


def behind_faults(source: MeasuredRecords, conclusion: str) -> str:
    """Write a conclusion about a machine behind the faults of its files, a line each."""
    if not source.faults:
        return conclusion
    return "\n".join([*source.faults, f"with the files as they are: {conclusion}"])


def _lengths(recipe: OpenRecipe, source: MeasuredRecords) -> Lengths:
    sizing = None
    n_in: int = recipe.guess.window.n_in
    n_out: int | None = None
    if "window.n_in" in recipe.open_keys:
        sizing = size_records(recipe.guess, source)
        if not sizing.forgets:
            raise NotForgettingError(f"recipe {recipe.guess.name!r}: {sizing.problem}")
        n_in, n_out = both_lengths(recipe, tidy(wanted_samples(sizing)))
    lengths = with_window(recipe, n_in, n_out)
    if sizing is not None:
        sizing = replace(sizing, window=lengths.recipe.guess.window.as_window)
    if "data.duration" not in recipe.open_keys:
        return replace(lengths, sizing=sizing)
    window = lengths.recipe.guess.window.as_window
    scored = round(lengths.recipe.guess.data.duration / window.step - window.n_truncated)
    scored = min(scored, _calibrating(lengths.recipe.guess, source) or scored)
    most = longest_scored(lengths.recipe.guess, source)
    duration = round((min(scored, most) + window.n_truncated) * window.step, 12)
    data = {**lengths.values.get("data", {}), "duration": duration}
    values = {**lengths.values, "data": data}
    source_name = f"recipe {recipe.guess.name!r} with the lengths that its records need"
    return Lengths(recipe.with_found(values, source_name), values, sizing)


def _calibrating(recipe: Recipe, source: MeasuredRecords) -> int | None:
    """Return how long segments may be behind the truncated samples, for enough of a bound.

    It is None without a bound. The segments of a bound score no fewer samples than it needs,
    and than the machine remembers.
    """
    if recipe.bound is None:
        return None
    blocks = scored_parts(recipe, source)["calibration"]
    whole = sum(block.stop - block.scored for block in blocks)
    lead, truncated = lead_of(recipe, "calibration"), recipe.window.as_window.n_truncated
    least = max(recipe.bound.samples(recipe.window) - lead, truncated)
    return lead - truncated + max(least, whole // CALIBRATING)


def lengths_of_case(
    source: MeasuredRecords, case: Case, open_keys: tuple[str, ...], patience: float
) -> Lengths:
    """Find the lengths that the recipe of a case leaves open; ``patience`` is not used."""
    return lengths_of_records(OpenRecipe(case.recipe, open_keys), source)


def size_case(
    source: MeasuredRecords, case: Case, seed: int | None, patience: float
) -> RecordSizing:
    """Size the window of a case by a linear fit; seed and patience are not used."""
    return size_records(case.recipe, source)


AMPLITUDES = (1e-2, 2e-2, 5e-2, 0.1, 0.2, 0.5)
"""Remaining amplitudes of initial effects that windows for short records leave."""

MOST_LEFT = 0.1
"""A window that leaves more than this is not taken, but written as a comment."""


MOST_SEEN = 1500
"""Largest number of values of inputs that an error estimator sees: with 5400, of three inputs, its
training took 13 CPU-minutes, and that of the surrogate half a minute."""


class NoWindowError(RecipeError):
    """No window fits into the records that leaves as little as one may.

    Attributes:
        remaining: the remaining amplitude of the longest window that fits; None without one.
    """

    def __init__(self, message: str, remaining: float | None = None) -> None:
        super().__init__(message)
        self.remaining = remaining


def with_fitting_window(
    draft: RecordDraft, paths: Sequence[str]
) -> tuple[RecordDraft, tuple[str, ...]]:
    """Return the draft with the longest window that fits into the records, and all remarks.

    The window leaves a larger remaining amplitude than usual if only such a window fits. The paths
    are relative to the current folder.

    Raises:
        LoadError: the records cannot be used.
        NoWindowError: no window fits, or initial effects do not decay within the records.
    """
    refused: RecipeError | None = None
    usual = _recipe(draft, paths)
    source = case_of(usual.guess).source
    assert isinstance(source, MeasuredRecords)
    for remaining in (draft.remaining_amplitude, *AMPLITUDES):
        recipe = _recipe(replace(draft, remaining_amplitude=remaining), paths)
        try:
            lengths = _lengths(recipe, source)
        except NotForgettingError as error:
            raise NoWindowError(behind_faults(source, str(error))) from error
        except RecipeError as error:
            refused = refused or error
            continue
        kept = replace(draft, remaining_amplitude=remaining)
        window = lengths.recipe.guess.window.as_window
        if kept.no_estimate is None and window.memory_length * len(kept.inputs) > MOST_SEEN:
            return with_fitting_window(replace(draft, no_estimate=LONG_MEMORY), paths)
        if remaining > MOST_LEFT:
            text = f"{_too_short(usual.guess, source, str(refused))}. {_price(kept, lengths)}"
            raise NoWindowError(behind_faults(source, text), remaining)
        few = None if lengths.sizing is None else lengths.sizing.remark
        again = about_repeats(lengths.recipe.guess, source)
        remarks = *source.remarks, again, few, _coarser(draft, kept, lengths)
        return kept, tuple(remark for remark in remarks if remark)
    text = _too_short(usual.guess, source, str(refused))
    raise NoWindowError(behind_faults(source, text)) from refused


def _price(kept: RecordDraft, lengths: Lengths) -> str:
    """Say what a window that is shorter than usual costs."""
    window = lengths.recipe.guess.window
    share = 100 * kept.remaining_amplitude
    return (
        f"The longest window that fits has {window.n_in} samples "
        f"({window.n_in * window.step:.4g} s) and leaves {share:g} % of what happened before it: "
        f"a truncation error of up to {share:g} % of an output's standard deviation"
    )


def _recipe(draft: RecordDraft, paths: Sequence[str]) -> OpenRecipe:
    text = record_recipe_text(replace(draft, paths=paths))
    return parse_open_recipe(text, f"recipe {draft.name!r}")


def _coarser(draft: RecordDraft, kept: RecordDraft, lengths: Lengths) -> str | None:
    """Return a remark that the window leaves a larger amplitude than usual."""
    if kept.remaining_amplitude == draft.remaining_amplitude:
        return None
    return (
        "the records are short compared with the memory of the machine. "
        f"{_price(kept, lengths)}; expected {100 * draft.remaining_amplitude:g} %: record more, "
        "and write the recipe anew"
    )


def _too_short(recipe: Recipe, source: MeasuredRecords, refused: str) -> str:
    """Return the message that the records are too short for the usual remaining amplitude."""
    sizing = size_records(recipe, source)
    wanted, smallest = wanted_samples(sizing), min(s for s in shares_of(recipe).values() if s)
    lead, step = tidy(wanted), sizing.window.step
    samples = sum(len(piece.trajectory.inputs) for piece in source.pieces)
    return (
        f"the records have {samples} samples ({samples * step:.4g} s), and the machine remembers "
        f"{wanted} of them ({wanted * step:.4g} s): the slowest pole of a linear fit decays to "
        f"{recipe.window.remaining_amplitude:g} within {sizing.decay.time:.4g} s, or so long by "
        "its standard deviation; expected at least "
        f"{math.ceil(lead / smallest)} samples ({math.ceil(lead / smallest) * step:.4g} s), so "
        f"that the smallest part is longer than that: record more ({refused})"
    )
