"""Dataclasses hold what error bounds, domain and the search for unnoticed errors are worth.

They belong to ``error_figures``. Shares are of samples; lists of shares have a value per output.
"""

from __future__ import annotations

from dataclasses import dataclass

from slide_fmu.core.figures import optional


@dataclass(frozen=True, kw_only=True)
class OutputBound:
    """These are the measures of the error bound of one output.

    Attributes:
        coverage: share of the samples whose error stays below the bound.
        coverage_of_worst_trajectories: the 5 % worst trajectories have less.
        width: mean bound over the quantile of the errors.
        skill: 1 minus the ratio of the pinball losses of the bound and of the best constant.
        rank_correlation: of bounds and errors; None where one of both is constant.
    """

    name: str
    coverage: float
    coverage_of_worst_trajectories: float
    width: float | None
    skill: float | None
    rank_correlation: float | None


@dataclass(frozen=True, kw_only=True)
class DomainFigures:
    """These are the shares of samples outside of the domain, and of trajectories often outside.

    Attributes:
        untrusted: share of samples at which ``trusted`` is false.
    """

    flagged: float
    trajectories_flagged: float
    untrusted: float


@dataclass(frozen=True, kw_only=True)
class Harm:
    """This is the harm that errors do, as shares of samples.

    A sample is flagged where ``trusted`` is false.

    Attributes:
        harmful: samples with an error far above the usual one.
        harmful_flagged: share of these that are flagged; None without any.
        harmless_flagged: the same share of the harmless samples.
        harmful_unnoticed: harmful ones, not flagged, whose bound does not cover the error.
    """

    harmful: float
    harmful_flagged: float | None
    harmless_flagged: float | None
    harmful_unnoticed: float


@dataclass(frozen=True, kw_only=True)
class KindBound(DomainFigures):
    """These are the measures of bound and domain on one kind of excitation."""

    name: str
    trajectories: int
    coverage: tuple[float, ...]
    lowest_coverage: tuple[float, ...]
    harm: Harm | None = optional()


@dataclass(frozen=True, kw_only=True)
class Covered:
    """This is how bounds do in one call.

    Attributes:
        coverage: share of the samples that bounds cover, of each output.
        untrusted: share of the samples where ``trusted`` is false.
        harm: harm of the errors of this call; None where the usual error is not known.
    """

    coverage: tuple[float, ...]
    untrusted: float
    harm: Harm | None = optional()


@dataclass(frozen=True, kw_only=True)
class ToleranceRow:
    """These are the tolerances of all outputs with which a share of samples is not trusted.

    Attributes:
        alarms: the share, of samples in range.
        tolerances: in the outputs' units; None where domain and ranges alone give more alarms.
    """

    alarms: float
    tolerances: tuple[float, ...] | None


@dataclass(frozen=True, kw_only=True)
class BoundFigures(DomainFigures):
    """These are the measures of error bound and domain.

    Attributes:
        tolerances: by the share of false alarms; only in range.
        plain, known_to_step_end: coverage in both calls of an FMU whose inputs move.
        harm: where the usual error in range is known.
    """

    confidence: float
    outputs: tuple[OutputBound, ...]
    plain: Covered | None = optional()
    known_to_step_end: Covered | None = optional()
    harm: Harm | None = optional()
    excitations: tuple[KindBound, ...]
    tolerances: tuple[ToleranceRow, ...] = optional(())


@dataclass(frozen=True, kw_only=True)
class TryFigures:
    """These are the errors on one input as users set it, over its whole record.

    Attributes:
        kind: its kind in words.
        inputs: a text by which it can be repeated.
        over_bound: largest error over its bound of 95 % where the FMU says nothing.
        output, unit: the output with this error.
        relative_rmse: of this output; None where its reference rests.
        largest_error: of this output, in its unit.
        flagged: share of samples that the FMU reports.
        harmful, unnoticed: shares of samples, as in ``Harm``.
    """

    kind: str
    inputs: str
    over_bound: float
    output: str
    unit: str
    relative_rmse: float | None
    largest_error: float
    flagged: float
    harmful: float
    unnoticed: float


@dataclass(frozen=True, kw_only=True)
class SearchFigures:
    """These are the results of a search for unnoticed errors, from each start.

    Attributes:
        starts: number of unseen trajectories that the search began with.
        changes_tried: number of changes from each start.
        confidences: the usual confidence of bounds, and the highest.
        before, after: largest error over its bound at trusted steps, at the usual confidence.
        after_highest: the same after the search, at the highest confidence.
        broken, broken_at_highest: number of starts after which a bound is broken.
        tries: errors on inputs as users set them, the worst first; empty if none was tried.
        failed_tries: number of inputs that the reference could not be simulated on.
    """

    starts: int
    changes_tried: int
    confidences: tuple[float, float]
    before: tuple[float, ...]
    after: tuple[float, ...]
    after_highest: tuple[float, ...]
    broken: int
    broken_at_highest: int
    tries: tuple[TryFigures, ...] = optional(())
    failed_tries: int = optional(0)
