"""The page on trust prints what the released FMUs carry."""

from __future__ import annotations

from pathlib import Path

from tests.benchmarks.over_bounds import table

PAGE = Path(__file__).parents[2] / "docs" / "trust.md"


def test_page_on_trust_has_the_largest_errors_of_the_released_fmus() -> None:
    found = "\n".join(table())
    assert found in PAGE.read_text(encoding="utf-8"), (
        "docs/trust.md has other figures: write what python -m tests.benchmarks.over_bounds prints"
    )
