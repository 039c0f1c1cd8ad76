"""This module checks and completes recipes of measured records.

They have parts and shares of samples in place of numbers of trajectories. Each file may belong to
another specimen, whose parameters are known.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import comb
from pathlib import Path
from typing import Any, Final, final, get_args

from slide_fmu.core.signals import Signal
from slide_fmu.recipe.automatic import Tables
from slide_fmu.recipe.estimator import EstimatorRecipe
from slide_fmu.recipe.kind_rules import KindRules, Motion, Words
from slide_fmu.recipe.learning import StateSpaceRecipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.recipe.tables import Part
from slide_fmu.records.specimens import SPECIMENS_PER_TERM, too_few_specimens

KIND = "record"
"""The kind of system whose trajectories are measured."""

PARTS: tuple[Part, ...] = get_args(Part)
"""The parts of records in the order of time; the FMU is measured on the last one."""

SHARES: dict[Part, float] = {"train": 0.7, "validation": 0.15, "test": 0.15}
"""Default shares of all samples without an error estimator."""

SHARES_WITH_ESTIMATOR: dict[Part, float] = {
    "train": 0.55,
    "validation": 0.12,
    "estimator": 0.15,
    "estimator_validation": 0.06,
    "test": 0.12,
}
"""Default shares with an error estimator, which learns from samples of its own."""

OF_ESTIMATOR, OF_BOUND = ("estimator", "estimator_validation"), ("bound", "calibration")
"""Parts that only an error estimator, or only an error bound, takes samples from."""

SHARES_OF_BOUND: dict[Part, float] = {"bound": 0.12, "calibration": 0.2}
"""With an error bound these parts come first; the others share the rest. The calibration needs
blocks by the score: each counts as one observation."""

SHORT_SPAN, LONG_SPAN = 10, 100
"""Samples over which a bound of records averages the disagreement, where the recipe says
nothing."""

DEGREES = 2, 1
"""Degrees of polynomials: the first one that the specimens suffice for is taken, else the last."""

OF_RECORD = "by the noise record"
OF_RESIDUALS = "by the flat bottom of the residuals' spectrum"
"""Words for the source of the outputs' noise."""


@final
class RecordRules(KindRules):
    """RecordRules are the rules for recipes of measured records."""

    words = Words(
        trained_on="measured records",
        stands_for="what was measured",
        truth="measured",
        reference="The reference is what was measured.",
        inputs_seen="The surrogate was trained on measured records; inputs of another kind it has "
        "never seen:",
        parameters="Every segment has the values of its specimen.",
        calibrated_by="blocks of the records that no network learnt from, each of which counts as "
        "one trajectory",
        more_data="longer records, with other inputs",
        where_flat=". Where a record rests most of the time, cut the rests short, and let its "
        'files begin at rest (system.parameters start = "rest")',
        # records cannot be simulated until they come to rest
        lasting_memory=" (a system with hysteresis, or with a drift, never forgets what happened "
        "to it: no network that has learnt its records passes)",
    )
    simulated = False

    def with_first_defaults(self, tables: Tables) -> Tables:
        """Refuse numbers of trajectories, since they follow from the samples."""
        data = tables.get("data", {})
        given = [key for key in PARTS[:-1] if isinstance(data, Mapping) and key in data]
        if given:
            raise ValueError(
                f"data.{given[0]} = {data[given[0]]!r} with system.kind = {KIND!r}; expected "
                "none: the samples of the records decide; give data.shares, or remove it"
            )
        tables = {"data": {}, **tables}
        data, bound = tables["data"], tables.get("bound")
        if not (isinstance(data, Mapping) and isinstance(bound, Mapping)):
            return tables
        # both networks learn from the same samples: no part of the records is to spare
        return {**tables, "data": {**data, "companion": "train"}, "bound": _with_spans(tables)}

    def with_last_defaults(self, tables: Tables) -> Tables:
        """Fill in the division and the degree of specimens, if not given.

        Each file is divided by itself, so that every part has every specimen. The degree of the
        polynomials is one that the specimens suffice for.
        """
        data, network = tables.get("data", {}), tables.get("network", {})
        parameters = tables.get("parameters")
        known = all(isinstance(table, Mapping) for table in (parameters, data, network))
        if not (known and parameters):
            return tables
        follows = network.get("family", StateSpaceRecipe().family) == StateSpaceRecipe().family
        degree = {"parameter_degree": _degree(parameters)} if follows else {}
        return {**tables, "data": {"by": "each", **data}, "network": {**degree, **network}}

    def require_fitting_tables(self, recipe: Recipe) -> None:
        _require_no_model(recipe)
        _require_shares(recipe)
        _require_weights(recipe)

    def require_parameters(self, recipe: Recipe) -> None:
        """Refuse parameters without one value for each file, or too few different ones."""
        files = 1 + len(recipe.system.further)
        for name, table in recipe.parameters.items():
            given = list(table.values)
            if len(given) != files:
                raise ValueError(
                    f"parameters.{name}.values = {given}; expected {files} of them, one for each "
                    "file of records: system.model first, then those of system.further in their "
                    "order"
                    + ("" if table.range is None else "; remove the range: it follows from them")
                )
            if len(set(given)) == 1:
                raise ValueError(
                    f"parameters.{name}.values = {given}; expected at least two that differ: "
                    "records of one value alone teach no parameter; remove it, or measure other "
                    "specimens"
                )
        problem = too_few_specimens(recipe, range(files))
        if problem is not None:
            raise ValueError(problem)

    def decisive_for_data(self, recipe: Recipe) -> Tables:
        """Return the lead by which records are cut, and what divides them into parts."""
        return {
            "lead": recipe.window.n_in - recipe.window.n_out,
            "shares": shares_of(recipe),
            "blocks": recipe.data.blocks or "spread",
            "degree": getattr(recipe.network, "parameter_degree", None),  # asks for specimens
        }

    def starts(self, recipe: Recipe) -> dict[str, float]:
        """Return no values: the parameters of records cannot be set."""
        return {}

    def draws_beyond(self, estimator: EstimatorRecipe, index: int) -> bool:
        return False

    def motions(self, recipe: Recipe) -> list[Motion]:
        """Return the files."""
        paths = [Path(path) for path in (recipe.system.model, *recipe.system.further)]
        names = [path.name for path in paths]
        alike = len(set(names)) < len(names)
        return [Motion(str(path) if alike else path.name, "measured") for path in paths]

    def described(
        self, recipe: Recipe, signals: tuple[Signal, ...], step: float, held_out: bool
    ) -> dict[str, str]:
        return {m.name: f"inputs like those of the file {m.name}" for m in self.motions(recipe)}

    def compared(self, recipe: Recipe, count: int, seed: int) -> str:
        return (
            f"{count} blocks of the records that nothing was learnt or chosen from, and the FMU "
            "run on their inputs. What was measured has noise of its own, which no surrogate can "
            f"predict: its RMS is known {self._origin_of_noise(recipe)}. Run freely, never handed "
            "over from window to window, the network begins with the state that the lead of a "
            "block shows."
        )

    @staticmethod
    def _origin_of_noise(recipe: Recipe) -> str:
        return OF_RESIDUALS if recipe.system.noise_record is None else OF_RECORD


