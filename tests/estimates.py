"""Small trainings give poor error estimates, which a fit leaves out."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from slide_fmu.bounds import fit


@contextmanager
def kept_estimates() -> Iterator[None]:
    """Keep estimates however poor they are, for tests of what carries and shows them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fit, "useless_estimate", lambda surrogate, split: None)
        yield
