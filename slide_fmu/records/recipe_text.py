"""This module writes a first recipe of measured records, with comments on its assumptions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from slide_fmu.recipe.writing import (
    Draft,
    comment_lines,
    heading_lines,
    signals_lines,
    value_text,
)
from slide_fmu.systems.declared import Parameter


@dataclass(frozen=True)
class Mend:
    """A Mend says why records cannot be used as they are, and what would have to change.

    Attributes:
        reason: the message of the refusal.
        parameters: keys of ``system.parameters`` that would mend it, if there are some.
        remaining: amplitude of initial effects that the longest window leaves; None if none fits.
        step: sample step in s that belongs to the keys; None where it may stay.
    """

    reason: str
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    remaining: float | None = None
    step: float | None = None


@dataclass(frozen=True)
class RecordDraft(Draft):
    """A RecordDraft holds the contents of a first recipe of records.

    Attributes:
        paths: the files, at least one.
        by: how the records are divided.
        by_origin: the reason for this division.
        no_estimate: why the recipe has no error estimator; None where it has one.
        parameters: the keys of ``system.parameters``.
        remaining_amplitude: amplitude of initial effects that the window leaves.
        mend: what would have to change first; None where nothing has to.
    """

    paths: Sequence[str]
    by: Literal["block", "each", "record"]
    by_origin: str
    no_estimate: str | None
    parameters: dict[str, Parameter] = field(default_factory=dict)
    remaining_amplitude: float = 1e-3
    mend: Mend | None = None


_NETWORK = (
    "[network]",
    *comment_lines(
        "Half of the hidden units are clipped cubes, and half are tanh. Springs that harden need "
        "fewer units this way. Do you use the FMU beyond the amplitudes of the records? Then "
        'write "auto". Trial networks then learn from small amplitudes, and the one with the '
        "least error at the largest amplitudes is taken."
    ),
    'units = "mixed"',
    "",
)


def record_recipe_text(draft: RecordDraft) -> str:
    """Write a recipe as TOML; ``slide_fmu.recipe.reading.parse_recipe`` reads it."""
    lines = [
        *_mend_lines(draft.mend),
        *heading_lines(draft.name, draft.description),
        *_system_lines(draft),
        *signals_lines(draft.inputs, draft.outputs),
        *_window_lines(draft),
        *_data_lines(draft),
        *_NETWORK,
        *_estimator_lines(draft.no_estimate),
    ]
    return "\n".join(lines)


def _mend_lines(mend: Mend | None) -> list[str]:
    if mend is None:
        return []
    return [
        *comment_lines(
            "slide-fmu init refused these records as they are. Mend what follows, in the files or "
            "by the keys below that stand behind #. Then slide-fmu try checks it again."
        ),
        *(line for reason in mend.reason.splitlines() for line in ("#", *comment_lines(reason))),
        "",
    ]


def _system_lines(draft: RecordDraft) -> list[str]:
    model, *further = draft.paths
    mended = {} if draft.mend is None else dict(draft.mend.parameters)
    return [
        "[system]",
        'kind = "record"',
        f"model = {value_text(model)}",
        *([f"further = {value_text(further)}"] if further else []),
        *([f"parameters = {value_text(draft.parameters)}"] if draft.parameters else []),
        *([f"# parameters = {value_text({**draft.parameters, **mended})}"] if mended else []),
        "",
    ]


def _window_lines(draft: RecordDraft) -> list[str]:
    mend = draft.mend or Mend("")
    longest = [f"# remaining_amplitude = {value_text(mend.remaining)}"] if mend.remaining else []
    longer = [f"# step = {value_text(mend.step)}"] if mend.step else []
    return [
        "[window]",
        *comment_lines(draft.step_origin),
        f"step = {value_text(draft.step)}",
        *longer,
        *comment_lines(
            "The window is as long as the memory of the system: after it, this part is left of "
            "what happened before. slide-fmu finds its lengths n_in and n_out from the poles of a "
            "linear fit."
        ),
        f"remaining_amplitude = {value_text(draft.remaining_amplitude)}",
        *longest,
        "",
    ]


def _data_lines(draft: RecordDraft) -> list[str]:
    return [
        "[data]",
        *comment_lines(draft.by_origin),
        f"by = {value_text(draft.by)}",
        *comment_lines(
            "These are the shares of all samples for the training, for the choice among networks, "
            "and for the test. An error estimator has two shares of its own, estimator and "
            "estimator_validation."
        ),
        "# shares = { train = 0.7, validation = 0.15, test = 0.15 }",
        "",
    ]


FEW_SAMPLES = (
    "The FMU has no error estimate: that needs more samples than there are here, with inputs of "
    "their own and all outputs. With more samples, add the table [estimator]."
)
LONG_MEMORY = (
    "The FMU has no error estimate: its network would see the whole window, and take longer to "
    "train than the FMU itself. If you have the time, add the table [estimator]."
)
"""Reasons why a recipe has no error estimator."""


def _estimator_lines(no_estimate: str | None) -> list[str]:
    bound = comment_lines(
        "With a table [bound], the FMU has a bound of its error in every step. It takes samples "
        "of its own: 20 blocks that are held out, each as long as the memory of the machine."
    )
    if no_estimate is None:
        return [
            *comment_lines("With this table, the FMU estimates its own error."),
            "[estimator]",
            *bound,
            "",
        ]
    return [
        *comment_lines(no_estimate),
        *bound,
        "",
    ]