RULES: Final = RecordRules()


def shares_of(recipe: Recipe) -> dict[Part, float]:
    """Return the share of all samples for each of ``PARTS``."""
    shares = SHARES if recipe.estimator is None else SHARES_WITH_ESTIMATOR
    if recipe.bound is not None:
        rest = 1.0 - sum(SHARES_OF_BOUND.values())
        shares = {**{part: rest * share for part, share in shares.items()}, **SHARES_OF_BOUND}
    given = recipe.data.shares or shares
    return {part: given.get(part, 0.0) for part in PARTS}


def _with_spans(tables: Tables) -> Tables:
    """Return the table of a bound; its spans follow from the step where it gives none."""
    bound, window = tables["bound"], tables.get("window")
    step = window.get("step") if isinstance(window, Mapping) else None
    expert = bound.get("expert", {})
    if not (isinstance(step, int | float) and isinstance(expert, Mapping)):
        return dict(bound)  # refused later
    spans = {"short_span": SHORT_SPAN * step, "long_span": LONG_SPAN * step}
    return {**bound, "expert": {**spans, **expert}}


def _degree(parameters: Mapping[str, Any]) -> int:
    """Return the degree that the values in tables, which are not checked yet, suffice for."""
    columns = [
        table.get("values", ()) for table in parameters.values() if isinstance(table, Mapping)
    ]
    different = len(set(zip(*columns, strict=False)))
    for degree in DEGREES:
        if different >= SPECIMENS_PER_TERM * comb(len(columns) + degree, degree):
            break
    return degree


def _require_no_model(recipe: Recipe) -> None:
    system, data = recipe.system, recipe.data
    given: dict[str, object] = {
        "system.reference": dict(system.reference),
        "system.picture": system.picture,
        "data.excitation": [kind.kind for kind in data.excitation],
        "loop": [loop.output for loop in recipe.loop],
        "data.beyond": data.beyond,
        "validation.duration": recipe.validation.duration,
        "training.expert.excitation": [kind.kind for kind in recipe.kinds_of_training()],
        "validation.excitation": [kind.kind for kind in recipe.validation.excitation],
    }
    for key, value in given.items():
        if value:
            raise ValueError(
                f"{key} = {value!r} with system.kind = {KIND!r}; expected none, since records "
                "cannot be simulated: remove it"
            )


def _require_weights(recipe: Recipe) -> None:
    """Refuse a noise record where the network's residuals cannot be weighted by its spectrum."""
    family = recipe.network.family
    if recipe.system.noise_record is not None and family != "state_space":
        raise ValueError(
            f"system.noise_record = {recipe.system.noise_record!r} with network.family = "
            f"{family!r}; expected network.family = 'state_space', whose residuals alone are "
            "weighted by the spectrum of noise: choose it, or remove the key"
        )


def _require_shares(recipe: Recipe) -> None:
    shares = shares_of(recipe)
    left_out = [
        *(OF_ESTIMATOR if recipe.estimator is None else ()),
        *(OF_BOUND if recipe.bound is None else ()),
    ]
    wanted = [part for part in PARTS if part not in left_out]
    lacking = [part for part in wanted if not shares[part]]
    idle = [part for part in PARTS if part not in wanted and shares[part]]
    total = sum(shares.values())
    if lacking or idle or abs(total - 1.0) > 1e-6:
        raise ValueError(
            f"data.shares = {dict(recipe.data.shares)}, {total:g} in all; expected positive "
            f"shares of {wanted}, 1 in all, and of nothing else: correct them, or remove the key"
        )
