"""What a finished run raises; it needs none of the packages that draw reports."""

from __future__ import annotations


class QualityError(ValueError):
    """A surrogate is less accurate than its recipe requires."""
