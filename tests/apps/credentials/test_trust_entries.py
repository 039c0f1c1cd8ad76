"""Credentials have the figures of estimates and bounds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from slide_fmu.apps.credentials.metadata import OWN
from slide_fmu.apps.credentials.statements import statements
from slide_fmu.report.limits import limits
from slide_fmu.report.trust_sentences import bound_sentences
from tests.recipes import whole_recipe
from tests.validation.handmade import bounded, comparison, trust_outputs
from tests.validation.tiny_validation import figures_of

STILL = [0.5, 0.5, 0.5, 0.5]
FIRST = comparison(
    [[1.0, 0.1], [-2.0, 0.1], [3.0, 0.2], [4.0, 0.1]],
    trust=trust_outputs([[2.0, 0.2], [3.0, 0.2], [2.0, 0.3], [5.0, 0.4]], STILL),
)
SECOND = comparison(
    [[-1.0, 0.1], [2.0, 0.9], [3.0, 0.9], [1.0, 0.1]],
    kind=1,
    trust=trust_outputs([[2.0, 0.2], [3.0, 0.3], [4.0, 0.4], [2.0, 0.5]], [0.5, 3.0, 3.0, 0.5]),
)
THIRD = replace(SECOND, trust=trust_outputs([[9.0, 9.0]] * 4, STILL))


def test_harm_stands_by_kind_where_usual_errors_are_known() -> None:
    known = replace(bounded(FIRST, SECOND, THIRD), usual=np.array([1.0, 0.2]))
    provenance = {"measured": figures_of(known).dump()}
    entries = {e.keyword: e.value for e in statements(known.surrogate, known.recipe, provenance)}
    rows = list(entries["error_bound.harm"])
    assert [row.get("name") for row in rows] == ["all", "held_random", "sweep"]
    assert float(rows[1].get("harmful")) == 1 / 4


def test_kinds_that_the_bound_alone_has_learnt_from_have_a_table() -> None:
    found = bounded(FIRST, SECOND)
    kind = {"kind": "binary", "weight": 2.0, "duration": [0.1, 0.3]}
    values = found.recipe.model_dump()
    table = {**values["bound"], "excitation": (kind,)}
    recipe = whole_recipe({**values, "bound": table})
    entries = {e.keyword: e.value for e in statements(found.surrogate, recipe, {})}
    (row,) = entries["error_bound.learnt_from"]
    assert (row.get("kind"), row.get("weight")) == ("binary", "2.0")
    plain = {e.keyword for e in statements(found.surrogate, found.recipe, {})}
    assert "error_bound.learnt_from" not in plain


def credentials_of(*comparisons: Any) -> dict[str, Any]:
    found = bounded(*comparisons)
    provenance = {"measured": figures_of(found).dump()}
    entries = statements(found.surrogate, found.recipe, provenance)
    return {entry.keyword: entry.value for entry in entries}


def test_credentials_have_bound_domain_and_where_they_count() -> None:
    found = credentials_of(FIRST, SECOND, THIRD)
    first, second = found["error_bound"].iter(f"{{{OWN}}}Bound")
    assert (first.get("output"), second.get("output")) == ("y0", "y1")
    assert float(first.get("coverage")) == 11 / 12
    assert float(first.get("flagged")) == 2 / 12
    rows = list(found["error_bound.excitations"])
    assert [(row.get("name"), row.get("output")) for row in rows] == [
        *(("held_random", "y0"), ("held_random", "y1")),
        *(("sweep", "y0"), ("sweep", "y1")),
    ]
    assert float(rows[3].get("lowest_coverage")) == 1 / 2
    measured = figures_of(bounded(FIRST, SECOND, THIRD))
    own = bounded(FIRST)
    sentences = bound_sentences(own.recipe, own.surrogate, measured.in_range)
    assert set(sentences) < set(found["limits"])
    assert limits(own.surrogate, own.recipe, measured) == found["limits"]
