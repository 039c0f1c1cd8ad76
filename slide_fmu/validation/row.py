"""A row is the one type of figure by which an FMU is measured, for every kind of input.

Inputs, call and communication step decide a row. It has the errors, and what the FMU reported of
them.
Console, report, card, JSON, credentials and the table of the README show rows and nothing else.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from slide_fmu.core.figures import optional
from slide_fmu.core.measures import FEWEST
from slide_fmu.validation.task import BEYOND, HELD_OUT, IN_RANGE

Call = Literal["plain", "known", "model"]
"""How an importer calls. ``plain``: before each step it sets what the inputs are then. ``known``:
it sets what they reach by the step's end. ``model``: the plain call of the finest model in the
place of the FMU, which holds its inputs over the step."""

YOURS, SMOOTH, CONSTANT, TONES, AS_SET, SEARCH = (
    "your inputs",
    "smooth inputs",
    "constant inputs",
    "lasting tones in one input",
    "as users set them",
    "found by a search",
)
"""Groups of inputs besides those of ``slide_fmu.validation.task``."""

GROUPS = (YOURS, IN_RANGE, SMOOTH, CONSTANT, TONES, AS_SET, HELD_OUT, BEYOND, SEARCH)
"""All groups in the order in which they are shown."""

ALL = "all kinds"
"""Name of the inputs of a row that joins all kinds of a group."""

OF_TRAINING = "motions in range"
"""Name of smooth inputs where the motions of the training take the place of sines."""

FINER = 4
"""The plain call is measured at the surrogate's own step, and at one that is shorter by this
factor."""

HARMFUL = 3.0
"""An error is harmful if it is larger than the usual level by this factor."""

MOST_HARMFUL = 0.02
"""Largest share of harmful samples of a valid kind of inputs."""

MOST_SILENT = 0.01
"""Largest share of silent samples of a kind for which the FMU says where it is wrong."""

LEAST_COVERED = 0.88
"""Smallest share of the errors below the 95 % bound of valid inputs, with what chance does to few
motions. It does not count where the FMU trusts no more than ``FLAGGED`` of the samples."""

FLAGGED = 0.05
"""Inputs of which the FMU trusts no larger share of the samples are flagged throughout."""

FAR_OFF = 0.05
"""Relative RMSE above which an output is far off, unless a recipe requires another one."""


@dataclass(frozen=True, kw_only=True)
class ToneCell:
    """A ToneCell is a part of the band and of the amplitudes of tones.

    Attributes:
        hz: range of the frequencies in Hz.
        amplitude: range of the amplitudes, as parts of half the range of the input.
    """

    hz: tuple[float, float]
    amplitude: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class RowOutput:
    """These are the errors of one output.

    Attributes:
        name, unit: of the output.
        relative_rmse: RMSE over the RMS of the reference about its mean in range; at constant
            inputs, over that RMS in range; of your inputs, about its mean under these.
        rmse, largest_error: in the output's unit.
        covered: share of the samples whose error stays below the 95 % bound; None without one.
        width: mean bound over the usual level; None without a bound, or where that is not known.
    """

    name: str
    unit: str
    relative_rmse: float
    rmse: float
    largest_error: float
    covered: float | None = optional()
    width: float | None = optional()


@dataclass(frozen=True, kw_only=True)
class Row:
    """A Row is an FMU measured on some inputs, in one call, at one communication step.

    Shares are of the samples from which on ``error_bound_filled`` is 1 (``counted``). They are
    None of an FMU without an error bound, and where no sample counts.

    Attributes:
        group: one of ``GROUPS``.
        inputs: the kind of inputs in words, or ``ALL``.
        call: how the importer calls.
        step_s: its communication step H in s.
        steps: number of these in the surrogate's own step, h / H.
        trajectories: number of motions.
        samples: number of communication points at which errors are known.
        counted: number of them in which shares count.
        outputs: errors of each output.
        trusted: share with ``trusted`` true.
        harmful: share with an error above ``HARMFUL`` times the usual level; None where that is
            not known.
        silent: share of harmful samples at which ``trusted`` is true and an error that is harmful
            exceeds its bound.
        over_bound: largest error over its bound where ``trusted`` is true.
        failed: why the reference could not be simulated on some of the motions.
        tones: of lasting tones, which ones they are.
    """

    group: str
    inputs: str
    call: Call
    step_s: float
    steps: float
    trajectories: int
    samples: int
    counted: int
    outputs: tuple[RowOutput, ...]
    trusted: float | None = optional()
    harmful: float | None = optional()
    silent: float | None = optional()
    over_bound: float | None = optional()
    failed: tuple[str, ...] = optional(())
    tones: ToneCell | None = optional()

    @property
    def error(self) -> float:
        """The largest relative RMSE of the outputs."""
        return max(output.relative_rmse for output in self.outputs)

    @property
    def covered(self) -> float | None:
        """The smallest covered share of the outputs; None without one."""
        return min((o.covered for o in self.outputs if o.covered is not None), default=None)

    @property
    def width(self) -> float | None:
        """The largest width of the outputs; None without one."""
        return max((o.width for o in self.outputs if o.width is not None), default=None)

    @property
    def few(self) -> bool:
        """Whether these are too few motions to judge by.

        A search looks for one bad motion, and your inputs are what they are.
        """
        return self.trajectories < FEWEST and self.group not in (SEARCH, YOURS)

    @property
    def valid(self) -> bool | None:
        """Whether the FMU is valid on these inputs; None where that cannot be judged."""
        if self.harmful is None or self.few:
            return None
        harmless = self.harmful <= MOST_HARMFUL and (self.silent or 0.0) <= MOST_SILENT
        return harmless and not self.uncovered

    @property
    def uncovered(self) -> bool:
        """Whether the bound covers too little, although the FMU trusts some of the samples."""
        if self.covered is None or self.trusted is None:
            return False
        return self.covered < LEAST_COVERED and self.trusted > FLAGGED

    @property
    def far_off(self) -> bool:
        """Whether the error is large, however usual such an error is for this FMU."""
        return not self.error <= FAR_OFF

    @property
    def honest(self) -> bool | None:
        """Whether the FMU says where it is wrong; None where that cannot be judged."""
        return None if self.silent is None else self.silent <= MOST_SILENT and not self.uncovered

    def is_at(self, call: Call, steps: float) -> bool:
        """Tell whether this is the row of a call at a number of steps in the own step."""
        return self.call == call and abs(self.steps - steps) < 1e-6 * steps


def row_at(rows: Iterable[Row], group: str, inputs: str, call: Call, steps: float) -> Row | None:
    """Return the row of a group and its inputs, in a call; None where it was not measured."""
    of_inputs = (row for row in rows if row.group == group and row.inputs == inputs)
    return next((row for row in of_inputs if row.is_at(call, steps)), None)


def kinds_of(rows: Iterable[Row]) -> list[tuple[str, str]]:
    """Return group and inputs of all rows, each once, in the order in which they are shown."""
    kinds = dict.fromkeys((row.group, row.inputs) for row in rows)
    return sorted(kinds, key=lambda kind: (_place(kind[0]), kind[1] != ALL))


def _place(group: str) -> int:
    return GROUPS.index(group) if group in GROUPS else len(GROUPS)
