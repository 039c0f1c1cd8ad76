"""Windows are sized by few motions, and FMUs are measured under few tones, where no test looks."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def few_motions() -> Iterator[None]:
    """Take four motions for the decay, and one band of frequencies for tones, in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("slide_fmu.memory.motions.MOTIONS", 4)
        patch.setattr("slide_fmu.validation.tones.COLUMNS", 1)
        yield
