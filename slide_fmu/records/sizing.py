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
from slide_fmu.memory.decay import recommend_window, too_short
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
from slide_fmu.records.decay import RecordDecay, decay_of_records
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.parts import longest_scored
from slide_fmu.records.recipe_text import RecordDraft, record_recipe_text
from slide_fmu.records.remarks import about_repeats
from slide_fmu.records.rules import shares_of
from slide_fmu.records.segments import learnt_pieces

FEW_WINDOWS = 20
"""Records to learn from with fewer windows than this are remarked as short."""
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
        return too_short(self.window, self.needed)

    @property
    def remark(self) -> str | None:
        """Remark on the window; None without one."""
        windows = self.samples / self.window.n_in
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
        words = (
            f"the slowest pole of a linear fit of the records has the rate {decay.rate:.3g} 1/s, "
            f"with a standard deviation of {decay.deviation:.2g} 1/s, and the longest piece of "
            f"the records is {decay.longest:.4g} s long"
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

    Raises:
        NotForgettingError: no window can hold the memory of the system, which does not forget.
        RecipeError: lengths in the recipe do not fit the window, or there are too few samples.
    """
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
    most = longest_scored(lengths.recipe.guess, source)
    duration = round((min(scored, most) + window.n_truncated) * window.step, 12)
    data = {**lengths.values.get("data", {}), "duration": duration}
    values = {**lengths.values, "data": data}
    source_name = f"recipe {recipe.guess.name!r} with the lengths that its records need"
    return Lengths(recipe.with_found(values, source_name), values, sizing)


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


COARSER = 1e-2
"""Remaining amplitude of initial effects that the window of short records leaves."""


def with_fitting_window(
    draft: RecordDraft, paths: Sequence[str]
) -> tuple[RecordDraft, tuple[str, ...]]:
    """Return the draft with a window that fits into the records, and remarks.

    The window leaves a larger remaining amplitude than usual if only such a window fits. The paths
    are relative to the current folder.

    Raises:
        LoadError: the records cannot be used.
        RecipeError: no window fits, or initial effects do not decay within the records.
    """
    refused: RecipeError | None = None
    usual = _recipe(draft, paths)
    source = case_of(usual.guess).source
    assert isinstance(source, MeasuredRecords)
    for remaining in (draft.remaining_amplitude, COARSER):
        recipe = _recipe(replace(draft, remaining_amplitude=remaining), paths)
        try:
            lengths = lengths_of_records(recipe, source)
        except NotForgettingError as error:
            raise RecipeError(str(error)) from error
        except RecipeError as error:
            refused = refused or error
            continue
        few = None if lengths.sizing is None else lengths.sizing.remark
        kept = replace(draft, remaining_amplitude=remaining)
        again = about_repeats(lengths.recipe.guess, source)
        remarks = again, few, _coarser(draft, kept)
        return kept, tuple(remark for remark in remarks if remark)
    raise RecipeError(_too_short(usual.guess, source, str(refused))) from refused


def _recipe(draft: RecordDraft, paths: Sequence[str]) -> OpenRecipe:
    text = record_recipe_text(replace(draft, paths=paths))
    return parse_open_recipe(text, f"recipe {draft.name!r}")


def _coarser(draft: RecordDraft, kept: RecordDraft) -> str | None:
    """Return a remark that the window leaves a larger amplitude than usual."""
    if kept.remaining_amplitude == draft.remaining_amplitude:
        return None
    return (
        f"the records are short compared with the memory of the machine: the window leaves "
        f"{100 * kept.remaining_amplitude:g} % of what happened before it; expected "
        f"{100 * draft.remaining_amplitude:g} %: record more, and write the recipe anew"
    )


def _too_short(recipe: Recipe, source: MeasuredRecords, refused: str) -> str:
    """Return the message that the records are too short for the usual remaining amplitude."""
    sizing = size_records(recipe, source)
    lead, smallest = tidy(wanted_samples(sizing)), min(s for s in shares_of(recipe).values() if s)
    samples = sum(len(piece.trajectory.inputs) for piece in source.pieces)
    return (
        f"the records have {samples} samples, and the machine remembers {lead} of them, by the "
        f"slowest pole of a linear fit ({sizing.decay.time:.3g} s to "
        f"{recipe.window.remaining_amplitude:g}); expected at least "
        f"{math.ceil(lead / smallest)} samples, so that each part is longer than that: record "
        f"more ({refused})"
    )
